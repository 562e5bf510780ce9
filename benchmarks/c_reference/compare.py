"""The kernel against a strict C reference of the same substep, scalar and sixteen lanes.

    python -m benchmarks.c_reference.compare [--rounds 15] [--json]

First the results are compared, bit for bit; then the time a substep takes, in turns. One substep is 10 ms of one
vehicle: control, dynamics and energy, and its fifth of a tick's swept collision with 20 spheres, bounds and outcome.
"""

import json
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import tyro
from rich.console import Console

from benchmarks import tables
from benchmarks.c_reference.build import FAST, FLAGS, CReference, compiler
from benchmarks.flying import OBSTACLES, flying_rows, lane_major, near_references, simulation, spheres_out_of_the_way
from benchmarks.timing import Contestant, in_turns, save
from hydrone_gym.simulation.clock import SUBSTEPS

ROWS = 256


class Kernel(Protocol):
    lanes: int
    ticks: int

    def advance(
        self, rows: np.ndarray, references: np.ndarray, obstacles: np.ndarray, closest: np.ndarray, count: int
    ) -> None: ...


@dataclass(frozen=True, kw_only=True)
class Settings:
    rounds: int = 15
    """turns of each contestant"""
    seconds: float = 0.1
    """CPU seconds of a turn"""
    json: bool = False
    """print JSON instead of a table; it is written to benchmarks/results in both cases"""


class Load:
    """The rows, references and spheres of one measurement."""

    def __init__(self, share_in_air: float, obstacles: int = OBSTACLES, count: int = ROWS, near: bool = False) -> None:
        rng = np.random.default_rng(1)
        self.rows = flying_rows(rng, count, share_in_air)
        self.references = near_references(rng, self.rows)
        self.spheres = spheres_out_of_the_way(rng, count)[:, :obstacles] - (40.0 if near else 0.0) * np.array(
            [1, 1, 1, 0]
        )
        self._flat = {lanes: lane_major(self.spheres, lanes) for lanes in (1, 16)}
        self._work = self.rows.copy()
        self._closest = {lanes: np.zeros((len(flat), obstacles * lanes)) for lanes, flat in self._flat.items()}

    def play(self, kernel: Kernel, periods: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """Advance the rows from their start; return them with the least distances. Overwritten by the next call."""
        self._work[:] = self.rows
        flat, closest = self._flat[kernel.lanes], self._closest[kernel.lanes]
        closest[:] = np.inf
        for _ in range(periods):
            kernel.advance(self._work, self.references, flat, closest, self.spheres.shape[1])
        return self._work, closest

    def contestant(self, name: str, kernel: Kernel) -> Contestant:
        """Count substeps."""

        def run() -> float:
            self.play(kernel)
            return len(self.rows) * kernel.ticks * SUBSTEPS

        return Contestant(name, run)


def difference(first: Kernel, second: Kernel) -> float:
    """Largest difference of anything the kernels leave behind after ten periods among obstacles; 0.0: equal bits."""
    load = Load(0.5, count=1000, near=True)
    rows, closest = (array.copy() for array in load.play(first, 10))
    other, near = load.play(second, 10)
    if rows.tobytes() == other.tobytes() and closest.tobytes() == near.tobytes():
        return 0.0
    flat, others = (array.view(np.float64).reshape(-1) for array in (rows, other))
    return float(np.nanmax(np.abs(flat[np.isfinite(flat)] - others[np.isfinite(flat)])))


def measure(settings: Settings, folder: Path) -> dict[str, Any]:
    """Compare, then time; ns a substep and ratios."""
    kernels: dict[str, Kernel] = {}
    differences = {}
    for lanes in (1, 16):
        ours = simulation(lanes)
        kernels[f"Numba, {lanes}"] = ours
        kernels[f"C, {lanes}"] = CReference(lanes, ours.values, ours.ticks, folder)
        kernels[f"C fast-math, {lanes}"] = CReference(lanes, ours.values, ours.ticks, folder, FAST)
        differences[lanes] = difference(ours, kernels[f"C, {lanes}"])
        if differences[lanes] > 1e-12:
            raise RuntimeError(f"C and Numba differ by {differences[lanes]:.3g} with {lanes} lanes: nothing to compare")
    loads = {
        "both media": Load(0.5),
        "air": Load(1.0),
        "water": Load(0.0),
        "both media, no obstacles": Load(0.5, obstacles=0),
    }
    times: dict[str, dict[str, float]] = {}
    for label, load in loads.items():
        contestants = [load.contestant(name, kernel) for name, kernel in kernels.items()]
        in_turns(contestants, settings.rounds, settings.seconds)
        times[label] = {contestant.name: 1e9 / contestant.rate for contestant in contestants}
    main = times["both media"]
    ratios = {
        "scalar, Numba / C": main["Numba, 1"] / main["C, 1"],
        "16 lanes, Numba / C": main["Numba, 16"] / main["C, 16"],
        "Numba, scalar / 16 lanes": main["Numba, 1"] / main["Numba, 16"],
    }
    return {"difference": differences, "flags": " ".join(FLAGS), "nanoseconds": times, "ratios": ratios}


def main() -> int:
    settings = tyro.cli(Settings, description=__doc__)
    if compiler() is None:
        print("No C compiler found (gcc, cc, clang or $CC): the C reference cannot be measured here.", file=sys.stderr)
        return 1
    with tempfile.TemporaryDirectory() as folder:
        measured = measure(settings, Path(folder))
    save("c_reference", "python -m benchmarks.c_reference.compare", {"measured": measured})
    if settings.json:
        print(json.dumps(measured))
    else:
        Console().print(tables.c_reference(measured))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
