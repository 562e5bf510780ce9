"""The world: bounds, water surface, transition zone, sensing and what counts as arrival or as a rough crossing."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple


class WorldParams(NamedTuple):
    """`World` as the kernels read it."""

    x_min: float
    y_min: float
    z_min: float
    x_max: float
    y_max: float
    z_max: float
    zone: float
    sensor_range: float
    goal_radius: float
    rough_speed: float
    rough_cos_tilt: float
    vertical_mode: float  # 1 or 0
    rough_fails: float  # 1 or 0


# What a crossing may be, by name: fields of a `World`. None is steeper than a peak deceleration of 25 m/s^2 allows:
# drag stops a vehicle that enters at 0.98 m/s with as much (26 1/m, Table 1), and the laws enter slower.
CROSSINGS: dict[str, dict[str, Any]] = {
    "vertical": {},  # the paper's rule: vertical motion only inside the transition zone
    "adaptive": {"vertical_mode": False},  # as smooth at the surface, free above and below it
    "aggressive": {"vertical_mode": False, "rough_speed": 1.0, "rough_tilt": math.radians(15.0)},
}


@dataclass(frozen=True, kw_only=True)
class World:
    """The box the vehicle lives in, with the water surface at z = 0 (paper, Sec. 4).

    Raises ValueError for a value out of range, named with its unit.
    """

    lower: tuple[float, float, float] = (-10.0, -10.0, -5.0)  #: corner of the box the vehicle's centre must stay in, m
    upper: tuple[float, float, float] = (10.0, 10.0, 10.0)  #: the opposite corner, m
    zone: float = 0.8  #: half-height μ of the transition zone, m
    sensor_range: float = 3.0  #: an obstacle is detected once its surface has been this close to the centre, m
    goal_radius: float = 0.5  #: distance at which the goal counts as reached, m
    rough_speed: float = 0.2  #: lateral speed above which a crossing is rough, m/s
    rough_tilt: float = math.radians(5.0)  #: tilt above which a crossing is rough, rad
    vertical_mode: bool = True  #: inside the zone the lateral reference gives way to holding still
    rough_transition: str = "fail"  #: "fail" ends an episode at a rough crossing; "count" only counts it

    def __post_init__(self) -> None:
        """Check every field."""
        for name in ("lower", "upper"):
            corner = getattr(self, name)
            if len(corner) != 3 or not all(map(math.isfinite, corner)):
                raise ValueError(f"World.{name} must be three finite numbers (m), got {corner!r}")
            object.__setattr__(self, name, tuple(map(float, corner)))  # hashable, whatever was given
        for axis, low, high in zip("xyz", self.lower, self.upper, strict=True):
            if low >= high:
                raise ValueError(f"World.upper must exceed World.lower along {axis} (m), got {low!r} to {high!r}")
        units = {"zone": "m", "sensor_range": "m", "goal_radius": "m", "rough_speed": "m/s", "rough_tilt": "rad"}
        for name, unit in units.items():
            value = getattr(self, name)
            if not math.isfinite(value) or value <= 0:
                raise ValueError(f"World.{name} must be positive ({unit}), got {value!r}")
        if self.lower[2] >= -self.zone or self.upper[2] <= self.zone:
            raise ValueError(
                f"World must reach beyond the transition zone of +-{self.zone} m in z, "
                f"got {self.lower[2]!r} to {self.upper[2]!r} m"
            )
        if not isinstance(self.vertical_mode, bool):
            raise ValueError(f"World.vertical_mode must be True or False, got {self.vertical_mode!r}")
        if self.rough_transition not in ("fail", "count"):
            raise ValueError(f"World.rough_transition must be 'fail' or 'count', got {self.rough_transition!r}")


def world_params(world: World) -> WorldParams:
    """Flatten a world for the kernels."""
    lengths = world.zone, world.sensor_range, world.goal_radius
    flags = float(world.vertical_mode), float(world.rough_transition == "fail")
    return WorldParams(*world.lower, *world.upper, *lengths, world.rough_speed, math.cos(world.rough_tilt), *flags)
