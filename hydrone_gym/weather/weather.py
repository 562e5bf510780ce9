"""`Weather` and `Spread`: what users write, and the named levels.

A level is a wind with the sea that belongs to it, and a vehicle that is farther from the nominal one the higher it is.
"""

import math
import sys
from dataclasses import dataclass
from typing import Any

from hydrone_gym.vehicle import LEAST_HEIGHT
from hydrone_gym.weather.disturbance import check
from hydrone_gym.weather.waves import STEEPEST, wave_number

DEPTH = 5.0  # m, of the default world's water: what the steepness of a wave is judged by
ROTOR_DRAG = 1.19e-4  # N s/(m rad/s) a rotor: RotorPy's Hummingbird
Range = tuple[float, float]

# Rule of each number: unit, least and greatest value, and why it ends there.
_NUMBERS = {
    "wind": ("m/s", 0.0, 20.0, "a gale; the law's greatest tilt holds the vehicle in 12"),
    "turbulence": ("1", 0.0, 3.0, "beyond, gusts are as strong as the wind itself"),
    "current": ("m/s", 0.0, 2.0, "the vehicle swims at 1.2 m/s at most"),
    "current_variation": ("1", 0.0, 1.0, "beyond, eddies are stronger than the current itself"),
    "wave_height": ("m", 0.0, 3.0, "the water is 5 m deep"),
    "wave_period": ("s", 0.3, 20.0, "a shorter wave is a ripple, a longer one a tide"),
}
_DIRECTIONS = ("wind_direction", "current_direction", "wave_direction")
_RANGES = {"rotor_lag_air": ("s", 1.0), "rotor_lag_water": ("s", 1.0), "rotor_drag": ("N s/(m rad/s)", 1e-2)}
SEAS = ("regular", "jonswap")


def _is_number(value: Any) -> bool:
    # Comparing, unlike math.isfinite, also copes with an integer too large for a float.
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


@dataclass(frozen=True, kw_only=True)
class Spread:
    """How far the vehicle of an episode may be from the nominal one, which controller and planners believe in.

    Each quantity is drawn anew for every episode, evenly within its bounds. Raises ValueError naming the field, its
    rule and its unit.
    """

    mass: float = 0.0  #: greatest deviation, as a share of the nominal mass; 0 is exact
    thrust: float = 0.0  #: of the thrust at a speed, drawn for the rotors of air and of water separately
    inertia: float = 0.0  #: of each moment of inertia
    drag: float = 0.0  #: of drag and added mass, drawn for translation and for rotation separately
    rotor_lag_air: Range | None = None  #: least and greatest time constant of the rotors in air, s; None: the vehicle's
    rotor_lag_water: Range | None = None  #: and in water, s
    rotor_drag: Range | None = None  #: linear drag of a rotor against the air, N s/(m rad/s)
    height: Range | None = None  #: height of hull over which it dips in and out of the water, m

    def __post_init__(self) -> None:
        """Check every field."""
        for name in ("mass", "thrust", "inertia", "drag"):
            value = getattr(self, name)
            if not _is_number(value) or not 0.0 <= value <= 0.9:
                raise ValueError(
                    f"Spread.{name} must lie between 0 and 0.9, a share of the nominal value, got {value!r}"
                )
            object.__setattr__(self, name, float(value))
        for name, (unit, most) in {**_RANGES, "height": ("m", 1.0)}.items():
            pair = getattr(self, name)
            if pair is None:
                continue
            numbers = isinstance(pair, tuple | list) and len(pair) == 2 and all(map(_is_number, pair))
            if not numbers or not 0.0 <= pair[0] <= pair[1] <= most:
                raise ValueError(
                    f"Spread.{name} must be (least, greatest) between 0 and {most:g} ({unit}), got {pair!r}"
                )
            object.__setattr__(self, name, (float(pair[0]), float(pair[1])))
        if self.height is not None and self.height[1] > 0.0 and self.height[0] < LEAST_HEIGHT:
            raise ValueError(f"Spread.height must begin at {LEAST_HEIGHT} m or be (0, 0), got {self.height!r}")

    @classmethod
    def of(cls, value: "float | Spread | None") -> "Spread":
        """Return a spread: None is none at all, a number that share of mass, thrust, inertia and drag."""
        if value is None or isinstance(value, Spread):
            return value or cls()
        if not _is_number(value):
            raise TypeError(f"vehicle_spread must be a hydrone_gym.Spread, a number or None, got {value!r}")
        return cls(mass=value, thrust=value, inertia=value, drag=value)


@dataclass(frozen=True, kw_only=True)
class Weather:
    """Wind, current and waves of an episode, and how far its vehicle may be from the nominal one.

    Directions that are None are drawn anew for every episode, evenly all round. Raises ValueError naming the field, its
    rule and its unit. Sources: gusts MIL-F-8785C (Dryden, low altitude), current Gauss-Markov about its mean, waves
    Airy's linear theory and the JONSWAP spectrum.
    """

    wind: float = 0.0  #: mean wind 20 ft above the water, m/s
    wind_direction: float | None = None  #: where it blows to, rad from +x to +y
    turbulence: float = 1.0  #: intensity of gusts over that of Dryden's model for this wind
    shear: bool = False  #: the mean wind grows with height as the logarithm of MIL-F-8785C
    current: float = 0.0  #: mean current, m/s
    current_direction: float | None = None  #: where it flows to, rad
    current_variation: float = 0.2  #: standard deviation of each component of the current, as a share of the mean
    wave_height: float = 0.0  #: crest to trough, m; of an irregular sea its significant height
    wave_period: float = 2.0  #: s; of an irregular sea that of its peak
    wave_direction: float | None = None  #: where the waves run to, rad
    sea: str = "regular"  #: "regular" for one wave, "jonswap" for a few components drawn from that spectrum
    extra: Any = None  #: what else moves air and water: a disturbance, see `hydrone_gym.weather.disturbance`
    spread: Spread = Spread()  #: how far the vehicle may be from the nominal one
    name: str = "custom"  #: what to call it in tables

    def __post_init__(self) -> None:
        """Check every field, and that the waves do not break."""
        for name, (unit, least, most, why) in _NUMBERS.items():
            value = getattr(self, name)
            if not _is_number(value) or not least <= value <= most:
                rule = f"must lie between {least:g} and {most:g} ({unit}; {why})"
                raise ValueError(f"Weather.{name} {rule}, got {value!r}")
            object.__setattr__(self, name, float(value))
        for name in _DIRECTIONS:
            value = getattr(self, name)
            if value is None:
                continue
            if not _is_number(value):
                raise ValueError(f"Weather.{name} must be a finite number (rad) or None, got {value!r}")
            object.__setattr__(self, name, float(value))
        if not isinstance(self.shear, bool):
            raise ValueError(f"Weather.shear must be True or False, got {self.shear!r}")
        if self.sea not in SEAS:
            raise ValueError(f"Weather.sea must be one of {', '.join(map(repr, SEAS))}, got {self.sea!r}")
        if not isinstance(self.spread, Spread):
            raise ValueError(f"Weather.spread must be a Spread, got {self.spread!r}")
        if self.extra is not None:
            check(self.extra)
        if not isinstance(self.name, str):
            raise ValueError(f"Weather.name must be a string, got {self.name!r}")
        k = wave_number(2.0 * math.pi / self.wave_period, DEPTH)
        length, share = 2.0 * math.pi / k, STEEPEST * math.tanh(k * DEPTH)  # Miche 1944
        if self.wave_height > share * length:
            raise ValueError(
                f"Weather.wave_height must be at most {share * length:.3g} m for a period of {self.wave_period:g} s: a "
                f"wave {length:.3g} m long breaks beyond {share:.3g} of its length, got {self.wave_height!r} m"
            )

    @property
    def still(self) -> bool:
        """Whether nothing moves and the vehicle is the nominal one."""
        flat = self.wind == 0.0 and self.current == 0.0 and self.wave_height == 0.0
        return flat and self.extra is None and self.spread == Spread()


def _level(level: int, wind: float, current: float, height: float, period: float, error: float) -> Weather:
    """Return a level; `error` is that of mass and thrust, which a scale and a hover tell.

    Inertia comes from a drawing and drag from a guess: MarineGym trains with inertia within 20 % and drag down to half,
    which are the errors of level 5.
    """
    drag, steps = 0.1 * level, level - 1
    spread = Spread(
        mass=error,
        thrust=error,
        inertia=0.04 * level,
        drag=drag,
        # propellers from small to large: 5-72 ms in RotorPy, 25-80 in Aerial Gym; the vehicle's authors take 33
        rotor_lag_air=(0.005 + 0.00375 * steps, 0.015 + 0.00875 * steps),
        rotor_lag_water=(level / 150.0, level / 50.0),  # up to the authors' 33 ms and the 100 of a T200-like thruster
        rotor_drag=(ROTOR_DRAG * (1.0 - drag), ROTOR_DRAG * (1.0 + drag)),
        height=(0.135, 0.2),  # over which density changes in the authors' simulator
    )
    name = f"level {level}"
    return Weather(wind=wind, current=current, wave_height=height, wave_period=period, spread=spread, name=name)


LEVELS = (
    Weather(name="level 0"),
    _level(1, 1.0, 0.1, 0.05, 1.2, 0.01),
    _level(2, 2.0, 0.2, 0.1, 1.5, 0.02),
    _level(3, 3.0, 0.3, 0.2, 2.0, 0.04),
    _level(4, 5.0, 0.4, 0.3, 2.5, 0.07),
    _level(5, 8.0, 0.5, 0.5, 3.0, 0.1),
)


def named_weather(value: Any) -> Weather:
    """Return the weather of a level (0 to 5, or "0" to "5" as a command line has it), or the weather itself.

    Raises ValueError for another number or text and TypeError for anything else.
    """
    if isinstance(value, Weather):
        return value
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise TypeError(f"weather must be a level from 0 to {len(LEVELS) - 1} or a hydrone_gym.Weather, got {value!r}")
    levels = {key: weather for level, weather in enumerate(LEVELS) for key in (level, str(level))}
    if value not in levels:
        raise ValueError(f"weather must be a level from 0 to {len(LEVELS) - 1} or a Weather, got {value!r}")
    return levels[value]
