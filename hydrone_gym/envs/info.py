"""The `info` of a step: plain Python numbers, new with every call."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.task import REPORT
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.storage import CROSSING_FIELDS, LOGGED_CROSSINGS

_OUTCOMES = tuple(Outcome)
_OUTCOME = REPORT.index("outcome")
_BATCH = ("outcome", "time", "energy", "clearance", "transitions", "reward_terms")
_BATCH_MASKS = tuple(f"_{name}" for name in _BATCH)
_TERM_MASKS = tuple(f"_{name}" for name in TERMS)


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


def conclude(info: dict[str, Any]) -> tuple[bool, bool]:
    """Return whether an episode is terminated and whether truncated; at either end note `is_success` in its info."""
    outcome = info["outcome"]
    if outcome is Outcome.RUNNING:
        return False, False
    info["is_success"] = outcome is Outcome.GOAL
    return outcome is not Outcome.TIMEOUT, outcome is Outcome.TIMEOUT


def crossings_of(log: np.ndarray, count: int) -> list[dict[str, Any]]:
    """Return the crossings of one period from its row's log; beyond `LOGGED_CROSSINGS` their details are not kept."""
    crossings = []
    for entry in log[: min(count, LOGGED_CROSSINGS)].tolist():
        crossing = dict(zip(CROSSING_FIELDS, entry, strict=True))
        crossing["direction"] = "exit" if crossing["direction"] > 0.0 else "entry"
        crossing["tilt"] = math.acos(crossing.pop("cos_tilt"))
        crossings.append(crossing)
    return crossings


def batch_info(report: np.ndarray, transitions: np.ndarray, mask: np.ndarray | None = None) -> dict[str, Any]:
    """Return `info` for many rows, arrays with their masks as Gymnasium's vector environments give them.

    Args:
        report: (n, len(REPORT)).
        transitions: (n,) object, a list of crossings a row.
        mask: (n,) which rows to fill in, the others are zero (None for objects); all unless given.
    """
    if mask is None:
        columns, crossings = report.T.copy(), transitions.copy()
        masks = np.ones((len(_BATCH) + len(TERMS), len(report)), bool)
    else:
        columns, crossings = np.where(mask, report.T, 0.0), transitions.copy()
        crossings[~mask] = None
        masks = np.repeat(mask[None], len(_BATCH) + len(TERMS), axis=0)
    terms: dict[str, Any] = dict(zip(TERMS, columns))
    terms |= zip(_TERM_MASKS, masks)
    values = (columns[_OUTCOME].astype(np.int64), *columns[_OUTCOME + 1 : _OUTCOME + 4], crossings, terms)
    info: dict[str, Any] = dict(zip(_BATCH, values, strict=True))
    return info | dict(zip(_BATCH_MASKS, masks[len(TERMS) :], strict=True))
