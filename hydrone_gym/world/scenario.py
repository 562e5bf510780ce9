"""A scenario: where a flight starts, where it should end, and the spheres in between; its rules and its JSON file."""

import json
import math
import sys
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from hydrone_gym.weather import Spread, Weather
from hydrone_gym.world.world import World

FORMAT = "hydrone_gym scenario"
VERSION = 1
WEATHER_VERSION = 2  # of a file that carries weather, so that no reader of version 1 flies it without


@dataclass(frozen=True, kw_only=True, eq=False)
class Scenario:
    """One mission in a world of spheres; equal by value and hashable.

    Raises ValueError for a wrong shape or what is no number; `validate` knows the rules of a world.
    """

    start: tuple[float, float, float, float]  #: x, y, z in m and yaw in rad, where the vehicle starts at rest
    goal: tuple[float, float, float]  #: x, y, z in m
    obstacles: np.ndarray  #: (M, 4) read-only float64, a sphere [x, y, z, r] in m a row; any nested sequence is copied
    name: str = ""  #: what to call it in tables; counts as part of the value
    weather: Weather | None = None  #: that of the environment if None

    def __post_init__(self) -> None:
        """Bring every field to its one form: tuples of float, and an own read-only array."""
        for name, length, unit in (("start", 4, "x, y, z in m and yaw in rad"), ("goal", 3, "x, y, z in m")):
            try:
                numbers = tuple(map(float, getattr(self, name)))
            except (TypeError, ValueError):
                numbers = ()
            if len(numbers) != length:
                given = getattr(self, name)
                raise ValueError(f"Scenario.{name} must hold {length} numbers ({unit}), got {given!r}")
            object.__setattr__(self, name, numbers)
        try:
            obstacles = np.array(self.obstacles, dtype=np.float64, order="C")
        except (TypeError, ValueError) as error:
            raise ValueError(f"Scenario.obstacles must hold four numbers (m) a row: {error}") from None
        if obstacles.size == 0:
            obstacles = obstacles.reshape(0, 4)
        if obstacles.ndim != 2 or obstacles.shape[1] != 4:
            raise ValueError(f"Scenario.obstacles must have shape (M, 4) (m), got {obstacles.shape}")
        obstacles.flags.writeable = False
        object.__setattr__(self, "obstacles", obstacles)
        if not isinstance(self.name, str):
            raise ValueError(f"Scenario.name must be a string, got {self.name!r}")
        if self.weather is not None and not isinstance(self.weather, Weather):
            raise ValueError(f"Scenario.weather must be a Weather or None, got {self.weather!r}")

    @property
    def media(self) -> tuple[str, str]:
        """Medium of the start and of the goal, "air" or "water"."""
        return "water" if self.start[2] < 0.0 else "air", "water" if self.goal[2] < 0.0 else "air"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scenario):
            return NotImplemented
        own = self.start, self.goal, self.name, self.weather
        return own == (other.start, other.goal, other.name, other.weather) and np.array_equal(
            self.obstacles, other.obstacles
        )

    def __hash__(self) -> int:
        return hash((self.start, self.goal, self.name, self.weather, len(self.obstacles)))

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore after pickling or copying, which forget that the array is read-only."""
        self.__dict__.update(state)
        self.obstacles.flags.writeable = False


def check_end(name: str, position: tuple[float, ...], world: World) -> None:
    """Raise ValueError unless a start or goal (x, y, z in m) lies inside the box and outside the transition zone."""
    for axis, value, low, high in zip("xyz", position, world.lower, world.upper, strict=True):
        if not low < value < high:  # NaN too
            raise ValueError(f"{name} {axis} must lie inside the box, between {low!r} and {high!r} m, got {value!r} m")
    if abs(position[2]) <= world.zone:
        raise ValueError(f"{name} z must lie outside the transition zone of +-{world.zone!r} m, got {position[2]!r} m")


def check_radius(vehicle_radius: float) -> None:
    """Raise ValueError unless the vehicle's radius (m) is finite and positive."""
    if not (math.isfinite(vehicle_radius) and vehicle_radius > 0.0):
        raise ValueError(f"vehicle radius must be positive (m), got {vehicle_radius!r}")


def validate(scenario: Scenario, world: World, vehicle_radius: float) -> None:
    """Raise ValueError unless a vehicle of this radius (m) can start in the scenario and rest at its goal.

    Ends lie in the box, outside the transition zone and clear of every sphere; numbers are finite, radii positive.
    """
    check_radius(vehicle_radius)
    check_end("start", scenario.start[:3], world)
    check_end("goal", scenario.goal, world)
    if not math.isfinite(scenario.start[3]):
        raise ValueError(f"start yaw must be finite (rad), got {scenario.start[3]!r}")
    obstacles = scenario.obstacles
    for index in np.flatnonzero(~np.isfinite(obstacles).all(axis=1)):
        raise ValueError(f"obstacle {index} must have finite numbers (m), got {obstacles[index].tolist()!r}")
    for index in np.flatnonzero(obstacles[:, 3] <= 0.0):
        raise ValueError(f"obstacle {index} must have a positive radius (m), got {obstacles[index, 3].item()!r}")
    for name, position in (("start", scenario.start[:3]), ("goal", scenario.goal)):
        clearance = np.linalg.norm(obstacles[:, :3] - position, axis=1) - obstacles[:, 3] - vehicle_radius
        for index in np.flatnonzero(clearance <= 0.0):
            raise ValueError(
                f"{name} must keep more than the vehicle's radius of {vehicle_radius!r} m to the surface of "
                f"obstacle {index}, got a clearance of {clearance[index]:.3g} m"
            )


def save_scenario(scenario: Scenario, path: str | Path) -> None:
    """Write a scenario to a JSON file; every float is restored bit for bit by `load_scenario`.

    Raises ValueError naming the path for a number that is not finite or a disturbance in its weather, and OSError when
    the file cannot be written.
    """
    content = {"format": FORMAT, "version": VERSION, **vars(scenario), "obstacles": scenario.obstacles.tolist()}
    del content["weather"]
    if scenario.weather is not None:
        if scenario.weather.extra is not None:
            raise ValueError(f"{path}: a scenario file cannot hold the disturbance {scenario.weather.extra!r}")
        content |= {"version": WEATHER_VERSION, "weather": asdict(scenario.weather)}
    try:
        text = json.dumps(content, indent=1, allow_nan=False)
    except ValueError:
        raise ValueError(f"{path}: a scenario with numbers that are not finite cannot be saved") from None
    Path(path).write_text(text + "\n", encoding="utf-8")


def load_scenario(path: str | Path) -> Scenario:
    """Read a scenario that `save_scenario` wrote.

    Raises ValueError naming the path and the problem for anything else, and OSError when the file cannot be read.
    """
    try:
        return _parse(Path(path).read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from None


def _parse(text: str) -> Scenario:
    """Turn the text of a scenario file into a scenario; ValueError says what is wrong."""
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ValueError(f"not complete JSON: {error}") from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f'not a scenario file: "format" must be "{FORMAT}"')
    if content.get("version") not in (VERSION, WEATHER_VERSION):
        raise ValueError(f'"version" must be {VERSION} or {WEATHER_VERSION}, got {content.get("version")!r}')
    known = {"format", "version", *(spec.name for spec in fields(Scenario))}
    if content["version"] == VERSION:  # it leaves weather to the environment
        known.remove("weather")
    for problem, keys in (("missing", known - content.keys()), ("unknown", content.keys() - known)):
        if keys:
            raise ValueError(f"{problem} key {', '.join(map(repr, sorted(keys)))}")
    if not isinstance(content["obstacles"], list):
        raise ValueError(f"obstacles must be a list, got {content['obstacles']!r}")
    rows = [("start", content["start"], 4), ("goal", content["goal"], 3)]
    for name, row, length in rows + [(f"obstacle {k}", row, 4) for k, row in enumerate(content["obstacles"])]:
        numbers = isinstance(row, list) and len(row) == length and all(type(entry) in (int, float) for entry in row)
        # Comparing, unlike math.isfinite, also copes with an integer too large for a float.
        if not numbers or not all(abs(entry) <= sys.float_info.max for entry in row):
            raise ValueError(f"{name} must be a list of {length} finite numbers, got {row!r}")
    given = {key: content[key] for key in known - {"format", "version"}}
    if "weather" in given:
        given["weather"] = weather_of(given["weather"])
    return Scenario(**given)


def weather_of(content: Any) -> Weather:
    """Rebuild a weather from what `dataclasses.asdict` made of it; ValueError says what is wrong."""
    if not isinstance(content, dict) or not isinstance(content.get("spread"), dict):
        raise ValueError(f'"weather" must be an object with a "spread", got {content!r}')
    for kind, entries in ((Weather, content), (Spread, content["spread"])):
        if unknown := entries.keys() - {spec.name for spec in fields(kind)}:
            raise ValueError(f"weather: unknown key {', '.join(map(repr, sorted(unknown)))}")
    return Weather(**{**content, "spread": Spread(**content["spread"])})
