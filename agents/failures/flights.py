"""Failed flights once more, singly, with everything kept that tells why they failed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from hydrone_gym.evaluation.flight import Flight, fly
from hydrone_gym.evaluation.policies import Policy
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World
from planners.shield import HELD, Shield


@dataclass(frozen=True, kw_only=True, eq=False)
class FailedFlight:
    """A flight that did not arrive."""

    mission: str  # environment id
    seed: int  # of its world
    world: World  # of its environment
    flight: Flight  # the whole record, every tick
    known: NDArray[np.float64]  # (M,) s, first decision made knowing each of the world's spheres, inf for none
    stoppable: NDArray[np.bool_]  # (K,) whether a safe stop could still be chosen; all False for a time-out
    period: float  # s between decisions


@dataclass(frozen=True)
class _Recorder:
    """Wraps a policy for one flight and keeps what it saw and chose; actions and memory stay as they are."""

    policy: Policy
    seen: list[tuple[Mapping[str, NDArray], NDArray]] = field(default_factory=list)  # observation and action

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> Any:
        action, memory = self.policy.predict(observation, state, episode_start, deterministic)
        self.seen.append((observation, action))
        return action, memory


def fly_failed(
    env: gym.Env, policy: Policy, scenario: Scenario, *, mission: str, seed: int, outcome: str
) -> FailedFlight:
    """Fly a failed flight once more, alone, and look at every decision.

    `mission` and `seed` say where the world is from; `outcome` is the name of that in the batch. Raises ValueError if
    the flight ends otherwise now, because the policy chooses differently alone than in a batch.
    """
    recorder = _Recorder(policy)
    flight = fly(env, recorder, scenario=scenario)
    if flight.outcome.name != outcome:
        raise ValueError(
            f"{mission}, world {seed}: {outcome} in the batch but {flight.outcome.name} alone; "
            "this needs a policy that chooses the same in a batch as alone"
        )
    period = env.get_wrapper_attr("options").period
    since: dict[tuple[float, ...], float] = {}
    for decision, (observation, _) in enumerate(recorder.seen):
        for sphere in observation["obstacles"].tolist():
            since.setdefault(tuple(sphere), decision * period)
    # A safe stop can be chosen where the shield's check accepts the reference chosen, or one it would replace it by:
    # hovering counts, and a retreat under water. An undetected sphere, which no one could know then, does not hinder.
    observations, actions = zip(*recorder.seen, strict=True)
    batch = {key: np.stack([seen[key] for seen in observations]) for key in observations[0]}
    shield = Shield.for_env(policy, env)
    stoppable = shield.check(batch, np.array(actions, np.float64), batch["reference"])[2] != HELD
    return FailedFlight(
        mission=mission,
        seed=seed,
        world=env.get_wrapper_attr("world"),
        flight=flight,
        known=np.array([since.get(tuple(sphere), np.inf) for sphere in flight.scenario.obstacles.tolist()]),
        stoppable=stoppable & (flight.outcome is not Outcome.TIMEOUT),
        period=period,
    )
