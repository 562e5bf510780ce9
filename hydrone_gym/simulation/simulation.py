"""Python's handle on the kernel: constants packed once, working storage kept, rows advanced in place."""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.advance import DT, SUBSTEPS, TICK
from hydrone_gym.simulation.block import CROSSING_FIELDS, LANES, LOGGED_CROSSINGS, new_block
from hydrone_gym.simulation.model import pack_model
from hydrone_gym.simulation.rows import advance_rows, new_rows
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World


def ticks_in(period: float) -> int:
    """Number of ticks in a period (s); raises ValueError unless it is a positive multiple of the tick."""
    ticks = round(period / TICK)
    if ticks < 1 or abs(ticks * TICK - period) > 1e-9:
        raise ValueError(f"period must be a positive multiple of {TICK} s, got {period!r}")
    return ticks


class Simulation:
    """Advances rows of vehicles in one world model.

    Args:
        vehicle: the vehicle.
        world: the world.
        period: seconds between references, a multiple of 0.05.
        lanes: 1 for a single row, 16 for batches.
    """

    def __init__(self, vehicle: Vehicle, world: World, period: float = 0.5, lanes: int = 1) -> None:
        """Pack the model and make the working storage."""
        self.vehicle = vehicle
        self.world = world
        self.period = float(period)
        self.ticks = ticks_in(period)
        self.lanes = lanes
        self.values = pack_model(vehicle, world)
        self._block = new_block(lanes)
        self._log = np.zeros((lanes, LOGGED_CROSSINGS, len(CROSSING_FIELDS)))

    def advance(
        self,
        rows: np.ndarray,
        references: NDArray[np.float64],
        obstacles: NDArray[np.float64],
        closest: NDArray[np.float64],
        count: int,
        first: int = 0,
        last: int | None = None,
    ) -> None:
        """Advance rows in place through ticks [first, last) of a period; see `advance_rows` for the layout."""
        end = self.ticks if last is None else last
        advance_rows(
            rows, references, obstacles, closest, count, self.values, first, end, self.ticks, self._block, self._log
        )


def trajectory(
    simulation: Simulation,
    row: np.ndarray,
    references: NDArray[np.float64],
    obstacles: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], np.ndarray]:
    """Play a sequence of references from a row and sample every tick, with the same numbers as whole periods give.

    Args:
        simulation: a `Simulation` with one lane.
        row: (1,) dtype `ROW`; not changed.
        references: (K, 4) one reference a period (m, m, m, rad).
        obstacles: (M, 4) spheres x, y, z, r in m.

    Returns:
        Times (N,) in s, states (N, 12), the moving references (N, 4), and the final row. Ends early with the outcome.
    """
    # a copy, since a read-only array would compile another version of the kernel
    spheres = np.zeros((0, 4)) if obstacles is None else np.array(obstacles, dtype=np.float64)
    closest = np.full((1, len(spheres)), np.inf)
    flat = spheres.reshape(1, -1)
    row = row.copy()
    start = row["ticks"][0]
    times, states, moving = [0.0], [row["state"][0].copy()], [row["reference"][0].copy()]
    for reference in np.asarray(references, dtype=np.float64):
        old = row["reference"][0].copy()
        turn = (reference[3] - old[3] + np.pi) % (2.0 * np.pi) - np.pi
        move = np.append(reference[:3] - old[:3], turn)
        for tick in range(simulation.ticks):
            simulation.advance(row, reference[None], flat, closest, len(spheres), tick, tick + 1)
            times.append((row["ticks"][0] - start) * TICK)
            states.append(row["state"][0].copy())
            moving.append(old + move * ((tick + 1) / simulation.ticks))
            if row["outcome"][0] != 0:
                return np.array(times), np.array(states), np.array(moving), row
    return np.array(times), np.array(states), np.array(moving), row


def row_at(state: NDArray[np.float64], goal: NDArray[np.float64] | None = None) -> np.ndarray:
    """Return one row (1,) at a state, its reference where it is, memory empty; no goal means one out of reach."""
    row = new_rows(1)
    row["state"][0] = state
    row["reference"][0] = [*state[:3], state[5]]
    row["goal"][0] = np.inf if goal is None else goal
    row["clearance"] = np.inf
    return row


__all__ = ["DT", "LANES", "SUBSTEPS", "TICK", "Simulation", "row_at", "ticks_in", "trajectory"]
