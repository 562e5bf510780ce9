"""Golden flights: a seeded world flown by a policy, and all that happened in it as eight bytes of a SHA-256.

World k is drawn from seed `FIRST` + k by one of the three ids in turn. Single environments and rows of a vector
environment must give the same bytes. Only what the environments and policies document is used.
"""

import hashlib
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import planners
from agents import load_agent

IDS = ("HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0", "HydroneGym/Mission-v0")
FIRST = 70_000_000  # seed of world 0: neither training nor the frozen suites draw from here
ROWS = 32  # of a vector environment, at most
KEYS = ("state", "integral", "reference", "goal", "obstacles")
CROSSING = ("time", "lateral_speed", "tilt", "vertical_speed")
REACH, STEPS = 1.5, 1024  # m, of random references near the vehicle; they lie on a lattice, so no machine rounds them


class Flown(NamedTuple):
    """A flight that has ended."""

    fingerprint: int  # the first eight bytes of its SHA-256
    outcome: int
    time: float  # s
    actions: NDArray[np.float32]  # (K, 4) m, m, m, rad


class Pilot(Protocol):
    """Chooses actions for one environment (a batch without its axis) or for several, and remembers what it must."""

    def act(self, observation: Any, starts: NDArray[np.bool_], worlds: Sequence[int]) -> NDArray[np.float32]:
        """Return the actions; where `starts` is True a flight of that world begins."""
        ...


class PolicyPilot:
    """A policy with Stable-Baselines3's `predict`, and its memory."""

    def __init__(self, policy: Any) -> None:
        self.policy, self.memory = policy, None

    def act(self, observation: Any, starts: NDArray[np.bool_], worlds: Sequence[int]) -> NDArray[np.float32]:
        action, self.memory = self.policy.predict(
            observation, state=self.memory, episode_start=starts, deterministic=True
        )
        return action


class Wanderer:
    """Random references from a stream of each world's own: near the vehicle in some worlds, anywhere in the others."""

    def __init__(self, space: gym.spaces.Box) -> None:
        self.low, self.high = space.low.astype(np.float64), space.high.astype(np.float64)
        self.streams: dict[int, np.random.Generator] = {}

    def act(self, observation: Any, starts: NDArray[np.bool_], worlds: Sequence[int]) -> NDArray[np.float32]:
        states = np.atleast_2d(observation["state"])
        rows = [self._one(*row) for row in zip(range(len(worlds)), states, starts, worlds, strict=True)]
        return np.array(rows, np.float32).reshape((*observation["state"].shape[:-1], 4))

    def _one(self, row: int, state: NDArray[np.float64], start: bool, world: int) -> NDArray[np.float64]:
        if start:
            self.streams[row] = np.random.default_rng(world)
        share = self.streams[row].integers(0, STEPS + 1, 4) / STEPS
        anywhere = self.low + share * (self.high - self.low)
        if world // len(IDS) % 2:
            return anywhere
        return np.clip(np.append(state[:3] + REACH * (2.0 * share[:3] - 1.0), anywhere[3]), self.low, self.high)


class Replay:
    """Sends what was sent before, world by world."""

    def __init__(self, actions: Mapping[int, NDArray[np.float32]]) -> None:
        self.actions, self.step = actions, {}

    def act(self, observation: Any, starts: NDArray[np.bool_], worlds: Sequence[int]) -> NDArray[np.float32]:
        sent = []
        for row, (start, world) in enumerate(zip(starts, worlds, strict=True)):
            self.step[row] = 0 if start else self.step[row] + 1
            recorded = self.actions[world]
            sent.append(recorded[min(self.step[row], len(recorded) - 1)])  # a flight may last longer than it did
        return np.array(sent).reshape((*observation["state"].shape[:-1], 4))


MakePilot = Callable[[Any], Pilot]

PILOTS: dict[str, MakePilot] = {
    "random": lambda env: Wanderer(getattr(env, "single_action_space", env.action_space)),
    "straight-line": lambda env: PolicyPilot(planners.StraightLine.for_env(env)),
    "potential-field": lambda env: PolicyPilot(planners.PotentialField.for_env(env)),
    "ppo": lambda env: PolicyPilot(load_agent("ppo", env)),
    "clrrt-published": lambda env: PolicyPilot(planners.PublishedCLRRT.for_env(env)),
    "mppi": lambda env: PolicyPilot(planners.MPPI.for_env(env)),
    "random-robust": lambda env: Wanderer(getattr(env, "single_action_space", env.action_space)),
}
OPTIONS = {"random-robust": {"controller": "robust"}}  # of the environments of a pilot, where they are not the defaults


class Log:
    """A flight in progress: the hash so far and the actions sent."""

    def __init__(self, observation: Mapping[str, NDArray]) -> None:
        self.digest, self.actions = hashlib.sha256(), []
        self._see(observation)

    def _see(self, observation: Mapping[str, NDArray]) -> None:
        for key in KEYS:
            self.digest.update(observation[key].tobytes())

    def step(self, action: NDArray[np.float32], returned: Sequence[Any]) -> None:
        """Add what `step` returned: observation, reward, terminated, truncated."""
        observation, reward, terminated, truncated = returned
        self.actions.append(np.array(action, np.float32))
        self._see(observation)
        self.digest.update(struct.pack("<d??", reward, terminated, truncated))

    def end(self, info: Mapping[str, Any]) -> Flown:
        """Add the last info; return the flight."""
        outcome, crossings = int(info["outcome"]), info["transitions"]
        figures = (info["time"], info["energy"], info["clearance"])
        self.digest.update(struct.pack("<Bddd", outcome, *figures))
        for crossing in crossings:
            self.digest.update(crossing["direction"].encode())
            self.digest.update(struct.pack("<dddd", *(crossing[key] for key in CROSSING)))
        fingerprint = int.from_bytes(self.digest.digest()[:8], "little")
        return Flown(fingerprint, outcome, float(info["time"]), np.array(self.actions))


def by_id(worlds: Iterable[int]) -> dict[str, list[int]]:
    """Sort worlds by the id that draws them."""
    found: dict[str, list[int]] = {}
    for world in worlds:
        found.setdefault(IDS[world % len(IDS)], []).append(world)
    return found


def fly_single(make: MakePilot, worlds: Iterable[int], options: Mapping[str, Any]) -> dict[int, Flown]:
    """Fly worlds one after the other in single environments."""
    flown = {}
    for name, queue in by_id(worlds).items():
        env = gym.make(name, disable_env_checker=True, **options)
        pilot = make(env)
        for world in queue:
            flown[world] = _fly_one(env, pilot, world)
        env.close()
    return flown


def _fly_one(env: gym.Env, pilot: Pilot, world: int) -> Flown:
    observation, info = env.reset(seed=FIRST + world)
    log, start, done = Log(observation), np.array([True]), False
    while not done:
        action = pilot.act(observation, start, [world])
        observation, reward, terminated, truncated, info = env.step(action)
        log.step(action, (observation, reward, terminated, truncated))
        start, done = np.array([False]), terminated or truncated
    return log.end(info)


def fly_vector(make: MakePilot, worlds: Iterable[int], options: Mapping[str, Any]) -> dict[int, Flown]:
    """Fly worlds side by side in vector environments; a row that ends begins the next world."""
    flown = {}
    for name, queue in by_id(worlds).items():
        flown |= _Rows(name, make, queue, options).fly()
    return flown


class _Rows:
    """A vector environment and its queue of worlds; rows without a world left fly their last one again, unnoted."""

    def __init__(self, name: str, make: MakePilot, queue: Sequence[int], options: Mapping[str, Any]) -> None:
        count = min(ROWS, len(queue), max(2, len(queue) // 2))
        self.env = gym.make_vec(
            name, num_envs=count, vectorization_mode="vector_entry_point", autoreset_mode="Disabled", **options
        )
        self.pilot = make(self.env)
        self.worlds, self.waiting = list(queue[:count]), list(queue[count:])
        self.logs: list[Log | None] = [None] * count
        self.flown: dict[int, Flown] = {}

    def fly(self) -> dict[int, Flown]:
        """Fly all."""
        starts = np.ones(len(self.worlds), bool)
        observation = self._begin(starts, range(len(self.worlds)))
        while any(self.logs):
            actions = self.pilot.act(observation, starts, self.worlds)
            observation, *returned, info = self.env.step(actions)
            starts = returned[1] | returned[2]
            for row, log in enumerate(self.logs):
                if log is not None:
                    log.step(actions[row], (_row(observation, row), *(part[row] for part in returned)))
            if starts.any():
                observation = self._next(starts, info)
        self.env.close()
        return self.flown

    def _next(self, ended: NDArray[np.bool_], info: Mapping[str, NDArray]) -> dict[str, NDArray]:
        """Note the flights that have ended and begin others in their rows."""
        noted = []
        for row in np.flatnonzero(ended).tolist():
            log, self.logs[row] = self.logs[row], None
            if log is not None:
                self.flown[self.worlds[row]] = log.end(_row(info, row))
            if self.waiting:
                self.worlds[row] = self.waiting.pop(0)
                noted.append(row)
        return self._begin(ended, noted)

    def _begin(self, rows: NDArray[np.bool_], noted: Iterable[int]) -> dict[str, NDArray]:
        """Reset rows to their worlds; keep a log of those that are to be noted."""
        seeds = [FIRST + world for world in self.worlds]
        observation, _ = self.env.reset(seed=seeds, options={"reset_mask": rows})
        for row in noted:
            self.logs[row] = Log(_row(observation, row))
        return observation


def _row(batch: Mapping[str, Any], row: int) -> dict[str, Any]:
    """One row of an observation or an info."""
    return {key: batch[key][row] for key in batch if isinstance(batch[key], np.ndarray)}
