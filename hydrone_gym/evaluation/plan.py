"""The plan of an evaluation: which flights, in which order, and the jobs they are flown in.

A job is one policy in a few worlds of a mission. Plain data go in and records come out, so that it can run in this
process or in any other.
"""

import contextlib
import itertools
import traceback
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

import hydrone_gym  # noqa: F401  (registers the ids, also in a worker process)
from hydrone_gym.control.laws import named_law
from hydrone_gym.evaluation.flight import fly, fly_worlds
from hydrone_gym.evaluation.policies import DEFAULT_POLICIES, Factory, PolicySource, find_policies, told
from hydrone_gym.evaluation.provenance import sources
from hydrone_gym.evaluation.records import Key, Record, record_of
from hydrone_gym.evaluation.suites import HELD_OUT, Suite, load_suite, load_suites
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.world.scenario import Scenario

WORLDS_A_JOB = 5  # enough that sending a job costs little, few enough that little is lost when one is cut short
WORLDS_A_BATCH = 1000

_FIXED = ("seed", "vehicle", "controller", "sources")  # arguments that every row depends on

SuiteLike = str | Path | Suite
PoliciesLike = str | Iterable[str] | Mapping[str, str | Factory]


class BrokenOff(NamedTuple):
    """A flight that ended early because its policy raised."""

    key: Key  # of the record it would have been
    reason: str  # the error in one line, with the place in the policy it came from
    details: str  # the whole traceback


@dataclass(frozen=True, kw_only=True)
class Job:
    """What one call of `fly_job` flies."""

    policy: PolicySource  # what flies
    seed: int  # for policies that draw
    env_id: str  # registered id of the environment
    options: Mapping[str, Any]
    suite: str  # name for the records, as the next
    mission: str
    worlds: tuple[tuple[int, Scenario], ...]  # number and scenario of each world
    batch: bool  # whether to fly them all at once

    @property
    def keys(self) -> list[Key]:
        """The keys of its records, in order."""
        return [(self.suite, self.mission, world, self.policy.label) for world, _ in self.worlds]

    @property
    def weather_seeds(self) -> list[int]:
        """What weather and vehicle of each world are drawn from: the same for every policy and in all suites."""
        return [HELD_OUT + world for world, _ in self.worlds]

    def make_env(self) -> gym.Env:
        """Make its environment."""
        return gym.make(self.env_id, disable_env_checker=True, **self.options)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What an evaluation flies; build it with `make_plan`."""

    suites: tuple[Suite, ...]  # with no more worlds than are flown
    policies: tuple[PolicySource, ...]  # what flies them
    seed: int  # given to policies that draw
    vehicle: str  # name of its parameter set
    controller: str | None = None  # name of the control law; None for that of each mission's options

    def jobs(self) -> Iterator[Job]:
        """Yield all jobs: policies take turns on the same few worlds, so what is done is comparable at any moment."""
        law = {} if self.controller is None else {"controller": self.controller}
        for suite in self.suites:
            most = WORLDS_A_BATCH if suite.batch else WORLDS_A_JOB
            for mission in suite.missions:
                worlds = tuple(enumerate(mission.scenarios))
                parts = [worlds[first : first + most] for first in range(0, len(worlds), most)]
                for part, policy in itertools.product(parts, self.policies):
                    yield Job(
                        policy=policy,
                        seed=self.seed,
                        env_id=mission.env_id,
                        options={**mission.options, **law, "vehicle": self.vehicle},
                        suite=suite.name,
                        mission=mission.name,
                        worlds=part,
                        batch=suite.batch,
                    )

    def job_of(self, record: Record) -> Job:
        """Return the job that flies the world of a record again, alone; ValueError if the plan does not hold it."""
        for job in self.jobs():
            if record.key in job.keys:
                return replace(job, worlds=(job.worlds[job.keys.index(record.key)],), batch=False)
        raise ValueError(f"the plan does not hold {record.place}, policy {record.policy}")

    def keys(self) -> list[Key]:
        """The keys of all records, in the order of the rows."""
        return [key for job in self.jobs() for key in job.keys]

    def arguments(self) -> dict[str, Any]:
        """What the rows depend on, as plain data."""
        return {
            "suites": {suite.name: suite.fingerprint() for suite in self.suites},
            "worlds": {s.name: {m.name: len(m.scenarios) for m in s.missions} for s in self.suites},
            "policies": {policy.label: policy.origin for policy in self.policies},
            "digests": {policy.label: policy.digest for policy in self.policies},
            "seed": self.seed,
            "vehicle": self.vehicle,
            "controller": self.controller,
            "sources": sources(),
        }

    def changes(self, before: Mapping[str, Any]) -> list[str]:
        """Say why rows of an evaluation with other arguments are not rows of this one, nothing where they are.

        What may differ is what more is flown, and the code of policies.
        """
        now = self.arguments()
        told = [f"{name} was {before.get(name)}, is {now[name]}" for name in _FIXED if before.get(name) != now[name]]
        suites = {suite.name: suite for suite in self.suites}
        for name, fingerprint in before["suites"].items():
            most = max(before["worlds"][name].values())
            if name not in suites or suites[name].first(most).fingerprint() != fingerprint:
                were, are = before["worlds"][name], now["worlds"].get(name, "none")
                told.append(f"the worlds of {name} were {were}, are {are}{' others' * (were == are)}")
        if gone := [label for label in before["policies"] if label not in now["policies"]]:
            told.append(f"policies had {', '.join(gone)} too")
        return told

    def check(self) -> None:
        """Reset every scenario and let every policy decide once, which also compiles or loads every kernel.

        Raises ValueError naming the scenario that cannot be flown, or the policy that cannot be made.
        """
        jobs = list(self.jobs())
        for job in jobs[:: len(self.policies)]:
            env = job.make_env()
            for world, scenario in job.worlds:
                try:
                    env.reset(options={"scenario": scenario})
                except ValueError as error:
                    place = f"suite {job.suite}, mission {job.mission}, world {world} {scenario.name}".strip()
                    raise ValueError(f"{place}: {error}") from None
        for job in jobs[: len(self.policies)]:
            job.policy.make(env := job.make_env(), job.seed)
            _warm_up(job, env)


def make_plan(
    suites: SuiteLike | Sequence[SuiteLike] = "paper-20",
    policies: PoliciesLike = DEFAULT_POLICIES,
    *,
    worlds: int | None = 50,
    seed: int = 0,
    vehicle: str = "paper",
    controller: str | None = None,
) -> Plan:
    """Find suites and policies and check every argument; arguments and errors are those of `evaluate`."""
    for name, number, least in (("worlds", worlds, 1), ("seed", seed, 0)):
        if number is not None and (isinstance(number, bool) or not isinstance(number, int) or number < least):
            raise ValueError(f"{name} must be a whole number of at least {least}, got {number!r}")
    named_vehicle(vehicle)
    if controller is not None:
        named_law(controller, "controller")
    several = [suites] if isinstance(suites, str | Path | Suite) else list(suites)
    found = [[suite] if isinstance(suite, Suite) else load_suites(suite, worlds) for suite in several]
    loaded = [suite for suites in found for suite in suites]
    names = [suite.name for suite in loaded]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"there must be at least one suite, and suites must have different names, got {names}")
    kept = tuple(suite if worlds is None else suite.first(worlds) for suite in loaded)
    found_policies = find_policies(policies)
    return Plan(suites=kept, policies=found_policies, seed=seed, vehicle=vehicle, controller=controller)


def plan_of(arguments: Mapping[str, Any]) -> Plan:
    """Find again what an evaluation flew, from the arguments in its summary.

    Raises ValueError for a suite that is not what it was, FileNotFoundError for one that is neither frozen nor here.
    """
    suites = []
    for name, fingerprint in arguments["suites"].items():
        worlds = max(arguments["worlds"][name].values())
        suites.append(load_suite(name, worlds).first(worlds))
        if suites[-1].fingerprint() != fingerprint:
            raise ValueError(f"suite {name}: its worlds are not those that were flown; give the plan of the evaluation")
    policies = tuple(PolicySource.of_origin(label, origin) for label, origin in arguments["policies"].items())
    flown = {name: arguments[name] for name in ("seed", "vehicle", "controller")}
    return Plan(suites=tuple(suites), policies=policies, **flown)


def fly_job(job: Job) -> tuple[list[Record], BrokenOff | None]:
    """Fly the worlds of a job; stop at the first whose policy raises, and say so beside the records before it.

    Unless they are flown in a batch, every flight has a policy of its own, fresh from the factory, so a record depends
    on policy, seed and world alone, not on what else was flown in the same process.
    """
    env, scenarios, records = job.make_env(), [scenario for _, scenario in job.worlds], list[Record]()
    _warm_up(job, env)
    try:
        if job.batch:
            rows = gym.make_vec(job.env_id, len(scenarios), "vector_entry_point", **job.options)
            endings = fly_worlds(rows, job.policy.make(env, job.seed), seed=job.weather_seeds, scenarios=scenarios)
            return list(map(record_of, job.keys, endings)), None
        for key, seed, scenario in zip(job.keys, job.weather_seeds, scenarios, strict=True):
            records.append(record_of(key, fly(env, job.policy.make(env, job.seed), seed=seed, scenario=scenario)))
    except (Exception, SystemExit) as error:  # whatever a user's policy may raise
        return records, BrokenOff(job.keys[len(records)], told(error), traceback.format_exc())
    return records, None


_warm: set[tuple[str, str]] = set()  # label and digest of the policies that have decided in this process


def _warm_up(job: Job, env: gym.Env) -> None:
    """Let a policy decide once in this process before it is timed, which compiles its kernels or loads them.

    What it raises then it will raise again in the flight.
    """
    name = (job.policy.label, job.policy.digest or job.policy.origin)
    if name in _warm:
        return
    _warm.add(name)
    observation, _ = env.reset(options={"scenario": job.worlds[0][1]})
    with contextlib.suppress(Exception, SystemExit):
        policy = job.policy.make(env, job.seed)
        action, _ = policy.predict(observation, state=None, episode_start=np.array([True]), deterministic=True)
        env.step(action)
