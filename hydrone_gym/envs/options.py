"""The options of every environment of this package: named, documented and checked in one place.

A field of `Options` is an option: both environments take it as a keyword, refuse what is not listed here, and show it
in their documentation. Editors and type checkers see the fields as the keywords of the constructors, see `takes`.
"""

import functools
import inspect
import math
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
from gymnasium.vector import AutoresetMode

from hydrone_gym.control.laws import named_law
from hydrone_gym.simulation.simulation import ticks_in
from hydrone_gym.vehicle import Vehicle, named_vehicle
from hydrone_gym.weather import Spread, Weather, named_weather
from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, ScenarioLaw, prepare
from hydrone_gym.world.world import CROSSINGS, World

SCENARIO_LAWS = {"air_to_water": EXPERIMENT_1, "water_to_air": EXPERIMENT_2, "random": ScenarioLaw()}
INTERFACES = ("world", "egocentric")
MOST_OBSTACLES = 1000
MOST_ROWS = 1_000_000
P = ParamSpec("P")
T = TypeVar("T")


def _option(default: T, words: str, *, picture: bool = False) -> T:
    """One option and what it is; how pictures are drawn makes no other environment, so comparisons leave it out."""
    return field(default=default, compare=not picture, metadata={"words": words})


@dataclass(frozen=True, kw_only=True)
class Options:
    """What an environment is made with.

    `Options` lists them.

    Raises TypeError for an unknown option and ValueError for a value out of range, naming the option and its rule.
    """

    mission: str = _option("random", '"air_to_water", "water_to_air" or "random"; set by the id')
    num_obstacles: int = _option(20, "spheres, at most 1000; at least as many as a given scenario has")
    obstacle_radius: tuple[float, float] = _option((0.5, 1.5), "least and greatest radius, m")
    sensor_range: float = _option(3.0, "m")
    vehicle: str | Vehicle = _option(
        "paper", '"paper", "physical", "hydrone-2021", "hydrone-agile" or a `Vehicle`; kept as the latter'
    )
    weather: int | Weather = _option(
        0, "a level, 0 (still air, flat water) to 5, or a `Weather`; kept as the latter; a scenario may carry another"
    )
    vehicle_spread: float | Spread | None = _option(
        None,
        "how far the vehicle of an episode may be from `vehicle`, which its controller and planners believe in: a "
        "`Spread`, or a number for that share of mass, thrust, inertia and drag; None for that of the weather",
    )
    controller: str = _option("paper", "name of the control law, one of `hydrone_gym.control.laws`")
    period: float = _option(0.5, "seconds a step, a multiple of 0.05")
    vertical_mode: bool = _option(True, "hold still laterally inside the transition zone")
    crossing: str = _option(
        "vertical",
        '"vertical" is the paper\'s; "adaptive" moves laterally in the transition zone too and is as smooth at the '
        'surface, as with `vertical_mode=False`; "aggressive" may cross it at 1 m/s and 15 degrees of tilt',
    )
    rough_transition: str = _option("fail", '"fail" ends an episode at a rough crossing, "count" only notes it')
    time_limit: float = _option(120.0, "s")
    interface: str = _option(
        "world",
        '"world" has the spaces of `HydroneEnv`; "egocentric" a flat (68,) observation and (3,) relative actions for '
        "learners, documented in `hydrone_gym.perception.egocentric`",
    )
    render_mode: str | None = _option(
        None, '"rgb_array" for pictures, "human" for a window, as in `hydrone_gym.rendering`', picture=True
    )
    render_size: tuple[int, int] = _option((640, 480), "width and height of pictures in pixels", picture=True)
    camera: str = _option("overview", '"overview" or "chase"', picture=True)

    def __post_init__(self) -> None:
        """Check every option, also that scenarios can be drawn with them; pictures are checked where they are made."""
        vehicle = named_vehicle(self.vehicle)
        named_law(self.controller, "controller")
        known = {"mission": tuple(SCENARIO_LAWS), "interface": INTERFACES, "rough_transition": ("fail", "count")}
        known["crossing"] = tuple(CROSSINGS)
        for name, choices in known.items():
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, got {getattr(self, name)!r}")
        if not isinstance(self.vertical_mode, bool):
            raise ValueError(f"vertical_mode must be True or False, got {self.vertical_mode!r}")
        for name, unit in (("sensor_range", "m"), ("period", "s"), ("time_limit", "s")):
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not number or not math.isfinite(value) or value <= 0:
                raise ValueError(f"{name} must be a positive number ({unit}), got {value!r}")
        ticks_in(self.period)
        draws = self.draws
        if draws.num_obstacles > MOST_OBSTACLES:
            raise ValueError(
                f"num_obstacles must be at most {MOST_OBSTACLES}: every observation and the storage of every row hold "
                f"them all, got {draws.num_obstacles}"
            )
        object.__setattr__(self, "vehicle", vehicle)
        object.__setattr__(self, "weather", named_weather(self.weather))
        if self.vehicle_spread is not None:
            object.__setattr__(self, "vehicle_spread", Spread.of(self.vehicle_spread))
        object.__setattr__(self, "num_obstacles", int(draws.num_obstacles))
        object.__setattr__(self, "obstacle_radius", draws.obstacle_radius)
        prepare(draws, self.world, vehicle.radius)

    @property
    def world(self) -> World:
        """The world the environment flies in."""
        rules: dict[str, Any] = {"vertical_mode": self.vertical_mode, **CROSSINGS[self.crossing]}
        return World(sensor_range=float(self.sensor_range), rough_transition=self.rough_transition, **rules)

    @property
    def draws(self) -> ScenarioLaw:
        """What scenarios are drawn by at reset."""
        spheres: dict[str, Any] = {"num_obstacles": self.num_obstacles, "obstacle_radius": self.obstacle_radius}
        return replace(SCENARIO_LAWS[self.mission], **spheres)

    def spread_in(self, weather: Weather) -> Spread:
        """Return how far the vehicle of an episode in a weather may be from the nominal one."""
        return Spread.of(weather.spread if self.vehicle_spread is None else self.vehicle_spread)

    @property
    def weathered(self) -> bool:
        """Whether anything differs from the nominal vehicle in still air and flat water."""
        weather = replace(self.the_weather, spread=self.spread_in(self.the_weather))
        return not (weather.still and self.the_vehicle.ideal)

    @property
    def the_vehicle(self) -> Vehicle:
        """The nominal vehicle."""
        return named_vehicle(self.vehicle)

    @property
    def the_weather(self) -> Weather:
        """The weather."""
        return named_weather(self.weather)

    def differences(self, other: "Options") -> list[str]:
        """Return the names of the options, but for those of pictures, in which another environment differs."""
        return [f.name for f in fields(Options) if f.compare and getattr(self, f.name) != getattr(other, f.name)]


@dataclass(frozen=True, kw_only=True)
class VectorOptions(Options):
    """What `HydroneVectorEnv` is made with, besides all `Options`.

    `VectorOptions` lists them.
    """

    num_envs: int = field(default=1, kw_only=False, metadata={"words": "number of rows, at most a million"})
    autoreset_mode: str | AutoresetMode = _option(
        AutoresetMode.NEXT_STEP.value, '"NextStep", "SameStep", "Disabled" or a `gymnasium.vector.AutoresetMode`'
    )
    threads: int = _option(1, "threads to spread whole blocks of rows over; used from 512 rows on")
    max_episode_steps: int | None = _option(None, "replaces `time_limit` if given, in periods")

    def __post_init__(self) -> None:
        """Check every option and bring them to one form."""
        for name in ("num_envs", "threads", "max_episode_steps"):
            value = getattr(self, name)
            whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
            if not (whole and value >= 1) and not (name == "max_episode_steps" and value is None):
                raise ValueError(f"{name} must be a whole number of at least 1, got {value!r}")
        if self.num_envs > MOST_ROWS:
            raise ValueError(f"num_envs must be at most {MOST_ROWS}: every row is stored whole, got {self.num_envs}")
        object.__setattr__(self, "autoreset_mode", AutoresetMode(self.autoreset_mode))
        super().__post_init__()
        if self.max_episode_steps is not None:
            object.__setattr__(self, "time_limit", int(self.max_episode_steps) * self.period)

    @property
    def of_a_row(self) -> Options:
        """What each row is made with, as a single environment would be."""
        return Options(**{name: getattr(self, name) for name in known_options()})


def known_options(kind: type[Options] = Options) -> tuple[str, ...]:
    """Names of the options every environment of this package takes, or those of another kind of options."""
    return tuple(spec.name for spec in fields(kind))


def with_options(text: str | None, kind: type[Options]) -> str:
    """Return a class's documentation with the list of a kind's own options in the place of their name."""
    own = [spec for spec in fields(kind) if spec.name in kind.__annotations__]
    items = [f"- `{spec.name}` ({spec.default!r}): {spec.metadata['words']}." for spec in own]
    listed = "\n".join(textwrap.fill(item, 116, subsequent_indent="  ", break_on_hyphens=False) for item in items)
    return inspect.cleandoc(text or "").replace(f"`{kind.__name__}` lists them.", listed)


Options.__doc__ = with_options(Options.__doc__, Options)
VectorOptions.__doc__ = with_options(VectorOptions.__doc__, VectorOptions)


def takes(kind: Callable[P, T]) -> Callable[[Callable[[Any, T], None]], Callable[Concatenate[Any, P], None]]:
    """Let a constructor that reads options be called with their fields as keywords.

    Its signature is that of the options, at run time and for type checkers alike. Called with anything else it raises
    a TypeError that lists what is known.
    """
    known = inspect.signature(kind).parameters

    def decorate(construct: Callable[[Any, T], None]) -> Callable[Concatenate[Any, P], None]:
        @functools.wraps(construct)
        def __init__(self: Any, /, *args: P.args, **keywords: P.kwargs) -> None:
            unknown = [name for name in keywords if name not in known]
            if unknown:
                raise TypeError(f"unknown option {', '.join(map(repr, unknown))}; known are {', '.join(known)}")
            construct(self, kind(*args, **keywords))

        own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
        __init__.__signature__ = inspect.Signature((own, *known.values()))  # type: ignore[attr-defined]
        return __init__

    return decorate
