"""Many episodes at once: storage, threads and resets behind the vector environment."""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs.options import Options
from hydrone_gym.envs.task import REPORT, begin_rows, new_episodes, pack_task, settle
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import LANES
from hydrone_gym.world.generator import draw, first_numbers, prepare
from hydrone_gym.world.placement import place_many
from hydrone_gym.world.scenario import Scenario

_ROWS_A_THREAD = 256  # fewer are not worth waking a thread for
_NOWHERE = 1e160  # m: its square overflows, so a sphere there is at distance inf


class EpisodeBatch:
    """The episodes of a vector environment, advanced sixteen lanes at a time.

    Args:
        options: what every row flies.
        count: number of rows.
        threads: blocks of lanes are spread over this many threads when there are enough rows.
    """

    def __init__(self, options: Options, count: int, threads: int = 1) -> None:
        """Make the storage; rows hold no episode before `begin`."""
        self.options = options
        self.count = count
        self.episodes = new_episodes(count, options.num_obstacles, LANES)
        self.report = np.zeros((count, len(REPORT)))
        self.scenarios: list[Scenario | None] = [None] * count
        world, vehicle = options.world, options.vehicle
        self._law = options.law
        self._prepared = prepare(self._law, world, vehicle.radius)
        self._task = pack_task(vehicle, world, options.time_limit)
        self._order = np.arange(count)
        threads = max(1, min(threads, count // _ROWS_A_THREAD))
        self.simulations = [Simulation(vehicle, world, options.period, LANES) for _ in range(threads)]
        blocks = -(-count // LANES)
        edges = [LANES * round(blocks * k / threads) for k in range(threads)] + [count]
        self._parts = [slice(a, b) for a, b in pairwise(edges)]
        self._pool = ThreadPoolExecutor(threads) if threads > 1 else None

    def advance(self, references: NDArray[np.float64]) -> None:
        """Fly one period toward references (n, 4), then judge every row into `report`."""
        if self._pool is None:
            self._advance_part(0, references)
            return
        jobs = [self._pool.submit(self._advance_part, k, references) for k in range(len(self._parts))]
        for job in jobs:
            job.result()

    def _advance_part(self, k: int, references: NDArray[np.float64]) -> None:
        part, now, count = self._parts[k], self.episodes, self.options.num_obstacles
        blocks = slice(part.start // LANES, -(-part.stop // LANES))
        self.simulations[k].advance(now.rows[part], references[part], now.obstacles[blocks], now.closest[blocks], count)
        settle(*now, count, LANES, self._task, self._order[part], self.report)

    def begin(
        self,
        rows: NDArray[np.intp],
        generators: Sequence[np.random.Generator],
        scenarios: Sequence[Scenario | None],
    ) -> None:
        """Begin new episodes.

        Args:
            rows: (k,) which.
            generators: one for each row of the batch.
            scenarios: (k,) what to fly; None draws one from the row's generator.
        """
        count = self.options.num_obstacles
        starts, goals = np.empty((len(rows), 4)), np.empty((len(rows), 3))
        spheres = np.empty((len(rows), count, 4))
        drawn = [k for k, scenario in enumerate(scenarios) if scenario is None]
        if drawn:
            self._draw(rows, drawn, generators, starts, goals, spheres)
        for k, scenario in enumerate(scenarios):
            if scenario is not None:
                starts[k], goals[k] = scenario.start, scenario.goal
                starts[k, 3] = math.remainder(scenario.start[3], 2.0 * math.pi)
                given = len(scenario.obstacles)
                spheres[k, :given] = scenario.obstacles
                spheres[k, given:] = (_NOWHERE, 0.0, 0.0, 0.0)
        begin_rows(*self.episodes, count, LANES, self._task, rows, starts, goals, spheres, self.report)

    def spheres(self, row: int) -> NDArray[np.float64]:
        """The spheres of a row's episode, (k, 4) x, y, z, r in m."""
        block, lane = divmod(row, LANES)
        found = self.episodes.obstacles[block].reshape(self.options.num_obstacles, 4, LANES)[:, :, lane]
        return found[found[:, 3] > 0.0]

    def _draw(
        self,
        rows: NDArray[np.intp],
        drawn: list[int],
        generators: Sequence[np.random.Generator],
        starts: NDArray[np.float64],
        goals: NDArray[np.float64],
        spheres: NDArray[np.float64],
    ) -> None:
        """Draw scenarios, each from its row's own stream: one kernel call places all, the rare rest goes one by one."""
        law = self._law
        numbers = np.empty((len(drawn), first_numbers(law)))
        for line, k in zip(numbers, drawn, strict=True):
            generators[rows[k]].random(out=line)
        chosen = np.array(drawn)
        solved = place_many(*self._prepared, numbers, chosen, starts, goals, spheres)
        for line, k, done in zip(numbers, drawn, solved, strict=True):
            if not done:
                draw(law, self._prepared, generators[rows[k]], starts[k], goals[k], spheres[k], line)
