"""The frozen bounds: for worlds of frozen suites the fastest flights that a search found, see `planners.bound`.

A file in the package holds those of a suite, a control law and a vehicle: of each world the fastest flight that keeps
the rule of the zone and the fastest of all, with every reference, so that they can be flown again.
"""

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.evaluation.suites import FOLDER, level_of, load_suite

GRID = 256.0  # references are multiples of 1/256 m and rad: exact in single precision, and small to store
_FLIGHTS = ("kept", "free")  # names in a file: with the rule of the zone, and without


class BoundFlight(NamedTuple):
    """A flight that arrives."""

    time: float  # s
    energy: float  # of the rotors' shafts, J
    references: NDArray[np.float64]  # (K, 4) one a period: m, m, m, rad


class Bound(NamedTuple):
    """The fastest flights found in a world; None where none was."""

    kept: BoundFlight | None  # lateral speed in the transition zone at most that of a smooth crossing
    free: BoundFlight | None


def bounds_path(suite: str, vehicle: str, law: str = "paper") -> Path:
    """Return the file of a suite's bounds for a vehicle and a law, whether it is there or not."""
    return FOLDER / f"bounds-{suite}-{vehicle}-{law}.npz"


def save_bounds(path: str | os.PathLike[str], bounds: Mapping[str, Sequence[Bound]]) -> None:
    """Write the bounds of each mission's worlds, in their order; references must be multiples of 1 / `GRID`."""
    arrays: dict[str, Any] = {}
    for mission, worlds in bounds.items():
        for name in _FLIGHTS:
            flights = [getattr(bound, name) or BoundFlight(np.nan, np.nan, np.zeros((0, 4))) for bound in worlds]
            arrays[f"{mission}/{name}/numbers"] = np.array([(f.time, f.energy, len(f.references)) for f in flights])
            references = np.concatenate([GRID * flight.references for flight in flights])
            arrays[f"{mission}/{name}/references"] = stored = references.astype(np.int16)
            if not np.array_equal(stored, references):
                raise ValueError(f"references must be multiples of 1/{GRID:g} m and rad, those of {mission} are not")
    np.savez_compressed(path, **arrays)


def load_bounds(suite: str, vehicle: str, law: str = "paper") -> dict[tuple[str, int], Bound]:
    """Return what is known of a suite flown by a vehicle under a law, by mission and world; nothing without a file."""
    path, bounds = bounds_path(suite, vehicle, law), dict[tuple[str, int], Bound]()
    if not path.is_file():
        return bounds
    with np.load(path, allow_pickle=False) as arrays:
        for mission in dict.fromkeys(name.partition("/")[0] for name in arrays.files):
            kept, free = (_flights(arrays, f"{mission}/{name}") for name in _FLIGHTS)
            bounds |= {(mission, world): Bound(*pair) for world, pair in enumerate(zip(kept, free, strict=True))}
    return bounds


def _flights(arrays: Any, name: str) -> list[BoundFlight | None]:
    times, energies, lengths = arrays[f"{name}/numbers"].T
    parts = np.split(arrays[f"{name}/references"] / GRID, np.cumsum(lengths.astype(int))[:-1])
    flights = (BoundFlight(float(t), float(e), part) for t, e, part in zip(times, energies, parts, strict=True))
    return [flight if len(flight.references) else None for flight in flights]


def bounds_of(arguments: Mapping[str, Any]) -> dict[tuple[str, str, int], Bound]:
    """Return the bounds of an evaluation's worlds, given its arguments, by suite, mission and world.

    Only worlds of frozen suites have one, whose numbers are those that were flown, and not all of them. In weather it
    is that of the same world in still air.
    """
    found: dict[tuple[str, str, int], Bound] = {}
    for suite, fingerprint in arguments["suites"].items():
        still = suite if level_of(suite) is None else re.sub(r"\d", "0", suite, count=1)
        bounds = load_bounds(still, arguments["vehicle"], arguments["controller"] or "paper")
        if bounds and load_suite(suite).first(max(arguments["worlds"][suite].values())).fingerprint() == fingerprint:
            found |= {(suite, *place): bound for place, bound in bounds.items()}
    return found
