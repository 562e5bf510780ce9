"""The core of both environments: episodes, resets, observations and threads for any number of rows.

The single environment is row 0 of a batch of one; the vector environment adds Gymnasium's rules for resets.
"""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.envs.info import crossings_of
from hydrone_gym.envs.options import Options
from hydrone_gym.envs.outdoors import Outdoors
from hydrone_gym.envs.requests import REFERENCE, checked
from hydrone_gym.envs.spaces import action_space, egocentric_space, observation_space, relative_action_space
from hydrone_gym.envs.task import OUTCOME, REPORT, Missions, begin_rows, new_episodes, pack_task, settle
from hydrone_gym.perception.egocentric import LEAST, OBSERVATION_SIZE, Egocentric, new_memory
from hydrone_gym.perception.perceived import Perceived, perceive
from hydrone_gym.rendering.view import new_screen
from hydrone_gym.simulation.outcome import RUNNING
from hydrone_gym.simulation.simulation import STILL, Simulation
from hydrone_gym.world.bodies import NOWHERE
from hydrone_gym.world.generator import draw, first_numbers, place_many, prepare
from hydrone_gym.world.scenario import Scenario

_ROWS_A_THREAD = 256  # fewer are not worth waking a thread for

ReferenceFilter = Callable[[Perceived, NDArray[np.float64], NDArray[np.bool_]], NDArray[np.float64]]

_NOTHING = np.empty((2, 0), dtype=object)


class Flown(NamedTuple):
    """What a step leaves behind of all rows, in new arrays."""

    report: NDArray[np.float64]  # (len(REPORT), n) of the period flown
    now: NDArray[np.float64]  # the same, but of the next episode where that has begun at once
    observation: Any  # as of now: a dict of arrays, or one array with interface="egocentric"
    last_observations: np.ndarray  # (n,) object: an observation where an episode ended and the next has begun at once
    last_transitions: np.ndarray  # (n,) object: its crossings
    weather: dict[str, NDArray[np.float64]]  # around the rows, of the period flown; see `Outdoors.weather`


class EpisodeBatch:
    """The episodes of an environment: `count` rows, none of which holds one before `begin`.

    `lanes` rows are advanced in one go: 1 for a single row, 16 for batches. Blocks of lanes are spread over `threads`
    when there are enough rows. `render_modes` are those it can be drawn in.
    """

    def __init__(
        self, options: Options, count: int, lanes: int, threads: int = 1, render_modes: tuple[str, ...] = ("rgb_array",)
    ) -> None:
        """Make the storage."""
        self.options, self.count, self.lanes, self.draws = options, count, lanes, options.draws
        vehicle, world, self._obstacles = options.the_vehicle, options.world, options.num_obstacles
        parts = range(max(1, min(threads, count // _ROWS_A_THREAD)))
        self.simulations = [Simulation(vehicle, world, options.period, lanes, options.controller) for _ in parts]
        simulation = self.simulations[0]
        self.episodes = new_episodes(count, self._obstacles, lanes)
        self.transitions = np.full(count, None, dtype=object)
        self.ended, self.starting = np.ones(count, bool), np.zeros(count, bool)
        self.generators: list[np.random.Generator] = []
        self.outdoors = Outdoors(options, count, lanes)
        self.reference_filter: ReferenceFilter | None = None
        self.screen = new_screen(options.render_mode, options.render_size, options.camera, simulation, render_modes)
        self.egocentric = Egocentric(simulation) if options.interface == "egocentric" else None
        self.memory, self.seen = new_memory(count), np.zeros((count, OBSERVATION_SIZE), np.float32)  # if egocentric
        references, raw = action_space(world), observation_space(simulation, self._obstacles)
        self.sphere_space: Any = raw["obstacles"]
        self.action_space = references if self.egocentric is None else relative_action_space()
        self.observation_space = raw if self.egocentric is None else egocentric_space()
        self.low, self.high = references.low.astype(np.float64), references.high.astype(np.float64)
        self._bind()

    def _bind(self) -> None:
        """Make what shares memory with the episodes or is read-only, and the threads."""
        flown = self.outdoors.weathered, self.outdoors.extra
        if (self.simulations[0].weathered, self.simulations[0].extra) != flown:
            self.simulations = [simulation.flown_in(*flown) for simulation in self.simulations]
            self.screen.go_out(*flown)
        now, lanes, threads, model = self.episodes, self.lanes, len(self.simulations), self.simulations[0]
        self._prepared = prepare(self.draws, model.world, model.vehicle.radius)
        self.perceived = perceive(now.rows, now.known, now.found)
        self._raw = self.perceived.observation()
        self._logs = now.rows["crossing_log"]
        self._first = {key: array[0] for key, array in self._raw.items()}
        blocks = -(-self.count // lanes)
        edges = [lanes * round(blocks * k / threads) for k in range(threads)] + [self.count]
        self._parts = [slice(a, b) for a, b in pairwise(edges)]
        self._flown = []
        for part in self._parts:
            own = slice(part.start // lanes, -(-part.stop // lanes))
            task = pack_task(model, self.options.time_limit, part)
            around = self.outdoors.conditions[own] if self.outdoors.weathered else STILL
            self._flown.append((part, task, now.rows[part], now.obstacles[own], now.closest[own], around))
        self._pool = ThreadPoolExecutor(threads - 1) if threads > 1 else None

    def __getstate__(self) -> dict[str, Any]:
        shared = ("perceived", "_prepared", "_raw", "_logs", "_first", "_flown", "_pool")
        return {name: value for name, value in self.__dict__.items() if name not in shared}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._bind()

    def observation_of(self, row: int) -> Any:
        """Return a new observation of a row."""
        if self.egocentric is not None:
            return self.seen[row].copy()
        views = {key: array[row] for key, array in self._raw.items()} if row else self._first
        return {key: array.copy() for key, array in views.items()}

    def observation(self) -> Any:
        """Return a new observation of all rows."""
        if self.egocentric is not None:
            return self.seen.copy()
        return {key: array.copy() for key, array in self._raw.items()}

    def new_observation(self) -> Any:
        """Return room for an observation of all rows."""
        if self.egocentric is not None:
            return np.empty_like(self.seen)
        return {key: np.empty(array.shape) for key, array in self._raw.items()}

    def observe(self, part: slice, out: Any) -> None:
        """Copy what a part of the rows shows now into an observation of all."""
        if self.egocentric is not None:
            out[part] = self.seen[part]
            return
        for key, array in self._raw.items():
            out[key][part] = array[part]

    def references(self, actions: ArrayLike) -> NDArray[np.float64]:
        """Return the references (n, 4) that actions stand for, as they are flown; ValueError for a bad action."""
        if self.egocentric is None:
            given = checked(actions, (self.count, 4), REFERENCE, np.float64)
            references = np.minimum(np.maximum(given, self.low), self.high)
        else:
            offsets = checked(actions, (self.count, 3), "offsets in [-1, 1]", np.float32)
            references = self.egocentric.place(self.perceived, self.memory, offsets)
        if self.reference_filter is not None:
            filtered = self.reference_filter(self.perceived, references, self.starting.copy())
            references = checked(filtered, (self.count, 4), REFERENCE, np.float64)
        return references

    def advance(self, references: NDArray[np.float64], k: int = 0) -> None:
        """Fly part k of the rows one period toward references (n, 4), then judge them."""
        part, task, rows, obstacles, closest, around = self._flown[k]
        own = references if len(self._parts) == 1 else references[part]
        self.simulations[k].advance(rows, own, obstacles, closest, self._obstacles, weather=around)
        settle(*self.episodes, task)

    def look(self, rows: NDArray[np.int64]) -> None:
        """Look at rows (k,), once a period."""
        if self.egocentric is not None:
            self.egocentric.look(self.perceived, self.memory, rows, self.seen)

    def note_crossings(self, part: slice) -> None:
        """Append the crossings of this period; lists handed out before are left alone."""
        counts = self.episodes.report[part, -1]
        for k in counts.nonzero()[0].tolist():
            row = part.start + k
            self.transitions[row] = [*self.transitions[row], *crossings_of(self._logs[row], int(counts[k]))]

    def fly(self, references: NDArray[np.float64], *, same_step: bool) -> Flown:
        """Fly one period toward references (n, 4); rows that had ended before begin anew instead.

        With `same_step`, rows that end now begin anew at once.
        """
        self.starting[:] = False
        if self._pool is None and not same_step:  # nothing to share out: copies in one go
            self._fly_part(0, references, None)
            now = self.episodes.report.T.copy()
            return Flown(now, now, self.observation(), _NOTHING[0], _NOTHING[1], {})
        report, now = (np.empty((len(REPORT), self.count)) for _ in range(2))
        lasts = np.full((2, self.count), None, dtype=object) if same_step else _NOTHING
        weather = {name: np.empty_like(values) for name, values in self.outdoors.weather().items()} if same_step else {}
        flown = Flown(report if same_step else now, now, self.new_observation(), lasts[0], lasts[1], weather)
        rest = range(1, len(self._parts))
        jobs = [self._pool.submit(self._fly_part, k, references, flown) for k in rest] if self._pool else []
        try:
            self._fly_part(0, references, flown)
        finally:
            for job in jobs:
                job.result()
        return flown

    def _fly_part(self, k: int, references: NDArray[np.float64], flown: Flown | None) -> None:
        part, report, ended = self._parts[k], self.episodes.report, self.ended[self._parts[k]]
        again = part.start + ended.nonzero()[0]
        # before they fly: while one thread draws, the others advance
        missions = self.missions_of(again) if again.size else None
        self.advance(references, k)
        self.note_crossings(part)
        if missions is not None:
            self.begin(again, missions, look=False)
        if self.egocentric is not None:
            self.look(np.arange(part.start, part.stop))
        np.not_equal(report[part, OUTCOME], RUNNING, out=ended)
        if flown is None:
            return
        if flown.report is not flown.now:
            flown.report[:, part] = report[part].T
            now = self.outdoors.weather()
            for name, values in flown.weather.items():
                values[part] = now[name][part]
            again = part.start + ended.nonzero()[0]
            for row in again.tolist():
                flown.last_observations[row] = self.observation_of(row)
                flown.last_transitions[row] = self.transitions[row]
            if again.size:
                self.begin(again, self.missions_of(again))
        flown.now[:, part] = report[part].T
        self.observe(part, flown.observation)

    def missions_of(self, rows: NDArray[np.int64], scenarios: Sequence[Scenario | None] | None = None) -> Missions:
        """Return what episodes of rows (k,) begin with: scenarios (k,), None being drawn from the row's own stream."""
        count = len(rows)
        missions = Missions(np.empty((count, 4)), np.empty((count, 3)), np.empty((count, self._obstacles, 4)))
        for k, scenario in enumerate(scenarios or ()):
            if scenario is not None:
                given = len(scenario.obstacles)
                missions.starts[k], missions.goals[k] = scenario.start, scenario.goal
                missions.starts[k, 3] = math.remainder(scenario.start[3], 2.0 * math.pi)
                missions.spheres[k, :given], missions.spheres[k, given:] = scenario.obstacles, NOWHERE
        drawn = np.arange(count)
        if scenarios is not None:
            drawn = np.array([k for k in range(count) if scenarios[k] is None], np.int64)
        if drawn.size:
            # one kernel call places all, the rare rest goes one by one
            generators = [self.generators[row] for row in rows[drawn].tolist()]
            numbers = np.empty((drawn.size, first_numbers(self.draws)))
            for generator, line in zip(generators, numbers, strict=True):
                generator.random(out=line)
            solved = place_many(*self._prepared, numbers, drawn, *missions)
            for i in (~solved).nonzero()[0].tolist():
                start, goal, spheres = (array[drawn[i]] for array in missions)
                draw(self.draws, self._prepared, generators[i], start, goal, spheres, numbers[i])
        return missions

    def begin(
        self,
        rows: NDArray[np.int64],
        missions: Missions,
        scenarios: Sequence[Scenario | None] = (),
        *,
        look: bool = True,
    ) -> None:
        """Begin the episodes of rows (k,), and look at them unless that is still to come in this period.

        Their weather is that of the options, but for `scenarios` (k,) that carry one.
        """
        if self.outdoors.admit(self.episodes.rows, scenarios):
            self._bind()
        begin_rows(self.episodes, missions, rows, self._flown[0][1])
        self.outdoors.begin(self.episodes.rows, rows, self.generators, scenarios)
        for row in rows.tolist():
            self.transitions[row] = []
        self.ended[rows], self.starting[rows] = False, True
        if self.egocentric is not None:
            self.memory[rows, LEAST] = np.inf
            if look:
                self.look(rows)

    def restore_outdoors(
        self, conditions: NDArray[np.float64], disturbance: type | None, streams: NDArray[np.float64]
    ) -> None:
        """Go back to the weather of a snapshot."""
        self.outdoors.restore(conditions, disturbance, streams)
        self._bind()

    def spheres(self, row: int) -> NDArray[np.float64]:
        """The spheres of a row's episode, (k, 4) x, y, z, r in m."""
        block, lane = divmod(row, self.lanes)
        found = self.episodes.obstacles[block].reshape(self.options.num_obstacles, 4, self.lanes)[:, :, lane]
        return found[found[:, 3] > 0.0]

    def show(self, rows: NDArray[np.int64]) -> None:
        """Begin anew on the screen, where rows begin an episode."""
        for row in rows.tolist():
            now, conditions = self.episodes, self.outdoors.of_row(row)
            self.screen.begin(row, now.rows, now.seen, self.spheres(row), conditions)

    def render(self, row: int) -> NDArray[np.uint8] | None:
        """Return a new picture of a row (height, width, 3), or None if there is none or it is shown in a window."""
        return self.screen.render(row, self.episodes.rows, self.episodes.seen)
