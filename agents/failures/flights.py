"""Failed flights once more, singly, with everything kept that tells why they failed."""

from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs.egocentric import RawObservation
from hydrone_gym.evaluation.flight import Flight, fly
from hydrone_gym.evaluation.policies import Policy
from hydrone_gym.simulation.outcome import Outcome
from planners.shield import HELD, Shield


@dataclass(frozen=True, kw_only=True, eq=False)
class FailedFlight:
    """A flight that did not arrive.

    Attributes:
        mission: environment id.
        seed: of its world.
        flight: the whole record, every tick.
        known: for each of the world's M spheres the time (s) of the first decision made knowing it, inf for none.
        stoppable: (K,) whether a safe stop could still be chosen at each decision; None for a time-out, which nobody
            needed to stop for.
        period: s between decisions.
    """

    mission: str
    seed: int
    flight: Flight
    known: NDArray[np.float64]
    stoppable: NDArray[np.bool_] | None
    period: float


class DecisionRecorder:
    """Wraps a policy for one flight and keeps what it saw and chose; actions and memory stay as they are.

    Attributes:
        observations, actions: one entry a decision.
    """

    def __init__(self, policy: Policy) -> None:
        """Begin without decisions."""
        self.policy = policy
        self.observations: list[RawObservation] = []
        self.actions: list[NDArray[np.float32]] = []

    def predict(
        self, observation: Any, state: Any = None, episode_start: Any = None, deterministic: bool = False
    ) -> Any:
        """Return what the policy returns, and keep the decision."""
        action, memory = self.policy.predict(observation, state, episode_start, deterministic)
        self.observations.append(observation)
        self.actions.append(action)
        return action, memory


def fly_again(env: gym.Env, policy: Policy, mission: str, seed: int, outcome: Outcome) -> FailedFlight:
    """Fly the world of a seed once more and look at every decision.

    Args:
        env: single environment of that mission, `interface="world"`.
        policy: as it flew in the batch.
        mission: environment id, for the record.
        seed: of the world.
        outcome: how the flight ended in the batch.

    Raises:
        ValueError: the flight ends otherwise now, because the policy chooses differently alone than in a batch.
    """
    recorder = DecisionRecorder(policy)
    flight = fly(env, recorder, seed=seed)
    if flight.outcome is not outcome:
        raise ValueError(
            f"{mission}, world {seed}: {outcome.name} in the batch but {flight.outcome.name} alone; "
            "this needs a policy that chooses the same in a batch as alone"
        )
    shield = Shield.for_env(policy, env)
    period = shield.simulation.period
    return FailedFlight(
        mission=mission,
        seed=seed,
        flight=flight,
        known=_known_since(recorder.observations, flight.scenario.obstacles, period),
        stoppable=None if outcome is Outcome.TIMEOUT else _stoppable(recorder, shield),
        period=period,
    )


def _known_since(
    observations: list[RawObservation], spheres: NDArray[np.float64], period: float
) -> NDArray[np.float64]:
    """Return the time (M,) in s of the first decision made knowing each sphere, inf for none."""
    since: dict[tuple[float, ...], float] = {}
    for decision, observation in enumerate(observations):
        for sphere in observation["obstacles"].tolist():
            since.setdefault(tuple(sphere), decision * period)
    return np.array([since.get(tuple(sphere), np.inf) for sphere in spheres.tolist()])


def _stoppable(recorder: DecisionRecorder, shield: Shield) -> NDArray[np.bool_]:
    """Return for each decision whether the shield's check accepts the reference chosen, or one it would replace it by.

    Hovering where the vehicle is counts, and a retreat under water. What no one could know then, an undetected sphere,
    does not hinder it.
    """
    batch = {key: np.stack([seen[key] for seen in recorder.observations]) for key in recorder.observations[0]}
    chosen = np.array(recorder.actions, np.float64)
    return shield.check(batch, chosen, batch["reference"])[2] != HELD
