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

from hydrone_gym.envs.batch import EpisodeBatch, ReferenceFilter
from hydrone_gym.envs.info import batch_info
from hydrone_gym.envs.options import VectorOptions, takes, with_options
from hydrone_gym.envs.requests import requested_rows, requested_scenario, reset_options
from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.task import OUTCOME
from hydrone_gym.simulation.outcome import GOAL, RUNNING, TIMEOUT
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import LANES

_REWARD = len(TERMS)


class HydroneVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """`HydroneEnv` for many rows, made by ``gym.make_vec(id, n, vectorization_mode="vector_entry_point")``.

    Options, spaces, rewards and outcomes are those of `HydroneEnv`; every row gives the very numbers that a single
    environment seeded with ``seed + i`` gives, resets included, for any number of rows and threads. Returned arrays are
    new with every call.

    `info` holds one array (n,) an entry with its mask ``_entry``, as Gymnasium's vector environments do; `outcome` is
    an integer array. At the end of an episode `info["is_success"]` is set, and in SAME_STEP mode `final_obs` and
    `final_info`.

    Options besides those of `HydroneEnv`, all by keyword but `num_envs`:

    `VectorOptions` lists them.

    `render_mode` is None or "rgb_array": `render()` returns a tuple of pictures, one a row.

    Reset options: `scenario`, one `Scenario` (or path) for all rows or a sequence of one a row, None entries being
    drawn; `reset_mask` (n,) bool, which rows to reset.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2, "autoreset_mode": AutoresetMode.NEXT_STEP}

    @takes(VectorOptions)
    def __init__(self, options: VectorOptions) -> None:
        """Make room for the rows."""
        self.num_envs = options.num_envs
        self.options = options.of_a_row
        self.render_mode = options.render_mode
        self._mode = AutoresetMode(options.autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self._mode, "render_fps": 1.0 / options.period}
        self._core = EpisodeBatch(self.options, self.num_envs, LANES, options.threads)
        self.single_action_space = self._core.action_space
        self.single_observation_space = self._core.observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    @property
    def simulation(self) -> Simulation:
        """What advances its rows, or the first part of them: the truth."""
        return self._core.simulations[0]

    def filter_references(self, function: ReferenceFilter | None) -> None:
        """Let references pass through a function before they are flown, in every step from now on; None ends that.

        The function gets what is perceived of the rows (a `Perceived`, not to be changed), the references (n, 4) that
        the actions stand for, in m and rad, and where an episode has begun since it was last called, (n,) bool. It
        returns the references (n, 4) to fly.
        """
        self._core.reference_filter = function

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin episodes in all rows, or in those of ``options["reset_mask"]``; the class describes `options`.

        Row i is seeded with ``seed + i``, or with its entry of a sequence; None goes on with its stream. Raises
        ValueError or TypeError for an unknown option, a wrong mask or an impossible scenario.
        """
        chosen, mask = reset_options(options, "scenario", "reset_mask")
        rows = requested_rows(mask, self.num_envs)
        bounds, several = self._core.sphere_space, isinstance(chosen, list | tuple)
        if several and len(chosen) != self.num_envs:
            raise ValueError(f"scenario must be one scenario or a sequence of {self.num_envs}, got {len(chosen)}")
        asked = [chosen[row] for row in rows] if several else [chosen]
        scenarios = [requested_scenario(each, self.simulation, bounds) for each in asked]
        scenarios = scenarios if several else scenarios * len(rows)
        self._seed(seed, rows)
        self._core.begin(rows, self._core.missions_of(rows, scenarios), scenarios)
        if self.render_mode is not None:
            self._core.show(rows)
        observation = self._core.observation()
        begun = np.isin(np.arange(self.num_envs), rows)
        core = self._core
        return observation, batch_info(core.episodes.report.T, core.transitions, core.outdoors.weather(), begun)

    def _seed(self, seed: Any, rows: NDArray[np.intp]) -> None:
        """Give the rows their random streams."""
        seeds = seed if np.ndim(seed) else [None if seed is None else seed + i for i in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed must be one number or {self.num_envs} of them, got {len(seeds)}")
        streams = self._core.generators
        if not streams:
            streams += [seeding.np_random(None)[0] for _ in range(self.num_envs)]
        for row in rows:
            if seeds[row] is not None:
                streams[row] = seeding.np_random(seeds[row])[0]
                self._core.outdoors.reseeded[row] = True

    def step(
        self, actions: ArrayLike
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Fly one period in every row with actions (n, 4), m and rad, clipped to the action space.

        Raises ValueError for actions of another shape or not finite, nothing has moved then, and ResetNeeded before the
        first reset, in "Disabled" mode also with rows that have ended.
        """
        core, same_step = self._core, self._mode == AutoresetMode.SAME_STEP
        if not core.generators:
            raise ResetNeeded("step() was called before reset(): call reset() first")
        if self._mode == AutoresetMode.DISABLED and core.ended.any():
            ended = np.flatnonzero(core.ended).tolist()
            raise ResetNeeded(f"step() was called with rows {ended} ended: reset them with a reset_mask first")
        references = core.references(actions)
        if self.render_mode is not None:
            for row in range(self.num_envs):
                core.screen.add(row, core.episodes.rows, references, core.outdoors.of_row(row))
        flown = core.fly(references, same_step=same_step)
        if self.render_mode is not None:
            core.show(core.starting.nonzero()[0])
        outcome = flown.report[OUTCOME]
        truncated, ended = outcome == TIMEOUT, outcome != RUNNING
        info = batch_info(flown.now, core.transitions, core.outdoors.weather())
        if ended.any():
            last = {"is_success": outcome == GOAL, "_is_success": ended.copy()}
            if same_step:
                last |= batch_info(flown.report, flown.last_transitions, flown.weather, ended)
                last = {"final_info": last, "_final_info": ended.copy(), "final_obs": flown.last_observations}
                last["_final_obs"] = ended.copy()
            info |= last
        return flown.observation, flown.report[_REWARD].copy(), ended & ~truncated, truncated, info

    def render(self) -> tuple[RenderFrame, ...] | None:
        """Return a new picture (height, width, 3) of each row, None without `render_mode`; ResetNeeded before reset."""
        first = self._core.render(0)
        rest: Any = (self._core.render(row) for row in range(1, self.num_envs))
        return None if first is None else (first, *rest)


HydroneVectorEnv.__doc__ = with_options(HydroneVectorEnv.__doc__, VectorOptions)
