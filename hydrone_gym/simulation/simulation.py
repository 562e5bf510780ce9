"""Python's handle on the kernel: constants packed once, working storage kept, rows advanced in place."""

from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.control.laws import named_law
from hydrone_gym.simulation.advance import compiled
from hydrone_gym.simulation.clock import DT, SUBSTEPS, TICK
from hydrone_gym.simulation.rows import Engine, advance_rows
from hydrone_gym.simulation.storage import LANES, new_block, new_rows, pack_model
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World

STILL = np.zeros((1, 0))  # the weather of a simulation without


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
        law: name of the control law that flies it.
        weathered: whether rows have `Conditions`, their weather and the vehicle as it is; without, `vehicle` flies as
            its controller believes it to be, in still air and flat water.
        extra: the class of a disturbance in that weather, see `hydrone_gym.weather.disturbance`.

    Raises:
        ValueError: a period that is no multiple of the tick, an unknown law.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        world: World,
        period: float = 0.5,
        lanes: int = 1,
        law: str = "paper",
        weathered: bool = False,
        extra: type | None = None,
    ) -> None:
        """Pack the model."""
        self.vehicle = vehicle
        self.world = world
        self.period = float(period)
        self.ticks = ticks_in(period)
        self.lanes = lanes
        self.law = law
        self.weathered, self.extra = weathered, extra
        self.values = pack_model(vehicle, world, named_law(law))
        self._engine: Engine | None = None

    @property
    def engine(self) -> Engine:
        """What kernels advance blocks with; compiled, or loaded, when it is first asked for."""
        if self._engine is None:
            address = compiled(self.law, self.lanes, self.weathered, self.extra).address
            self._engine = Engine(address, self.lanes, self.ticks, self.values, new_block(self.lanes))
        return self._engine

    def twin(self) -> Self:
        """Return another simulation of the same model, with storage of its own."""
        return self.flown_in(self.weathered, self.extra)

    def flown_in(self, weathered: bool, extra: type | None = None) -> Self:
        """Return a simulation of the same vehicle and world with weather, or without."""
        return type(self)(self.vehicle, self.world, self.period, self.lanes, self.law, weathered, extra)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out what holds for this process only: the kernel's address."""
        return {**self.__dict__, "_engine": None}

    def advance(
        self,
        rows: np.ndarray,
        references: NDArray[np.float64],
        obstacles: NDArray[np.float64],
        closest: NDArray[np.float64],
        count: int,
        first: int = 0,
        last: int | None = None,
        weather: NDArray[np.float64] = STILL,
    ) -> None:
        """Advance rows in place through ticks [first, last) of a period; see `advance_rows` for the layout.

        Raises ValueError for a `weather` that the kernel does not read, or none where it reads one.
        """
        if self.weathered != (weather.size > 0):
            raise ValueError(f"a simulation with weathered={self.weathered} got conditions of shape {weather.shape}")
        if references.dtype != np.float64 or not references.flags.c_contiguous:
            references = np.ascontiguousarray(references, np.float64)
        end = self.ticks if last is None else last
        advance_rows(self._engine or self.engine, rows, references, obstacles, closest, weather, count, first, end)


def trajectory(
    simulation: Simulation,
    row: np.ndarray,
    references: ArrayLike,
    obstacles: ArrayLike | None = None,
    conditions: NDArray[np.float64] = STILL,
    around: list[NDArray[np.float64]] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], np.ndarray]:
    """Play a sequence of references from a row and sample every tick, with the same numbers as whole periods give.

    Args:
        simulation: a `Simulation` with one lane.
        row: (1,) dtype `ROW`; not changed.
        references: (K, 4) one reference a period (m, m, m, rad).
        obstacles: (M, 4) spheres x, y, z, r in m.
        conditions: (1, CONDITIONS) of a simulation with weather; not changed.
        around: gets the conditions (CONDITIONS,) of every sample, if given.

    Returns:
        Times (N,) in s, states (N, 12), the moving references (N, 4), and the final row. Ends early with the outcome.

    Raises ValueError for a simulation with weather and no conditions, or the other way round.
    """
    if simulation.weathered != (conditions.size > 0):
        rule = "given where the simulation has weather" if simulation.weathered else "left out where it has none"
        raise ValueError(f"conditions must be {rule}, got shape {conditions.shape}")
    # a copy, since a read-only array would compile another version of the kernel
    spheres = np.zeros((0, 4)) if obstacles is None else np.array(obstacles, dtype=np.float64)
    closest = np.full((1, len(spheres)), np.inf)
    flat = spheres.reshape(1, -1)
    row, conditions = row.copy(), conditions.copy()
    start = row["ticks"][0]
    times, states, moving = [0.0], [row["state"][0].copy()], [row["reference"][0].copy()]
    around = [] if around is None else around
    around.append(conditions[0].copy())
    for reference in np.asarray(references, dtype=np.float64, order="C"):
        old = row["reference"][0].copy()
        turn = (reference[3] - old[3] + np.pi) % (2.0 * np.pi) - np.pi
        move = np.append(reference[:3] - old[:3], turn)
        for tick in range(simulation.ticks):
            simulation.advance(row, reference[None], flat, closest, len(spheres), tick, tick + 1, conditions)
            around.append(conditions[0].copy())
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
