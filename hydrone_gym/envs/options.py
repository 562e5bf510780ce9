"""The options of every environment of this package, checked in one place."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

from hydrone_gym.simulation.simulation import ticks_in
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, ScenarioLaw, prepare
from hydrone_gym.world.world import World

MISSIONS = {"air_to_water": EXPERIMENT_1, "water_to_air": EXPERIMENT_2, "random": ScenarioLaw()}
INTERFACES = ("world", "egocentric")


@dataclass(frozen=True, kw_only=True)
class Options:
    """What an environment was made with; see the docstring of `HydroneEnv` for each.

    Raises ValueError naming the option, its rule and the value.
    """

    mission: str
    num_obstacles: int
    obstacle_radius: tuple[float, float]
    sensor_range: float
    vehicle: Vehicle
    period: float
    vertical_mode: bool
    rough_transition: str
    time_limit: float
    interface: str

    def __post_init__(self) -> None:
        """Check every option, also that scenarios can be drawn with them."""
        _one_of("mission", self.mission, tuple(MISSIONS))
        _one_of("interface", self.interface, INTERFACES)
        _one_of("rough_transition", self.rough_transition, ("fail", "count"))
        if not isinstance(self.vertical_mode, bool):
            raise ValueError(f"vertical_mode must be True or False, got {self.vertical_mode!r}")
        for name, unit in (("sensor_range", "m"), ("period", "s"), ("time_limit", "s")):
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not math.isfinite(value) or value <= 0:
                raise ValueError(f"{name} must be a positive number ({unit}), got {value!r}")
        ticks_in(self.period)
        law = self.law
        object.__setattr__(self, "num_obstacles", int(law.num_obstacles))
        object.__setattr__(self, "obstacle_radius", law.obstacle_radius)
        prepare(law, self.world, self.vehicle.radius)

    @property
    def world(self) -> World:
        """The world the environment flies in."""
        return World(
            sensor_range=float(self.sensor_range),
            vertical_mode=self.vertical_mode,
            rough_transition=self.rough_transition,
        )

    @property
    def law(self) -> ScenarioLaw:
        """What scenarios are drawn by at reset."""
        return dataclasses.replace(
            MISSIONS[self.mission], num_obstacles=self.num_obstacles, obstacle_radius=self.obstacle_radius
        )


def _one_of(name: str, value: Any, known: tuple[str, ...]) -> None:
    """Raise ValueError unless an option is one of the known strings."""
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}, got {value!r}")
