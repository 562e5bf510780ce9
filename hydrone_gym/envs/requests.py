"""What callers hand to an environment at reset and step: checked, and brought to the one form the kernels read."""

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.simulation.outcome import RUNNING, Outcome
from hydrone_gym.world.scenario import Scenario, load_scenario, validate
from hydrone_gym.world.world import World

REFERENCE = "[x, y, z, psi] (m, m, m, rad)"


def requested_scenario(options: dict[str, Any] | None) -> Scenario | None:
    """Return the scenario that the options of a reset ask for, loaded if they name a file; None to draw one.

    Raises ValueError for an unknown option or for anything that is no scenario.
    """
    _check_known(options, ("scenario",))
    return _scenario((options or {}).get("scenario"))


def requested_rows(options: dict[str, Any] | None, count: int) -> tuple[NDArray[np.intp], list[Scenario | None]]:
    """Return which of `count` rows a reset is for, and what each of them is to fly (None: draw one).

    Raises TypeError or ValueError for an unknown option, a mask that is not (count,) bool with a True in it, or the
    wrong number of scenarios.
    """
    _check_known(options, ("scenario", "reset_mask"))
    given = options or {}
    mask = given.get("reset_mask")
    if mask is not None:
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError(f"reset_mask must be an array of bool, got {mask!r}")
        if mask.shape != (count,) or not mask.any():
            raise ValueError(f"reset_mask must have shape ({count},) and a True in it, got {mask!r}")
    rows = np.arange(count) if mask is None else np.flatnonzero(mask)
    chosen = given.get("scenario")
    if not isinstance(chosen, list | tuple):
        return rows, [_scenario(chosen)] * len(rows)
    if len(chosen) != count:
        raise ValueError(f"scenario must be one scenario or a sequence of {count}, got {len(chosen)}")
    return rows, [_scenario(chosen[row]) for row in rows]


def _check_known(options: dict[str, Any] | None, known: tuple[str, ...]) -> None:
    unknown = sorted(map(repr, set(options or {}) - set(known)))
    if unknown:
        raise ValueError(f"unknown reset option {', '.join(unknown)}; known are {', '.join(map(repr, known))}")


def _scenario(chosen: Any) -> Scenario | None:
    """Return a scenario, loaded if a file is named; None stays None."""
    if isinstance(chosen, str | os.PathLike):
        return load_scenario(Path(chosen))
    if chosen is not None and not isinstance(chosen, Scenario):
        raise ValueError(f"scenario must be a Scenario or the path of its file, got {type(chosen).__name__}")
    return chosen


def check_scenario(scenario: Scenario, world: World, vehicle_radius: float, bounds: spaces.Box) -> None:
    """Raise ValueError unless a vehicle of this radius (m) can fly a scenario and the observation can show it.

    `bounds` is the space of the observed obstacles, (num_obstacles, 4).
    """
    validate(scenario, world, vehicle_radius)
    count, most = len(scenario.obstacles), bounds.shape[0]
    if count > most:
        raise ValueError(f"scenario must have at most num_obstacles={most} obstacles, got {count}")
    for index, sphere in enumerate(scenario.obstacles):
        if (sphere < bounds.low[index]).any() or (sphere > bounds.high[index]).any():
            low, high = bounds.low[index].tolist(), bounds.high[index].tolist()
            raise ValueError(f"obstacle {index} must lie between {low} and {high} (m), got {sphere.tolist()}")


def check_running(outcome: float | None) -> None:
    """Raise ResetNeeded unless an episode has begun (None: it has not) and not ended."""
    if outcome is None:
        raise ResetNeeded("step() was called before reset(): call reset() first")
    if outcome != RUNNING:
        raise ResetNeeded(
            f"step() was called after the episode ended with {Outcome(int(outcome)).name}: call reset() first"
        )


def load_reference(
    action: ArrayLike, low: NDArray[np.float64], high: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    """Check an action and clip it to [low, high] into `out`; all (4,).

    Raises ValueError unless it is four finite numbers.
    """
    try:
        reference = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"action must be four numbers {REFERENCE}, got {action!r}") from None
    if reference.shape != (4,):
        raise ValueError(f"action must have shape (4,) {REFERENCE}, got {reference.shape}")
    # on four numbers math is several times faster than NumPy
    if not all(map(math.isfinite, reference.tolist())):
        raise ValueError(f"action must be finite {REFERENCE}, got {reference}")
    np.maximum(reference, low, out=out)
    np.minimum(out, high, out=out)


def checked(actions: ArrayLike, shape: tuple[int, int], words: str, dtype: type) -> NDArray:
    """Return the actions of many rows as an array; `words` say what they are.

    Raises ValueError for another shape, or naming the rows that are not finite.
    """
    array: NDArray = np.asarray(actions, dtype)
    if array.shape != shape:
        raise ValueError(f"actions must have shape {shape} {words}, got {array.shape}")
    finite = np.isfinite(array)
    if not finite.all():
        bad = np.flatnonzero(~finite.all(axis=1)).tolist()
        raise ValueError(f"actions must be finite {words}; rows {bad} are not")
    return array
