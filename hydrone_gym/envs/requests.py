"""What callers hand to an environment at reset and step: checked, and brought to the one form the kernels read."""

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.world.scenario import Scenario, load_scenario, validate

REFERENCE = "[x, y, z, psi] (m, m, m, rad)"


def reset_options(options: dict[str, Any] | None, *known: str) -> list[Any]:
    """Return the values of the known options of a reset, None for those not given; ValueError for an unknown one."""
    given = options or {}
    unknown = sorted(map(repr, set(given) - set(known)))
    if unknown:
        raise ValueError(f"unknown reset option {', '.join(unknown)}; known are {', '.join(map(repr, known))}")
    return [given.get(name) for name in known]


def requested_scenario(chosen: Any, simulation: Simulation, bounds: spaces.Box) -> Scenario | None:
    """Return a scenario that can be flown, loaded if a file is named; None, to draw one, stays None.

    `bounds` is the space of the observed obstacles, (num_obstacles, 4). Raises ValueError for what is no scenario, one
    that the vehicle cannot fly, or one that the observation cannot show.
    """
    if chosen is None:
        return None
    if isinstance(chosen, str | os.PathLike):
        chosen = load_scenario(Path(chosen))
    if not isinstance(chosen, Scenario):
        raise ValueError(f"scenario must be a Scenario or the path of its file, got {type(chosen).__name__}")
    validate(chosen, simulation.world, simulation.vehicle.radius)
    count, most = len(chosen.obstacles), bounds.shape[0]
    if count > most:
        raise ValueError(f"scenario must have at most num_obstacles={most} obstacles, got {count}")
    for index, (sphere, low, high) in enumerate(zip(chosen.obstacles, bounds.low, bounds.high)):
        if (sphere < low).any() or (sphere > high).any():
            between = f"{low.tolist()} and {high.tolist()}"
            raise ValueError(f"obstacle {index} must lie between {between} (m), got {sphere.tolist()}")
    return chosen


def requested_rows(mask: Any, count: int) -> NDArray[np.intp]:
    """Return which of `count` rows a mask names, all if it is None.

    Raises TypeError or ValueError unless it is (count,) bool with a True in it.
    """
    if mask is None:
        return np.arange(count)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
        raise TypeError(f"reset_mask must be an array of bool, got {mask!r}")
    if mask.shape != (count,) or not mask.any():
        raise ValueError(f"reset_mask must have shape ({count},) and a True in it, got {mask!r}")
    return np.flatnonzero(mask)


def load_reference(action: ArrayLike, low: NDArray, high: NDArray, out: NDArray[np.float64]) -> None:
    """Check an action and clip it to [low, high] into `out`; all (4,). ValueError unless it is four finite numbers."""
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
    """Return actions of many rows, of which `words` tell, row by row; ValueError for a wrong shape or not finite."""
    array: NDArray = np.asarray(actions, dtype, order="C")
    if array.shape != shape:
        raise ValueError(f"actions must have shape {shape} {words}, got {array.shape}")
    finite = np.isfinite(array)
    if not finite.all():
        bad = np.flatnonzero(~finite.all(axis=1)).tolist()
        raise ValueError(f"actions must be finite {words}; rows {bad} are not")
    return array
