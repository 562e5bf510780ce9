"""What a planner believes: the model it predicts with, which is not the world it flies in.

Truth is what the environment flies, perceived is what an observation says, and belief is the third thing: the nominal
vehicle under its law, in the world as it is described, with the obstacles as they were last seen. These come with each
observation; all else is a `Belief`. In a perfect world the three are equal, bit for bit.
"""

from dataclasses import dataclass
from typing import Any, Literal, Self

from hydrone_gym.control.envelope import Envelope
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World


@dataclass(frozen=True, kw_only=True)
class Belief:
    """The model that planners and shields predict with.

    Attributes:
        vehicle: the nominal one.
        world: bounds, surface, sensing and what counts as arrival.
        period: s.
        law: name of the control law that flies the vehicle.
    """

    vehicle: Vehicle
    world: World
    period: float = 0.5
    law: str = "paper"

    @classmethod
    def of(cls, model: Any) -> Self:
        """Return a belief as it is, or one of the same model as a `Simulation` or the options of an environment."""
        if isinstance(model, cls):
            return model
        law: Any = getattr(model, "controller", None) or getattr(model, "law", "paper")  # of options, of a simulation
        return cls(vehicle=model.vehicle, world=model.world, period=model.period, law=law)

    @property
    def envelope(self) -> Envelope:
        """The limits of the vehicle."""
        return envelope_of(self.vehicle, self.law)

    def simulation(self, lanes: int = 1, *, weathered: bool = False) -> Simulation:
        """Return a simulation of what is believed, in still air and flat water or in weather; with its own storage."""
        return Simulation(self.vehicle, self.world, self.period, lanes, self.law, weathered)


def belief_of(env: Any, belief: Belief | Literal["truth"] | None = None) -> Belief:
    """Return what to believe in an environment, wrapped or not, or in the first one of a vector of them.

    Args:
        env: the environment.
        belief: None for the nominal model, the vehicle and world that the environment was made with; a `Belief` to
            believe otherwise; "truth" for the model that is really flown, a privilege that only studies may grant.

    Raises:
        TypeError: anything that is not a HyDrone environment, or no belief.
    """
    first = env.envs[0] if hasattr(env, "envs") else env
    inner = getattr(first, "unwrapped", first)
    truth, nominal = getattr(inner, "simulation", None), getattr(inner, "options", None)
    if not isinstance(truth, Simulation) or nominal is None:
        raise TypeError(f"for_env needs a HyDrone environment or a vector of them, got {type(env).__name__}")
    if belief is None:
        return Belief.of(nominal)
    if isinstance(belief, Belief):
        return belief
    if belief != "truth":
        raise TypeError(f'belief must be a planners.belief.Belief, "truth" or None, got {belief!r}')
    return Belief.of(truth)
