"""`HydroneEnv`: one vehicle and one mission as a Gymnasium environment."""

import copy
import inspect
import math
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.envs.egocentric import egocentric_space, relative_action_space
from hydrone_gym.envs.egocentric_rows import EgocentricRows
from hydrone_gym.envs.info import conclude, crossings_of, info_of
from hydrone_gym.envs.options import Options
from hydrone_gym.envs.requests import check_running, check_scenario, load_reference, requested_scenario
from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.snapshot import Snapshot
from hydrone_gym.envs.spaces import action_space, observation_space
from hydrone_gym.envs.task import REPORT, begin_rows, copy_episodes, new_episodes, pack_task, settle
from hydrone_gym.rendering.view import new_screen
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import Vehicle, named_vehicle
from hydrone_gym.world.generator import generate
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World

Observation = dict[str, NDArray[np.float64]] | NDArray[np.float32]
_ONLY = np.zeros(1, np.int64)


class HydroneEnv(gym.Env[Any, Any]):
    """A hybrid quadrotor flies, dives and swims to its goal among spheres it only sees from near.

    ## Description
    The HyDrone lives in a box of 20 x 20 x 15 m, air above z = 0 and water below. It starts at rest and has to reach
    the goal within 0.5 m, without touching a sphere and without crossing the surface roughly. A step is one period: the
    reference moves on a straight line from where it was to the action, and the paper's control laws follow it at
    100 Hz. Inside the transition zone, abs(z) <= 0.8 m, `vertical_mode` holds the vehicle still laterally, and in air
    it does not descend before it is nearly at rest. World frame: x, y horizontal, z up; SI units.

    | id | start | goal |
    |---|---|---|
    | `HydroneGym/AirToWater-v0` | (-9, -9, 8) | (9, 9, -3), the paper's Experiment 1 |
    | `HydroneGym/WaterToAir-v0` | (9, -9, -3) | (-9, 9, 7), the paper's Experiment 2 |
    | `HydroneGym/Mission-v0` | random, either medium, any yaw | random, either medium, 8 m or more away |

    ## Action Space
    `Box` (4,) float32: the reference `[x, y, z, psi]` at the end of the period, in m and rad, world frame, inside the
    box and psi in [-pi, pi]. What lies outside is clipped to the space. In water the heading follows the line of sight
    and psi is not used.

    ## Observation Space
    `Dict` of float64 boxes with finite bounds; every array returned is new.

    | key | shape | content |
    |---|---|---|
    | `state` | (12,) | position (m), Euler angles phi, theta, psi (rad, ZXY), velocity (m/s), body rates (rad/s) |
    | `integral` | (4,) | the controller's memory: altitude, roll, pitch, yaw (rpm in air, N in water) |
    | `reference` | (4,) | the reference now in force (m, m, m, rad) |
    | `goal` | (3,) | m |
    | `obstacles` | (num_obstacles, 4) | `[x, y, z, r]` (m) of the spheres detected so far, in order; zero rows after |

    A sphere is detected once its surface has been within `sensor_range` of the vehicle's centre.

    ## Rewards
    The sum of the terms in `info["reward_terms"]`, defined with their reasons in `hydrone_gym.envs.reward`:

    | term | value |
    |---|---|
    | `progress` | 0.1 for each second by which the time-to-go in an empty world fell |
    | `time` | -0.025 each step |
    | `slow` | -0.025 for a step that ends slower than 0.2 m/s |
    | `goal` | +1.5 on arrival |
    | `collision`, `rough_crossing`, `out_of_bounds`, `diverged` | -2 |

    ## Starting State
    At rest and level at the start of the scenario, its reference where it is. The spheres (centres anywhere in the box,
    1 m or more from the vehicle at both ends) are drawn anew at each reset such that a way exists.
    `reset(options={"scenario": scenario})` flies a given `Scenario`, or the file it was saved to.

    ## Episode End
    Terminated, by `info["outcome"]`: GOAL; COLLISION (the vehicle's sphere touches an obstacle); OUT_OF_BOUNDS (its
    centre leaves the box); ROUGH_TRANSITION (a crossing with lateral speed above 0.2 m/s or tilt above 5 degrees,
    unless `rough_transition="count"`); DIVERGED (beyond the limits of speed, turning rate or tilt the model is good
    for). These are judged every 0.05 s, and the last observation is of that instant. Truncated: TIMEOUT, at the end of
    the period in which `time_limit` is reached. The environment does this itself; the ids are registered without
    `max_episode_steps`.

    `info` holds `outcome`, `time` (s), `energy` (J, rotor shafts), `clearance` (least so far, m; infinite without
    obstacles), `transitions` (a dict a crossing: `time` (s), `direction` "entry" or "exit", `lateral_speed` (m/s),
    `tilt` (rad), `vertical_speed` (m/s); at most 8 a period), `reward_terms` and, at the end, `is_success`.

    ## Arguments
    All by keyword, also through `gymnasium.make`:

    - `mission`: "air_to_water", "water_to_air" or "random"; set by the id.
    - `num_obstacles` (20): number of spheres; at least as many as a given scenario has.
    - `obstacle_radius` ((0.5, 1.5)): least and greatest radius, m.
    - `sensor_range` (3.0): m.
    - `vehicle` ("paper"): "paper", "physical" or a `Vehicle`.
    - `period` (0.5): seconds a step, a multiple of 0.05.
    - `vertical_mode` (True): hold still laterally inside the transition zone.
    - `rough_transition` ("fail"): "fail" ends an episode at a rough crossing, "count" only notes it.
    - `time_limit` (120.0): s.
    - `interface` ("world"): the spaces above; "egocentric": a flat (68,) observation and (3,) relative actions for
      learners, documented in `hydrone_gym.envs.egocentric`.
    - `render_mode` (None): "rgb_array" for pictures, "human" for a window; `hydrone_gym.rendering` describes them.
    - `render_size` ((640, 480)): width and height of pictures in pixels; `camera` ("overview"): or "chase".

    Raises TypeError for an unknown option and ValueError for a value out of range.

    ## Version History
    - v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 2}

    def __init__(
        self,
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
        **unknown: object,
    ) -> None:
        """Check the options and set up the simulation."""
        if unknown:
            raise TypeError(f"unknown option {', '.join(map(repr, unknown))}; known are {', '.join(known_options())}")
        self.render_mode = render_mode
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
        self.simulation = Simulation(self.options.vehicle, self.options.world, period, lanes=1)
        self._screen = new_screen(render_mode, render_size, camera, self.simulation)
        self.metadata = {**self.metadata, "render_fps": 1.0 / period}
        references = action_space(self.world)
        space = observation_space(self.vehicle, self.world, self.options.num_obstacles)
        self._sphere_space: Any = space["obstacles"]
        self._lowest, self._highest = references.low.astype(np.float64), references.high.astype(np.float64)
        self._egocentric = EgocentricRows(self.options, 1) if interface == "egocentric" else None
        self.action_space = references if self._egocentric is None else relative_action_space()
        self.observation_space = space if self._egocentric is None else egocentric_space()
        self._law = self.options.law
        self._reference = np.zeros((1, 4))
        self._report = np.zeros((1, len(REPORT)))
        self._task = pack_task(self.vehicle, self.world, time_limit)
        self._episodes = new_episodes(1, self.options.num_obstacles, lanes=1)
        self._scenario: Scenario | None = None
        self._transitions: list[dict[str, Any]] = []

    @property
    def vehicle(self) -> Vehicle:
        """The vehicle."""
        return self.simulation.vehicle

    @property
    def world(self) -> World:
        """Bounds, surface, sensing and what counts as arrival."""
        return self.simulation.world

    @property
    def scenario(self) -> Scenario:
        """The mission being flown; raises ResetNeeded before the first reset."""
        if self._scenario is None:
            raise ResetNeeded("there is no scenario before the first reset: call reset()")
        return self._scenario

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict]:
        """Begin an episode; return observation and info, as in the class's description.

        Args:
            seed: seeds the random stream of scenarios.
            options: {"scenario": Scenario, or the path of its JSON file} flies that one; it is not random then.

        Raises:
            ValueError: an unknown key, or a scenario that is impossible in this world.
        """
        super().reset(seed=seed)
        scenario = requested_scenario(options)
        if scenario is None:
            scenario = generate(self._law, self.world, self.vehicle.radius, self.np_random)
        else:
            check_scenario(scenario, self.world, self.vehicle.radius, self._sphere_space)
        self._begin(scenario)
        return self._observation(), info_of(self._report[0].tolist(), self._transitions)

    def _begin(self, scenario: Scenario) -> None:
        """Put the vehicle at the start of a scenario, with nothing known but what is in range there."""
        x, y, z, yaw = scenario.start
        starts = np.array([[x, y, z, math.remainder(yaw, 2.0 * math.pi)]])
        goals, spheres = np.array([scenario.goal]), scenario.obstacles[None]
        begin_rows(*self._episodes, spheres.shape[1], 1, self._task, _ONLY, starts, goals, spheres, self._report)
        self._scenario = scenario
        self._transitions = []
        if self._egocentric is not None:
            self._egocentric.begin(self._episodes, _ONLY)
        self._screen.begin(0, self._episodes.rows, self._episodes.seen, scenario.obstacles)

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fly one period with the reference moving to the action; returns are those of the class's description.

        Args:
            action: (4,) x, y, z in m and psi in rad; clipped to the action space.

        Raises:
            ValueError: an action of another shape, or not finite.
            ResetNeeded: before the first reset, or after the end of an episode.
        """
        now = self._episodes
        check_running(now.rows["outcome"][0], self._scenario is not None)
        if self._egocentric is None:
            load_reference(action, self._lowest, self._highest, self._reference[0])
        else:
            self._reference[:] = self._egocentric.references(np.asarray(action)[None], now)
        self._screen.add(0, now.rows, self._reference)
        count = len(self.scenario.obstacles)
        self.simulation.advance(now.rows, self._reference, now.obstacles, now.closest, count)
        settle(*now, count, 1, self._task, _ONLY, self._report)
        if self._egocentric is not None:
            self._egocentric.look(now)
        self._screen.update(now.rows, now.seen)
        report = self._report[0].tolist()
        if report[-1] > 0.0:
            self._transitions += crossings_of(now.rows["crossing_log"][0], int(report[-1]))
        info = info_of(report, self._transitions)
        terminated, truncated = conclude(info)
        return self._observation(), report[len(TERMS)], terminated, truncated, info

    def _observation(self) -> Observation:
        if self._egocentric is not None:
            return self._egocentric.observation()[0]
        rows = self._episodes.rows
        observation = {key: rows[key][0].copy() for key in ("state", "integral", "reference", "goal")}
        observation["obstacles"] = self._episodes.known[0].copy()
        return observation

    def render(self) -> NDArray[np.uint8] | None:
        """Return a new picture (height, width, 3), or None with a window; raises ResetNeeded before the first reset."""
        return self._screen.render(0, self._episodes.rows, self._episodes.seen)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._screen.close()

    def get_state(self) -> Snapshot:
        """Return a complete snapshot of the episode and the random stream; raises ResetNeeded before reset."""
        return Snapshot(
            options=self.options,
            scenario=self.scenario,
            episodes=copy_episodes(self._episodes),
            transitions=tuple(dict(crossing) for crossing in self._transitions),
            random_state=copy.deepcopy(self.np_random.bit_generator.state),  # type: ignore[arg-type]
            seed=self._np_random_seed,
            egocentric=copy.deepcopy(self._egocentric),
            track=self._screen.track(0),
        )

    def set_state(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot, bit for bit; it can be used again.

        Raises TypeError for anything else, ValueError for a snapshot of an environment with other options.
        """
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"snapshot must come from get_state(), got {type(snapshot).__name__}")
        snapshot.check_options(self.options)
        self._episodes = copy_episodes(snapshot.episodes)
        self._scenario = snapshot.scenario
        self._egocentric = copy.deepcopy(snapshot.egocentric)
        self._transitions = [dict(crossing) for crossing in snapshot.transitions]
        self.np_random.bit_generator.state = copy.deepcopy(snapshot.random_state)
        self._np_random_seed = snapshot.seed
        self._screen.restore(0, self._episodes.rows, self.scenario.obstacles, snapshot.track)


def known_options() -> tuple[str, ...]:
    """Names of the options every environment of this package takes."""
    return tuple(inspect.getfullargspec(HydroneEnv.__init__).kwonlyargs)
