"""The `info` of a step: plain Python numbers, new with every call."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.task import OUTCOME
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.storage import CROSSING_FIELDS, LOGGED_CROSSINGS

_OUTCOMES = tuple(Outcome)
_BATCH = ("outcome", "time", "energy", "clearance", "transitions", "reward_terms")
_KEYS = (*_BATCH, *(f"_{name}" for name in _BATCH))
_TERM_KEYS = (*TERMS, *(f"_{name}" for name in TERMS))


def info_of(
    report: Sequence[float], transitions: Sequence[dict[str, Any]], weather: dict[str, NDArray[np.float64]]
) -> dict[str, Any]:
    """Return what `info` holds, from one row of `REPORT`, its crossings so far, and the weather around it (1,)."""
    around = {name: values[0].copy() if values.ndim > 1 else values[0].item() for name, values in weather.items()}
    return {
        "outcome": _OUTCOMES[int(report[OUTCOME])],
        "time": report[OUTCOME + 1],
        "energy": report[OUTCOME + 2],
        "clearance": report[OUTCOME + 3],
        "transitions": [dict(crossing) for crossing in transitions],
        "reward_terms": dict(zip(TERMS, report)),
        **({"weather": around} if around else {}),
    }


def crossings_of(log: NDArray[np.float64], count: int) -> list[dict[str, Any]]:
    """Return the crossings of one period from its row's log; beyond `LOGGED_CROSSINGS` their details are not kept."""
    crossings = []
    for entry in log[: min(count, LOGGED_CROSSINGS)].tolist():
        crossing: dict[str, Any] = dict(zip(CROSSING_FIELDS, entry, strict=True))
        crossing["direction"] = "exit" if crossing["direction"] > 0.0 else "entry"
        crossing["tilt"] = math.acos(crossing.pop("cos_tilt"))
        crossings.append(crossing)
    return crossings


def batch_info(
    columns: NDArray[np.float64],
    transitions: np.ndarray,
    weather: dict[str, NDArray[np.float64]],
    mask: NDArray[np.bool_] | None = None,
) -> dict[str, Any]:
    """Return `info` for many rows, arrays with their masks as Gymnasium's vector environments give them.

    `columns` (len(REPORT), n) are not copied, `transitions` (n,) are objects, a list of crossings a row, `weather` is
    what moves around the rows, empty if nothing does. Rows that the `mask` (n,) leaves out are zero, None for objects.
    """
    terms, crossings = len(TERMS), transitions.copy()
    masks = np.ones((terms + len(_BATCH), len(transitions)), bool)
    if mask is not None:
        columns = np.where(mask, columns, 0.0)
        masks[:], crossings[~mask] = mask, None
    reward_terms: dict[str, Any] = dict(zip(_TERM_KEYS, (*columns[:terms], *masks[:terms])))
    values = (columns[OUTCOME].astype(np.int64), *columns[OUTCOME + 1 : OUTCOME + 4], crossings, reward_terms)
    info = dict(zip(_KEYS, (*values, *masks[terms:]), strict=True))
    if weather:
        there = np.ones(len(transitions), bool) if mask is None else mask
        around: dict[str, Any] = {}
        for name, numbers in weather.items():
            shown = there.reshape(-1, *[1] * (numbers.ndim - 1))
            around |= {name: np.where(shown, numbers, 0.0), f"_{name}": there.copy()}
        info |= {"weather": around, "_weather": there.copy()}
    return info
