"""`HydroneVectorEnv`: many missions at once, every row equal to the single environment bit for bit."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.core import RenderFrame
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.envs.batch import EpisodeBatch
from hydrone_gym.envs.egocentric import egocentric_space, relative_action_space
from hydrone_gym.envs.egocentric_rows import EgocentricRows
from hydrone_gym.envs.info import batch_info, crossings_of
from hydrone_gym.envs.options import Options
from hydrone_gym.envs.requests import check_scenario, load_references, requested_rows
from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.spaces import action_space, observation_space
from hydrone_gym.envs.task import REPORT
from hydrone_gym.rendering.view import new_screen
from hydrone_gym.simulation.outcome import GOAL, RUNNING, TIMEOUT
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import Vehicle, named_vehicle

_REWARD = len(TERMS)
_OUTCOME = REPORT.index("outcome")


class HydroneVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """`HydroneEnv` for many rows, made by ``gym.make_vec(id, n, vectorization_mode="vector_entry_point")``.

    Options, spaces, rewards and outcomes are those of `HydroneEnv`; every row gives the very numbers that a single
    environment seeded with ``seed + i`` gives, resets included, for any number of rows and threads. Returned arrays are
    new with every call.

    `info` holds one array (n,) an entry with its mask ``_entry``, as Gymnasium's vector environments do; `outcome` is
    an integer array. At the end of an episode `info["is_success"]` is set, and in SAME_STEP mode `final_obs` and
    `final_info`.

    Args besides the options of `HydroneEnv`:
        num_envs: number of rows.
        autoreset_mode: "NextStep" (default), "SameStep", "Disabled" or a `gymnasium.vector.AutoresetMode`.
        threads: threads to spread whole blocks of rows over; used from 512 rows on.
        max_episode_steps: replaces `time_limit` if given, in periods.

    `render_mode` is None or "rgb_array": `render()` returns a tuple of pictures, one a row.

    `egocentric` translates for `interface="egocentric"`; another `EgocentricRows` may take its place before the first
    reset, to change the references that actions stand for.

    Reset options: `scenario`, one `Scenario` (or path) for all rows or a sequence of one a row, None entries being
    drawn; `reset_mask` (n,) bool, which rows to reset.
    """

    metadata: dict[str, Any] = {
        "render_modes": ["rgb_array"],
        "render_fps": 2,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        *,
        mission: str = "random",
        num_obstacles: int = 20,
        obstacle_radius: tuple[float, float] = (0.5, 1.5),
        sensor_range: float = 3.0,
        vehicle: str | Vehicle = "paper",
        period: float = 0.5,
        vertical_mode: bool = True,
        rough_transition: str = "fail",
        time_limit: float = 120.0,
        interface: str = "world",
        render_mode: str | None = None,
        render_size: tuple[int, int] = (640, 480),
        camera: str = "overview",
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        max_episode_steps: int | None = None,
    ) -> None:
        """Check the options and make room for the rows."""
        self.num_envs = _whole("num_envs", num_envs)
        if max_episode_steps is not None:
            time_limit = _whole("max_episode_steps", max_episode_steps) * period
        self.options = Options(
            mission=mission,
            num_obstacles=num_obstacles,
            obstacle_radius=obstacle_radius,
            sensor_range=sensor_range,
            vehicle=named_vehicle(vehicle),
            period=period,
            vertical_mode=vertical_mode,
            rough_transition=rough_transition,
            time_limit=time_limit,
            interface=interface,
        )
        self.render_mode = render_mode
        mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": mode, "render_fps": 1.0 / period}
        self._batch = EpisodeBatch(self.options, self.num_envs, _whole("threads", threads))
        self._screen = new_screen(render_mode, render_size, camera, self.simulation, modes=("rgb_array",))
        world = self.options.world
        references = action_space(world)
        raw = observation_space(self.options.vehicle, world, self.options.num_obstacles)
        self._sphere_space: Any = raw["obstacles"]
        self.egocentric = EgocentricRows(self.options, self.num_envs) if interface == "egocentric" else None
        self.single_action_space = references if self.egocentric is None else relative_action_space()
        self.single_observation_space = raw if self.egocentric is None else egocentric_space()
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._low, self._high = references.low.astype(np.float64), references.high.astype(np.float64)
        self._generators: list[np.random.Generator] = []
        self._transitions = np.full(self.num_envs, None, dtype=object)
        self._ended = np.ones(self.num_envs, bool)

    @property
    def simulation(self) -> Simulation:
        """The simulation that steps it: vehicle, world and period for planners."""
        return self._batch.simulations[0]

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes in all rows, or in those of ``options["reset_mask"]``.

        Args:
            seed: row i is seeded with ``seed + i``, or with its entry of a sequence; None goes on with its stream.
            options: see the class.

        Raises:
            ValueError, TypeError: an unknown option, a wrong mask, an impossible scenario.
        """
        rows, scenarios = requested_rows(options, self.num_envs)
        for scenario in scenarios:
            if scenario is not None:
                check_scenario(scenario, self.options.world, self.options.vehicle.radius, self._sphere_space)
        self._seed(seed, rows)
        self._begin(rows, scenarios)
        mask = np.zeros(self.num_envs, bool)
        mask[rows] = True
        return self._observation(), batch_info(self._batch.report, self._transitions, mask)

    def _seed(self, seed: int | Sequence[int | None] | None, rows: NDArray[np.intp]) -> None:
        """Give the rows their random streams."""
        seeds = [None if seed is None else seed + i for i in range(self.num_envs)] if not _many(seed) else list(seed)  # type: ignore[arg-type, operator]
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed must be one number or {self.num_envs} of them, got {len(seeds)}")
        if not self._generators:
            self._generators = [seeding.np_random(None)[0] for _ in range(self.num_envs)]
        for row in rows:
            if seeds[row] is not None:
                self._generators[row] = seeding.np_random(seeds[row])[0]

    def _begin(self, rows: NDArray[np.intp], scenarios: Sequence[Any]) -> None:
        self._batch.begin(rows, self._generators, scenarios)
        for row in rows:
            self._transitions[row] = []
        self._ended[rows] = False
        if self.egocentric is not None:
            self.egocentric.begin(self._batch.episodes, rows)
        if self.render_mode is not None:
            now = self._batch.episodes
            for row in rows.tolist():
                self._screen.begin(row, now.rows, now.seen, self._batch.spheres(row))

    def step(
        self, actions: ArrayLike
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Fly one period in every row.

        Args:
            actions: (n, 4) references, m and rad; clipped to the action space.

        Returns:
            Observation, rewards, terminations, truncations (n,) and info.

        Raises:
            ValueError: actions of another shape or not finite; nothing has moved then.
            ResetNeeded: before the first reset; in "Disabled" mode also with rows that have ended.
        """
        if not self._generators:
            raise ResetNeeded("step() was called before reset(): call reset() first")
        if self.egocentric is None:
            references = load_references(actions, self._low, self._high, self.num_envs)
        else:
            references = self.egocentric.references(actions, self._batch.episodes)
        mode = self.metadata["autoreset_mode"]
        again = np.flatnonzero(self._ended)
        if mode == AutoresetMode.DISABLED and len(again):
            raise ResetNeeded(f"step() was called with rows {again.tolist()} ended: reset them with a reset_mask first")
        if self.render_mode is not None:
            for row in range(self.num_envs):
                self._screen.add(row, self._batch.episodes.rows, references)
        self._batch.advance(references)
        if self.egocentric is not None:
            self.egocentric.look(self._batch.episodes)
        if len(again):
            self._begin(again, [None] * len(again))
        report = self._batch.report
        self._collect_crossings()
        rewards = report[:, _REWARD].copy()
        outcome = report[:, _OUTCOME]
        truncated = outcome == TIMEOUT
        ended = outcome != RUNNING
        terminated = ended & ~truncated
        self._ended = ended.copy()
        info = self._info(ended, same_step=mode == AutoresetMode.SAME_STEP)
        return self._observation(), rewards, terminated, truncated, info

    def render(self) -> tuple[RenderFrame, ...] | None:
        """Return a new picture (height, width, 3) of each row, None without a `render_mode`.

        Raises ResetNeeded before the first reset.
        """
        now = self._batch.episodes
        first = self._screen.render(0, now.rows, now.seen)
        rest: Any = (self._screen.render(row, now.rows, now.seen) for row in range(1, self.num_envs))
        return None if first is None else (first, *rest)

    def _collect_crossings(self) -> None:
        """Append this period's crossings; lists handed out before are left alone."""
        counts = self._batch.report[:, -1]
        for row in np.flatnonzero(counts):
            log = self._batch.episodes.rows["crossing_log"][row]
            self._transitions[row] = [*self._transitions[row], *crossings_of(log, int(counts[row]))]

    def _info(self, ended: NDArray[np.bool_], *, same_step: bool) -> dict[str, Any]:
        """Return the info of a step, which says who succeeded; in SAME_STEP mode ended rows begin anew first."""
        report = self._batch.report
        if not ended.any():
            return batch_info(report, self._transitions)
        success = {"is_success": report[:, _OUTCOME] == GOAL, "_is_success": ended.copy()}
        if not same_step:
            return {**batch_info(report, self._transitions), **success}
        rows = np.flatnonzero(ended)
        last = self._observation()
        final = np.full(self.num_envs, None, dtype=object)
        for row in rows:
            final[row] = {k: v[row].copy() for k, v in last.items()} if isinstance(last, dict) else last[row].copy()
        final_info = {**batch_info(report, self._transitions, ended), **success}
        self._begin(rows, [None] * len(rows))
        self._ended = np.zeros(self.num_envs, bool)
        return {
            **batch_info(report, self._transitions),
            "final_obs": final,
            "_final_obs": ended.copy(),
            "final_info": final_info,
            "_final_info": ended.copy(),
        }

    def _observation(self) -> dict[str, NDArray[np.float64]] | NDArray[np.float32]:
        if self.egocentric is not None:
            return self.egocentric.observation()
        now = self._batch.episodes
        rows = now.rows
        return {
            "goal": rows["goal"].copy(),
            "integral": rows["integral"].copy(),
            "obstacles": now.known.copy(),
            "reference": rows["reference"].copy(),
            "state": rows["state"].copy(),
        }


def _many(seed: Any) -> bool:
    return seed is not None and not isinstance(seed, int | np.integer)


def _whole(name: str, value: Any) -> int:
    """Return a whole number of at least 1; raises ValueError naming it."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name} must be a whole number of at least 1, got {value!r}")
    return int(value)
