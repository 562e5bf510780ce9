"""A job of an evaluation: one policy in a few worlds of a mission.

Plain data go in and records come out, so that it can run in this process or in any other.
"""

import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

import hydrone_gym  # noqa: F401  (registers the ids, also in a worker process)
from hydrone_gym.evaluation.flight import fly
from hydrone_gym.evaluation.policies import PolicySource, told
from hydrone_gym.evaluation.records import Key, Record, record_of
from hydrone_gym.world.scenario import Scenario


@dataclass(frozen=True, kw_only=True)
class Job:
    """What one call of `fly_job` flies.

    Attributes:
        policy: what flies.
        seed: for policies that draw.
        env_id: registered id of the environment.
        options: its keyword options.
        suite, mission: names for the records.
        worlds: number and scenario of each world.
    """

    policy: PolicySource
    seed: int
    env_id: str
    options: Mapping[str, Any]
    suite: str
    mission: str
    worlds: tuple[tuple[int, Scenario], ...]

    @property
    def keys(self) -> list[Key]:
        """The keys of its records, in order."""
        return [(self.suite, self.mission, world, self.policy.label) for world, _ in self.worlds]


@dataclass(frozen=True, kw_only=True)
class Failure:
    """A flight that could not be flown to its end because its policy raised.

    Attributes:
        key: of the record it would have been.
        reason: the error in one line, with the place in the policy it came from.
        details: the whole traceback.
    """

    key: Key
    reason: str
    details: str


def fly_job(job: Job) -> tuple[list[Record], Failure | None]:
    """Fly the worlds of a job in turn; stop at the first whose policy raises, and say so beside the records before it.

    Every flight has a policy of its own, fresh from the factory, so a record depends on policy, seed and world alone,
    not on what else was flown in the same process.
    """
    env, records = make_env(job.env_id, job.options), []
    warm_up(job, env)
    for key, (_, scenario) in zip(job.keys, job.worlds, strict=True):
        try:
            records.append(record_of(key, fly(env, job.policy.make(env, job.seed), scenario=scenario)))
        except Exception as error:  # whatever a user's policy may raise
            return records, Failure(key=key, reason=told(error), details=traceback.format_exc())
    return records, None


def make_env(env_id: str, options: Mapping[str, Any]) -> gym.Env:
    """Make the environment of a mission."""
    return gym.make(env_id, disable_env_checker=True, **options)


_warm: set[tuple[str, str]] = set()  # label and origin of the policies that have decided in this process


def warm_up(job: Job, env: gym.Env) -> None:
    """Let a policy decide once in this process before it is timed, which compiles its kernels or loads them.

    What it raises then it will raise again in the flight.
    """
    name = (job.policy.label, job.policy.origin)
    if name in _warm:
        return
    _warm.add(name)
    observation, _ = env.reset(options={"scenario": job.worlds[0][1]})
    try:
        policy = job.policy.make(env, job.seed)
        action, _ = policy.predict(observation, state=None, episode_start=np.array([True]), deterministic=True)
        env.step(action)
    except Exception:
        return
