"""The plan of an evaluation: which flights, in which order, checked before the first of them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.jobs import Job, make_env, warm_up
from hydrone_gym.evaluation.policies import DEFAULT_POLICIES, Factory, PolicySource, find_policies
from hydrone_gym.evaluation.provenance import sources
from hydrone_gym.evaluation.records import Key
from hydrone_gym.evaluation.suites import Suite, load_suite
from hydrone_gym.vehicle import named_vehicle

WORLDS_A_JOB = 5  # enough that sending a job costs little, few enough that little is lost when one is cut short

SuiteLike = str | Path | Suite
PoliciesLike = str | Iterable[str] | Mapping[str, str | Factory]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What an evaluation flies; build it with `make_plan`.

    Attributes:
        suites: with no more worlds than are flown.
        policies: what flies them.
        seed: given to policies that draw.
        vehicle: "paper" or "physical".
    """

    suites: tuple[Suite, ...]
    policies: tuple[PolicySource, ...]
    seed: int
    vehicle: str

    def jobs(self) -> Iterator[Job]:
        """Yield all jobs: policies take turns on the same few worlds, so what is done is comparable at any moment."""
        for suite in self.suites:
            for mission in suite.missions:
                options = {**mission.options, "vehicle": self.vehicle}
                numbered = list(enumerate(mission.scenarios))
                for first in range(0, len(numbered), WORLDS_A_JOB):
                    for policy in self.policies:
                        yield Job(
                            policy=policy,
                            seed=self.seed,
                            env_id=mission.env_id,
                            options=options,
                            suite=suite.name,
                            mission=mission.name,
                            worlds=tuple(numbered[first : first + WORLDS_A_JOB]),
                        )

    def keys(self) -> list[Key]:
        """The keys of all records, in the order of the rows."""
        return [key for job in self.jobs() for key in job.keys]

    def arguments(self) -> dict[str, Any]:
        """What the rows depend on, as plain data: an evaluation is resumed only where all of it is the same."""
        return {
            "suites": {suite.name: suite.fingerprint() for suite in self.suites},
            "worlds": {s.name: {m.name: len(m.scenarios) for m in s.missions} for s in self.suites},
            "policies": {policy.label: policy.origin for policy in self.policies},
            "seed": self.seed,
            "vehicle": self.vehicle,
            "sources": sources(),
        }

    def check(self) -> None:
        """Reset every scenario and let every policy decide once, which also compiles or loads every kernel.

        Raises ValueError naming the scenario that cannot be flown, or the policy that cannot be made.
        """
        for suite in self.suites:
            for mission in suite.missions:
                env = make_env(mission.env_id, {**mission.options, "vehicle": self.vehicle})
                for world, scenario in enumerate(mission.scenarios):
                    try:
                        env.reset(options={"scenario": scenario})
                    except ValueError as error:
                        named = f"suite {suite.name}, mission {mission.name}, world {world} {scenario.name}".strip()
                        raise ValueError(f"{named}: {error}") from None
        for job, _ in zip(self.jobs(), self.policies):  # the first job of each policy
            env = make_env(job.env_id, job.options)
            job.policy.make(env, job.seed)
            warm_up(job, env)


def make_plan(
    suites: SuiteLike | Sequence[SuiteLike] = "paper-20",
    policies: PoliciesLike = DEFAULT_POLICIES,
    *,
    worlds: int | None = 100,
    seed: int = 0,
    vehicle: str = "paper",
) -> Plan:
    """Find suites and policies and check every argument; those of `evaluate`.

    Raises:
        ValueError: an argument out of range, two suites of one name, or a policy that is not known.
        FileNotFoundError: no such suite or file.
    """
    for name, number, least in (("worlds", worlds, 1), ("seed", seed, 0)):
        if number is not None and (isinstance(number, bool) or not isinstance(number, int) or number < least):
            raise ValueError(f"{name} must be a whole number of at least {least}, got {number!r}")
    named_vehicle(vehicle)
    several = [suites] if isinstance(suites, str | Path | Suite) else list(suites)
    loaded = [suite if isinstance(suite, Suite) else load_suite(suite) for suite in several]
    names = [suite.name for suite in loaded]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"there must be at least one suite, and suites must have different names, got {names}")
    kept = tuple(suite if worlds is None else suite.first(worlds) for suite in loaded)
    return Plan(suites=kept, policies=find_policies(policies), seed=seed, vehicle=vehicle)
