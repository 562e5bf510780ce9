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
