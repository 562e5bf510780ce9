"""`HydroneEnv`: one vehicle and one mission as a Gymnasium environment."""

import copy
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.envs.batch import EpisodeBatch
from hydrone_gym.envs.info import info_of
from hydrone_gym.envs.options import Options, known_options, takes, with_options
from hydrone_gym.envs.requests import load_reference, requested_scenario, reset_options
from hydrone_gym.envs.reward import TERMS
from hydrone_gym.envs.task import OUTCOME, Episodes
from hydrone_gym.rendering.track import Track
from hydrone_gym.simulation.conditions import conditions_of
from hydrone_gym.simulation.outcome import GOAL, RUNNING, TIMEOUT, Outcome
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.generator import generate
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World

__all__ = ["HydroneEnv", "known_options"]

Observation = dict[str, NDArray[np.float64]] | NDArray[np.float32]
_ONLY = np.zeros(1, np.int64)


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """What `HydroneEnv.get_state` returns: enough to go on bit for bit, picklable, sharing no memory with it."""

    options: Options  # of the environment it was taken from; only such an environment can restore it
    scenario: Scenario  # being flown
    episodes: Episodes
    transitions: tuple[dict[str, Any], ...]  # so far
    random_state: dict[str, Any]  # of the bit generator that draws scenarios
    seed: int | None  # that it was made from
    egocentric: tuple[NDArray[np.float64], NDArray[np.float32]]  # memory and last observation, if that is the interface
    conditions: NDArray[np.float64]  # weather and the vehicle as it is; empty where they are not simulated
    disturbance: type | None  # class of the disturbance in them
    streams: NDArray[np.float64]  # that conditions are drawn from
    track: Track | None  # flown so far, for pictures; None without `render_mode`


class HydroneEnv(gym.Env[Any, Any]):
    """A hybrid quadrotor flies, dives and swims to its goal among spheres it only sees from near.

    ## Description
    The HyDrone lives in a box of 20 x 20 x 15 m, air above z = 0 and water below. It starts at rest and has to reach
    the goal within 0.5 m, without touching a sphere and without crossing the surface roughly. A step is one period: the
    reference moves on a straight line from where it was to the action, and a control law, the paper's unless
    `controller` names another, follows it at 100 Hz. Inside the transition zone, abs(z) <= 0.8 m, `vertical_mode` holds
    the vehicle still laterally, and in air it does not descend before it is nearly at rest; `crossing` has other rules.
    World frame: x, y horizontal, z up; SI units.

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
    | `integral` | (4,) | the controller's memory, zeros at the start and after a crossing |
    | `reference` | (4,) | the reference now in force (m, m, m, rad) |
    | `goal` | (3,) | m |
    | `obstacles` | (num_obstacles, 4) | `[x, y, z, r]` (m) of the spheres detected so far, in order; zero rows after |

    The memory of the paper's law is its integrals: altitude, roll, pitch, yaw (rpm in air, N in water); that of the
    robust law the velocity (m/s, world) and the yaw rate (rad/s) that it predicted for now.
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
    `tilt` (rad), `vertical_speed` (m/s); at most 8 a period; speeds relative to the water), `reward_terms` and, at the
    end, `is_success`. In weather also `weather`, the truth that no observation tells: `wind` and `water`, the
    velocities of both around the vehicle (3,) in m/s, and `elevation`, of the surface above its mean, m.

    ## Arguments
    All by keyword, also through `gymnasium.make`:

    `Options` lists them.

    ## Version History
    - v0: first version.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 2}

    @takes(Options)
    def __init__(self, options: Options) -> None:
        """Set up the simulation."""
        self.options = options
        self.render_mode = options.render_mode
        self.metadata = {**self.metadata, "render_fps": 1.0 / options.period}
        self._core = EpisodeBatch(options, 1, lanes=1, render_modes=("rgb_array", "human"))
        self.action_space, self.observation_space = self._core.action_space, self._core.observation_space
        self._reference = np.zeros((1, 4))
        self._scenario: Scenario | None = None
        self._outcome: float | None = None  # a plain number: comparing with the enumeration takes microseconds

    @property
    def simulation(self) -> Simulation:
        """What advances it: the truth."""
        return self._core.simulations[0]

    @property
    def truth(self) -> dict[str, Any]:
        """The true `state` (12,) and the `reference` (4,) in force, whatever an observation tells; for records.

        Where there is weather, also `conditions`: the weather and the vehicle as they are, a
        `hydrone_gym.simulation.conditions.Conditions`.
        """
        row, core = self._core.episodes.rows[0], self._core
        told = {"state": row["state"].copy(), "reference": row["reference"].copy()}
        return told | ({"conditions": conditions_of(core.outdoors.conditions, 1, 0)} if core.outdoors.weathered else {})

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

        `seed` is that of the stream of scenarios; options {"scenario": Scenario, or the path of its JSON file} fly that
        one instead. Raises ValueError for an unknown key, or a scenario that is impossible in this world.
        """
        super().reset(seed=seed)
        core, (chosen,) = self._core, reset_options(options, "scenario")
        scenario = requested_scenario(chosen, self.simulation, core.sphere_space)
        if scenario is None:
            scenario = generate(core.draws, self.world, self.vehicle.radius, self.np_random)
        core.generators = [self.np_random]
        core.outdoors.reseeded |= seed is not None
        core.begin(_ONLY, core.missions_of(_ONLY, [scenario]), [scenario])
        self._scenario, self._outcome = scenario, RUNNING
        now, conditions = core.episodes, core.outdoors.conditions
        core.screen.begin(0, now.rows, now.seen, scenario.obstacles, conditions)
        return core.observation_of(0), info_of(
            core.episodes.report[0].tolist(), core.transitions[0], core.outdoors.weather()
        )

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fly one period, the reference moving to the action (4,), m and rad; returns are as the class describes them.

        Raises ValueError for an action of another shape or not finite, ResetNeeded without an episode that goes on.
        """
        core = self._core
        now, screen = core.episodes, core.screen
        if self._outcome != RUNNING:
            ended = "" if self._outcome is None else Outcome(int(self._outcome)).name
            when = f"after the episode ended with {ended}" if ended else "before reset()"
            raise ResetNeeded(f"step() was called {when}: call reset() first")
        if core.egocentric is None:
            references = self._reference
            load_reference(action, core.low, core.high, references[0])
        else:
            references = core.references(np.asarray(action)[None])
        screen.add(0, now.rows, references, core.outdoors.conditions)
        core.advance(references)
        core.look(_ONLY)
        screen.update(now.rows, now.seen)
        report = now.report[0].tolist()
        if report[-1] > 0.0:
            core.note_crossings(slice(0, 1))
        self._outcome = outcome = report[OUTCOME]
        info, truncated = info_of(report, core.transitions[0], core.outdoors.weather()), outcome == TIMEOUT
        if outcome != RUNNING:
            info["is_success"] = outcome == GOAL
        return core.observation_of(0), report[len(TERMS)], outcome != RUNNING and not truncated, truncated, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return a new picture (height, width, 3), or None with a window; raises ResetNeeded before the first reset."""
        return self._core.render(0)

    def close(self) -> None:
        """Close the window, if there is one."""
        self._core.screen.close()

    def get_state(self) -> Snapshot:
        """Return a complete snapshot of the episode and the random stream; raises ResetNeeded before reset."""
        core = self._core
        return Snapshot(
            options=self.options,
            scenario=self.scenario,
            episodes=Episodes._make(array.copy() for array in core.episodes),
            transitions=tuple(dict(crossing) for crossing in core.transitions[0]),
            random_state=copy.deepcopy(self.np_random.bit_generator.state),  # type: ignore[arg-type]
            seed=self._np_random_seed,
            egocentric=(core.memory.copy(), core.seen.copy()),
            conditions=core.outdoors.conditions.copy(),
            disturbance=core.outdoors.extra,
            streams=core.outdoors.streams.copy(),
            track=core.screen.track(0),
        )

    def set_state(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot, bit for bit; it can be used again.

        Raises TypeError for anything else, ValueError for a snapshot of an environment with other options.
        """
        if not isinstance(snapshot, Snapshot):
            raise TypeError(f"snapshot must come from get_state(), got {type(snapshot).__name__}")
        if differing := snapshot.options.differences(self.options):
            pairs = [(name, getattr(snapshot.options, name), getattr(self.options, name)) for name in differing]
            listed = ", ".join(f"{name} (snapshot {theirs!r}, here {own!r})" for name, theirs, own in pairs)
            raise ValueError(f"snapshot is of an environment with other options: {listed}")
        core, self._scenario = self._core, snapshot.scenario
        core.restore_outdoors(snapshot.conditions, snapshot.disturbance, snapshot.streams)
        self._outcome = float(snapshot.episodes.report[0, OUTCOME])
        own: list[np.ndarray] = [*core.episodes, core.memory, core.seen]
        for array, kept in zip(own, (*snapshot.episodes, *snapshot.egocentric), strict=True):
            array[...] = kept
        core.transitions[0] = [dict(crossing) for crossing in snapshot.transitions]
        self.np_random.bit_generator.state = copy.deepcopy(snapshot.random_state)
        self._np_random_seed = snapshot.seed
        conditions = core.outdoors.conditions
        core.screen.restore(0, core.episodes.rows, self.scenario.obstacles, snapshot.track, conditions)


HydroneEnv.__doc__ = with_options(HydroneEnv.__doc__, Options)
