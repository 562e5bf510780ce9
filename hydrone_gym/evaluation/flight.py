"""Flying: a policy flies one world and everything worth knowing is kept, or many worlds in a batch."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from hydrone_gym.envs.hydrone_env import HydroneEnv
from hydrone_gym.evaluation.policies import Policy
from hydrone_gym.simulation.conditions import DRIVEN, weather_at
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import STILL, Simulation, row_at, trajectory
from hydrone_gym.surface import in_air
from hydrone_gym.world.scenario import Scenario

_TOLD = ("outcome", "time", "energy", "clearance", "transitions")  # by the last `info` of an episode


class Trace(NamedTuple):
    """A flight sampled every tick (0.05 s), the start included."""

    times: NDArray[np.float64]  # (N,) s
    states: NDArray[np.float64]  # (N, 12) the truth, laid out as in the observation
    references: NDArray[np.float64]  # (N, 4) the moving reference: m, m, m, rad
    conditions: NDArray[np.float64]  # (N, CONDITIONS) the weather and the vehicle as they are; (N, 0) without weather

    @property
    def weather(self) -> dict[str, NDArray[np.float64]]:
        """`wind` and `water` around the vehicle, (N, 3) in m/s, and `elevation` (N,) in m; nothing without weather."""
        return weather_at(self.conditions, 1, len(self.times)) if self.conditions.size else {}

    @property
    def driven(self) -> NDArray[np.bool_]:
        """Whether the controller takes the vehicle to be in air, (N,)."""
        return self.conditions[:, DRIVEN] > 0.0 if self.conditions.size else in_air(self.states[:, 2])

    def zone_speed(self, zone: float) -> float | None:
        """Return the greatest lateral speed (m/s) within the transition zone of ±`zone` m; None if never there."""
        there = self.states[np.abs(self.states[:, 2]) <= zone]
        return float(np.hypot(there[:, 6], there[:, 7]).max()) if len(there) else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Ending:
    """How an episode ended and what it took."""

    obstacles: int  #: spheres in its world
    outcome: Outcome  #: how it ended
    time: float  #: s
    energy: float  #: of the rotors' shafts, J
    clearance: float  #: least distance of the vehicle's sphere to an obstacle, m; infinite without obstacles
    #: of the surface: time (s), direction, lateral_speed (m/s), tilt (rad), vertical_speed (m/s)
    transitions: list[dict[str, Any]]
    length: float | None  #: of the path, summed over ticks, m; None in a batch, which does not keep them
    episode_return: float  #: sum of rewards
    decision_ms: NDArray[np.float64]  #: (K,) wall-clock time of each decision, ms; in a batch its share
    interventions: int | None  #: periods in which a shield flew another reference; None where nothing counts them
    #: greatest lateral speed within the transition zone, at any tick, m/s; None in a batch, or if never there
    zone_speed: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Flight(Ending):
    """A flown episode."""

    length: float
    scenario: Scenario  #: what was flown
    references: NDArray[np.float64]  #: (K, 4) in force at the end of each period, actions clipped: m, m, m, rad
    states: NDArray[np.float64]  #: (K + 1, 12) at the start and after each period: the truth
    detected: NDArray[np.float64]  #: (k, 4) spheres x, y, z, r in m, in order of detection
    trace: Trace  #: the same flight every tick

    @property
    def undetected(self) -> NDArray[np.float64]:
        """The scenario's other spheres, (m, 4)."""
        known = {tuple(sphere) for sphere in self.detected.tolist()}
        hidden = [sphere for sphere in self.scenario.obstacles.tolist() if tuple(sphere) not in known]
        return np.array(hidden).reshape(-1, 4)


def fly(env: gym.Env, policy: Policy, *, seed: int | None = None, scenario: Scenario | None = None) -> Flight:
    """Fly one episode of a HyDrone environment with `interface="world"`, wrapped or not, and return its record.

    The policy's memory is new; the environment draws what is flown from the `seed` unless a `scenario` is given, and
    weather and vehicle, where they are drawn, also then.

    Raises TypeError for an environment of another kind, ValueError for another interface, or a scenario not for it.
    """
    world = env.unwrapped
    if not isinstance(world, HydroneEnv):
        raise TypeError(f"fly needs a HyDrone environment, got {type(world).__name__}")
    if world.options.interface != "world":
        raise ValueError(f'fly needs an environment with interface="world", got {world.options.interface!r}')
    observation, info = env.reset(seed=seed, options=None if scenario is None else {"scenario": scenario})
    states, references, decisions, earned = [world.truth["state"]], [], [], 0.0
    conditions = world.get_state().conditions
    memory, start, done = None, np.array([True]), False
    while not done:
        began = time.perf_counter()
        answer = policy.predict(observation, state=memory, episode_start=start, deterministic=True)
        decisions.append(1e3 * (time.perf_counter() - began))
        action, memory = _checked(policy, answer, (4,))
        observation, reward, terminated, truncated, info = env.step(action)
        truth = world.truth
        states.append(truth["state"])
        references.append(truth["reference"])
        earned += float(reward)  # one by one, as a batch does: sum() compensates since Python 3.12
        start, done = np.array([False]), terminated or truncated
    trace = trace_of(world.simulation, world.scenario, states[0], np.array(references), conditions)
    return Flight(
        obstacles=len(world.scenario.obstacles),
        scenario=world.scenario,
        **{key: info[key] for key in _TOLD},
        length=float(np.linalg.norm(np.diff(trace.states[:, :3], axis=0), axis=1).sum()),
        episode_return=earned,
        references=np.array(references),
        states=np.array(states),
        detected=observation["obstacles"][observation["obstacles"][:, 3] > 0.0],
        decision_ms=np.array(decisions),
        interventions=_interventions(memory),
        zone_speed=trace.zone_speed(world.simulation.world.zone),
        trace=trace,
    )


def fly_worlds(
    env: gym.vector.VectorEnv,
    policy: Policy,
    *,
    seed: int | Sequence[int] | None = None,
    scenarios: Sequence[Scenario] | None = None,
) -> list[Ending]:
    """Fly a policy once in each row of a vector of environments, deterministically, all at once.

    Args:
        env: from `gym.make_vec(id, n, vectorization_mode="vector_entry_point")`, `interface="world"`.
        policy: chooses the references of all rows that still fly; its memory is new.
        seed: row i flies the world, weather and vehicle that a single environment draws from ``seed + i``, or from
            entry i of several.
        scenarios: the worlds to fly, one a row, None for drawn ones.

    Returns how the first episode of each row ended: as alone, if the policy chooses in a batch what it chooses alone.
    """
    if env.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP) != AutoresetMode.NEXT_STEP:
        raise ValueError(f"fly_worlds needs autoreset_mode NextStep, got {env.metadata['autoreset_mode']}")
    chosen: Any = {"seed": seed, "options": None if scenarios is None else {"scenario": list(scenarios)}}
    observation, _ = env.reset(**chosen)
    running, memory, starts = np.arange(env.num_envs), None, np.ones(env.num_envs, bool)
    returns, shares, endings = np.zeros(env.num_envs), [], {}
    while len(running):
        # rows fly on after their first episode; what they do then does not count, so the policy is spared it
        seen = {key: value[running] for key, value in observation.items()}
        actions, began = observation["reference"].astype(np.float32), time.perf_counter()
        answer = policy.predict(seen, state=memory, episode_start=starts, deterministic=True)
        shares.append(1e3 * (time.perf_counter() - began) / len(running))
        actions[running], memory = _checked(policy, answer, (len(running), 4))
        observation, rewards, _, _, info = env.step(actions)
        returns[running] += rewards[running]
        over = info["outcome"][running] != Outcome.RUNNING
        for k in np.flatnonzero(over):
            row = running[k]
            endings[row] = Ending(
                **{key: info[key][row] for key in _TOLD} | {"outcome": Outcome(info["outcome"][row])},
                obstacles=observation["obstacles"].shape[1] if scenarios is None else len(scenarios[row].obstacles),
                length=None,
                episode_return=float(returns[row]),
                decision_ms=np.array(shares),
                interventions=_interventions(memory, int(k)),
            )
        on = np.flatnonzero(~over)
        running, memory, starts = running[on], _rows_of(memory, on), np.zeros(len(on), bool)
    return [endings[row] for row in range(env.num_envs)]


def _checked(policy: Policy, answer: Any, shape: tuple[int, ...]) -> tuple[NDArray, Any]:
    """Return action and memory as `predict` returned them; ValueError naming the policy, the rule and what came."""
    must = f"policy {type(policy).__name__}: predict must return (action, state)"
    if not isinstance(answer, tuple) or len(answer) != 2:
        length = f" of length {len(answer)}" if isinstance(answer, tuple | list) else ""
        raise ValueError(f"{must}, got {type(answer).__name__}{length}")
    try:
        action = np.asarray(answer[0])
    except ValueError:  # rows of different lengths
        action = np.asarray(None)
    if action.dtype.kind not in "fiu":
        got = f"{type(answer[0]).__name__} of dtype {action.dtype}"
    elif action.shape != shape:
        got = f"shape {action.shape}"
    elif not np.isfinite(action).all():
        got = str(action[~np.isfinite(action).all(axis=1)][0] if action.ndim == 2 else action)
    else:
        return action, answer[1]
    raise ValueError(f"{must}, the action finite numbers (m, m, m, rad) of shape {shape}, got {got}")


def _interventions(memory: Any, row: int = 0) -> int | None:
    """Return how often a shield intervened in the episode of a row; None for a memory that does not count it."""
    counted = getattr(memory, "interventions", None)
    return None if counted is None else int(np.atleast_1d(counted)[row])


def _rows_of(memory: Any, rows: NDArray[np.intp]) -> Any:
    """Pick rows out of a policy's memory: arrays, sequences with an entry a row, and named tuples of such things."""
    if memory is None:
        return None
    if hasattr(memory, "_fields"):
        return type(memory)(*(_rows_of(part, rows) for part in memory))
    return memory[rows] if isinstance(memory, np.ndarray) else tuple(memory[row] for row in rows)


def trace_of(
    simulation: Simulation,
    scenario: Scenario,
    start: NDArray[np.float64],
    references: NDArray[np.float64],
    conditions: NDArray[np.float64] = STILL,
) -> Trace:
    """Play references again from a state, tick by tick: the same kernel, so the same flight bit for bit."""
    row = row_at(start, np.array(scenario.goal))
    around: list[NDArray[np.float64]] = []
    times, states, moving, _ = trajectory(simulation, row, references, scenario.obstacles, conditions, around)
    return Trace(times, states, moving, np.array(around))
