"""The `info` of a step: plain Python numbers, new with every call."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.task import REPORT
from hydrone_gym.simulation.block import CROSSING_FIELDS, LOGGED_CROSSINGS
from hydrone_gym.simulation.outcome import Outcome

_OUTCOMES = tuple(Outcome)
_OUTCOME = REPORT.index("outcome")


def info_of(report: Sequence[float], transitions: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what `info` always holds, from one row of `REPORT` and the crossings so far."""
    return {
        "outcome": _OUTCOMES[int(report[_OUTCOME])],
        "time": report[_OUTCOME + 1],
        "energy": report[_OUTCOME + 2],
        "clearance": report[_OUTCOME + 3],
        "transitions": [dict(crossing) for crossing in transitions],
        "reward_terms": dict(zip(TERMS, report)),
    }


def crossings_of(log: np.ndarray, count: int) -> list[dict[str, Any]]:
    """Return the crossings of one period from its row's log; beyond `LOGGED_CROSSINGS` their details are not kept."""
    crossings = []
    for entry in log[: min(count, LOGGED_CROSSINGS)].tolist():
        crossing = dict(zip(CROSSING_FIELDS, entry, strict=True))
        crossing["direction"] = "exit" if crossing["direction"] > 0.0 else "entry"
        crossings.append(crossing)
    return crossings


def batch_info(report: np.ndarray, transitions: np.ndarray) -> dict[str, Any]:
    """Return `info` for many rows, arrays with their masks as Gymnasium's vector environments give them.

    Args:
        report: (n, len(REPORT)).
        transitions: (n,) object, a list of crossings a row.
    """
    n = len(report)
    terms: dict[str, Any] = {}
    for k, name in enumerate(TERMS):
        terms[name], terms[f"_{name}"] = report[:, k].copy(), np.ones(n, bool)
    info = {
        "outcome": report[:, _OUTCOME].astype(np.int64),
        "time": report[:, _OUTCOME + 1].copy(),
        "energy": report[:, _OUTCOME + 2].copy(),
        "clearance": report[:, _OUTCOME + 3].copy(),
        "transitions": transitions.copy(),
        "reward_terms": terms,
    }
    return info | {f"_{key}": np.ones(n, bool) for key in info}


def masked(info: dict[str, Any], mask: np.ndarray) -> dict[str, Any]:
    """Return a batch's info with only the rows of a mask (n,) filled in, the others zero (None for objects)."""
    kept: dict[str, Any] = {}
    for key, value in info.items():
        if isinstance(value, dict):
            kept[key] = masked(value, mask)
        else:
            kept[key] = np.where(mask, value, None if value.dtype == object else np.zeros((), value.dtype))
    return kept
