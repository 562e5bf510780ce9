"""The options of every environment of this package: named, documented and checked in one place.

A field of `Options` is an option: both environments take it as a keyword, refuse what is not listed here, and show it
in their documentation. Editors and type checkers see the fields as the keywords of the constructors, see `takes`.
"""

import dataclasses
import functools
import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
from gymnasium.vector import AutoresetMode

from hydrone_gym.simulation.simulation import ticks_in
from hydrone_gym.vehicle import Vehicle, named_vehicle
from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, ScenarioLaw, prepare
from hydrone_gym.world.world import World

MISSIONS = {"air_to_water": EXPERIMENT_1, "water_to_air": EXPERIMENT_2, "random": ScenarioLaw()}
INTERFACES = ("world", "egocentric")
MOST_OBSTACLES = 1000
MOST_ROWS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class Options:
    """What an environment is made with.

    - `mission`: "air_to_water", "water_to_air" or "random"; set by the id.
    - `num_obstacles` (20): number of spheres, at most 1000; at least as many as a given scenario has.
    - `obstacle_radius` ((0.5, 1.5)): least and greatest radius, m.
    - `sensor_range` (3.0): m.
    - `vehicle` ("paper"): "paper", "physical" or a `Vehicle`; a `Vehicle` once the options are made.
    - `period` (0.5): seconds a step, a multiple of 0.05.
    - `vertical_mode` (True): hold still laterally inside the transition zone.
    - `rough_transition` ("fail"): "fail" ends an episode at a rough crossing, "count" only notes it.
    - `time_limit` (120.0): s.
    - `interface` ("world"): the spaces of `HydroneEnv`; "egocentric": a flat (68,) observation and (3,) relative
      actions for learners, documented in `hydrone_gym.perception.egocentric`.
    - `render_mode` (None): "rgb_array" for pictures, "human" for a window; `hydrone_gym.rendering` describes them.
    - `render_size` ((640, 480)): width and height of pictures in pixels; `camera` ("overview"): or "chase".

    Raises TypeError for an unknown option and ValueError for a value out of range, naming the option and its rule.
    """

    mission: str = "random"
    num_obstacles: int = 20
    obstacle_radius: tuple[float, float] = (0.5, 1.5)
    sensor_range: float = 3.0
    vehicle: str | Vehicle = "paper"
    period: float = 0.5
    vertical_mode: bool = True
    rough_transition: str = "fail"
    time_limit: float = 120.0
    interface: str = "world"
    # How it is drawn makes no other environment: left out of comparisons, and checked where pictures are made.
    render_mode: str | None = field(default=None, compare=False)
    render_size: tuple[int, int] = field(default=(640, 480), compare=False)
    camera: str = field(default="overview", compare=False)

    def __post_init__(self) -> None:
        """Check every option, also that scenarios can be drawn with them."""
        vehicle = named_vehicle(self.vehicle)
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
        if law.num_obstacles > MOST_OBSTACLES:
            raise ValueError(
                f"num_obstacles must be at most {MOST_OBSTACLES}: every observation and the storage of every row hold "
                f"them all, got {law.num_obstacles}"
            )
        object.__setattr__(self, "vehicle", vehicle)
        object.__setattr__(self, "num_obstacles", int(law.num_obstacles))
        object.__setattr__(self, "obstacle_radius", law.obstacle_radius)
        prepare(law, self.world, vehicle.radius)

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

    def differences(self, other: "Options") -> list[str]:
        """Return the names of the options, but for those of pictures, in which another environment differs."""
        return [f.name for f in fields(Options) if f.compare and getattr(self, f.name) != getattr(other, f.name)]


@dataclass(frozen=True)
class VectorOptions(Options):
    """What `HydroneVectorEnv` is made with, besides all `Options`.

    - `num_envs` (1): number of rows, at most a million.
    - `autoreset_mode` ("NextStep"): or "SameStep", "Disabled", or a `gymnasium.vector.AutoresetMode`.
    - `threads` (1): threads to spread whole blocks of rows over; used from 512 rows on.
    - `max_episode_steps` (None): replaces `time_limit` if given, in periods.
    """

    num_envs: int = 1
    autoreset_mode: str | AutoresetMode = field(default=AutoresetMode.NEXT_STEP, kw_only=True)
    threads: int = field(default=1, kw_only=True)
    max_episode_steps: int | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Check every option and bring them to one form."""
        rows = _whole("num_envs", self.num_envs)
        if rows > MOST_ROWS:
            raise ValueError(f"num_envs must be at most {MOST_ROWS}: every row is stored whole, got {rows}")
        _whole("threads", self.threads)
        object.__setattr__(self, "autoreset_mode", AutoresetMode(self.autoreset_mode))
        super().__post_init__()
        if self.max_episode_steps is not None:
            steps = _whole("max_episode_steps", self.max_episode_steps)
            object.__setattr__(self, "time_limit", steps * self.period)

    @property
    def of_a_row(self) -> Options:
        """What each row is made with, as a single environment would be."""
        return Options(**{spec.name: getattr(self, spec.name) for spec in fields(Options)})


def known_options(kind: type[Options] = Options) -> tuple[str, ...]:
    """Names of the options every environment of this package takes, or those of another kind of options."""
    return tuple(spec.name for spec in fields(kind))


P = ParamSpec("P")
O = TypeVar("O", bound=Options)


def takes(kind: Callable[P, O]) -> Callable[[Callable[[Any, O], None]], Callable[Concatenate[Any, P], None]]:
    """Let a constructor that reads options be called with their fields as keywords.

    Its signature is that of the options, at run time and for type checkers alike. Called with anything else it raises
    a TypeError that lists what is known.
    """
    known = tuple(inspect.signature(kind).parameters.values())
    names = [parameter.name for parameter in known]

    def decorate(construct: Callable[[Any, O], None]) -> Callable[Concatenate[Any, P], None]:
        @functools.wraps(construct)
        def __init__(self: Any, /, *args: P.args, **keywords: P.kwargs) -> None:
            unknown = [name for name in keywords if name not in names]
            if unknown:
                raise TypeError(f"unknown option {', '.join(map(repr, unknown))}; known are {', '.join(names)}")
            construct(self, kind(*args, **keywords))

        own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
        __init__.__signature__ = inspect.Signature((own, *known))  # type: ignore[attr-defined]
        return __init__

    return decorate


def with_options(text: str | None, kind: type[Options]) -> str:
    """Return a class's documentation with the list of its options in the place of their name."""
    listed = inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[2]
    return inspect.cleandoc(text or "").replace(f"`{kind.__name__}` lists them.", listed)


def _one_of(name: str, value: Any, known: tuple[str, ...]) -> None:
    """Raise ValueError unless an option is one of the known strings."""
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, known))}, got {value!r}")


def _whole(name: str, value: Any) -> int:
    """Return a whole number of at least 1; raises ValueError naming it."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name} must be a whole number of at least 1, got {value!r}")
    return int(value)
