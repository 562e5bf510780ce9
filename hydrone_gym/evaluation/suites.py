"""Scenario suites: the worlds that policies are compared on, frozen by name and version or made by the user."""

import hashlib
import json
import os
import re
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from hydrone_gym.weather.weather import LEVELS
from hydrone_gym.world.scenario import Scenario, load_scenario

FOLDER = Path(__file__).parent / "suite_data"
# Stored worlds do not follow the random stream of a later NumPy; a change of the worlds is a new version.
SHA256 = {
    "paper-20-v1": "2cd1f0d8df8f4fcc51b81c98ffbb4d39a98977b2fb5725a5020be7a4e7d74b46",
    "dense-40-v1": "7f6ce81f26cf1542651a6e6c86c0d491c85422224666cb9af810efe7c078289a",
    "missions-v1": "72fe7b6e597693931841108dfa61107687b3401fb704cacccc65670575a7acc9",
    "density-v1": "bb01d4f06de6be8501bb4fc11780bb3f9095c7656e5854dd7d5cd5c024b35238",
    "weather-v1": "9648190c661d00b8bb370674cef3e166951be698c861cb904c9cdc5a18896b75",  # the worlds of every level
}
DEFAULT_SUITES = ("paper-20", "weather-2")
HELD_OUT = 10_000_000  # seeds from here on are for evaluation; training uses those below
MISSIONS = ("HydroneGym/Mission-v0", "HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")
_HELD_OUT = re.compile(r"held-out(?:-obstacles-(\d{1,3}))?(?:-radii-(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?))?")
_WEATHER = re.compile(r"weather(-v\d+)?")
_LEVEL = re.compile(rf"weather-([0-{len(LEVELS) - 1}])(-v\d+)?")
_PARTS = ("start", "goal", "obstacles")


@dataclass(frozen=True, kw_only=True)
class Mission:
    """Scenarios of one kind and the environment they are flown in; ValueError for none, or an option not its own."""

    name: str  #: what tables call it
    env_id: str  #: registered id of the environment
    options: Mapping[str, Any]  #: of that environment, plain data, without "vehicle" and "interface"
    scenarios: tuple[Scenario, ...]  #: the worlds; world k of the mission is entry k

    def __post_init__(self) -> None:
        """Check what would fail later, far from its cause."""
        if not self.scenarios:
            raise ValueError(f"mission {self.name!r} must have at least one scenario")
        taken = sorted({"vehicle", "interface", "render_mode"} & self.options.keys())
        if taken:
            raise ValueError(f"mission {self.name!r} must leave option {', '.join(taken)} to the evaluation")


@dataclass(frozen=True, kw_only=True)
class Suite:
    """Missions under one name; ValueError for none, or two of one name."""

    name: str  #: what tables call it, for a frozen suite with its version
    missions: tuple[Mission, ...]  #: each with a name of its own
    batch: bool = False  #: whether its worlds are flown many at once

    def __post_init__(self) -> None:
        """Check that rows can tell the missions apart."""
        names = [mission.name for mission in self.missions]
        if not names or len(set(names)) < len(names):
            raise ValueError(f"suite {self.name!r} must have missions with different names, got {names}")

    @classmethod
    def drawn(
        cls, env_id: str, seeds: Iterable[int], options: Mapping[str, Any] | None = None, *, name: str = "drawn"
    ) -> Self:
        """Return a suite of one mission, called by its environment's id: the worlds that it draws from these seeds.

        Training uses seeds below `HELD_OUT`; `options` are keyword options of the environment.
        """
        import gymnasium as gym

        env, scenarios = gym.make(env_id, disable_env_checker=True, **(options or {})), []
        for seed in seeds:
            env.reset(seed=seed)
            scenarios.append(env.get_wrapper_attr("scenario"))
        env.close()
        mission = Mission(name=env_id, env_id=env_id, options=dict(options or {}), scenarios=tuple(scenarios))
        return cls(name=name, missions=(mission,))

    @classmethod
    def held_out(cls, worlds: int, options: Mapping[str, Any] | None = None, *, name: str = "held-out") -> Self:
        """Return the worlds that every mission draws from the seeds from `HELD_OUT` on, to be flown in batches."""
        if worlds < 1:
            raise ValueError(f"worlds must be a whole number of at least 1, got {worlds}")
        seeds = range(HELD_OUT, HELD_OUT + worlds)
        drawn = (cls.drawn(env_id, seeds, options) for env_id in MISSIONS)
        return cls(name=name, missions=tuple(mission for suite in drawn for mission in suite.missions), batch=True)

    def first(self, worlds: int) -> Self:
        """Return the suite with the first so many worlds of each mission, or all where there are fewer."""
        return replace(self, missions=tuple(replace(m, scenarios=m.scenarios[:worlds]) for m in self.missions))

    def fingerprint(self) -> str:
        """Return a hash of what is flown: missions, options, every number of every scenario, and their weather."""
        digest = hashlib.sha256()
        for mission in self.missions:
            described = [mission.name, mission.env_id, dict(mission.options)]
            digest.update(json.dumps(described, sort_keys=True, default=repr).encode())
            for scenario in mission.scenarios:
                digest.update(np.array([*scenario.start, *scenario.goal]).tobytes() + scenario.obstacles.tobytes())
                digest.update(b"" if scenario.weather is None else repr(scenario.weather).encode())
        return digest.hexdigest()[:16]


def frozen_suites() -> list[str]:
    """Return the names of the suites in the package, with their versions."""
    return sorted(name for frozen in SHA256 for name in _stands_for(frozen))


def _stands_for(name: str) -> list[str]:
    """Return the names of suites that a name stands for: itself, or those of all levels of weather."""
    weather = _WEATHER.fullmatch(name)
    return [f"weather-{level}{weather[1] or ''}" for level in range(len(LEVELS))] if weather else [name]


def level_of(name: str) -> int | None:
    """Return the level of weather that a frozen suite is flown at; None for any other suite."""
    level = _LEVEL.fullmatch(name)
    return int(level[1]) if level else None


def in_short(names: Sequence[str]) -> list[str]:
    """Return names of suites with those of all levels of weather in one, as it was asked for."""
    short = list(names)
    for frozen in filter(_WEATHER.fullmatch, SHA256):
        if set(levels := _stands_for(frozen)) <= set(short):
            short[short.index(levels[0])] = frozen
            short = [name for name in short if name not in levels]
    return short


def load_suites(name_or_path: str | os.PathLike[str], worlds: int | None = None) -> list[Suite]:
    """Return what `load_suite` does, or for "weather" its suites of all levels."""
    return [load_suite(name, worlds) for name in _stands_for(os.fspath(name_or_path))]


def load_suite(name_or_path: str | os.PathLike[str], worlds: int | None = None) -> Suite:
    """Return a frozen suite, worlds held out from training, or a suite of your own from a file or a folder.

    Args:
        name_or_path: "paper-20" for its newest version, "paper-20-v1" for that one; "weather-0" to "weather-5";
            "held-out", also with options of its worlds as in "held-out-obstacles-40-radii-0.8-1.8"; the path of a file
            that `save_suite` wrote; or a folder of scenario files, one mission, or of such folders, a mission each.
        worlds: so many of each mission are drawn of those held out, 1,000 unless given.

    Raises:
        FileNotFoundError: none of these; the message lists the frozen suites.
        ValueError: a damaged file, a folder without scenarios, or "weather", which stands for several suites.
    """
    name, path = os.fspath(name_or_path), Path(name_or_path)
    if len(levels := _stands_for(name)) > 1:
        raise ValueError(f"{name} stands for {len(levels)} suites, {levels[0]} to {levels[-1]}: give one of them")
    level = _LEVEL.fullmatch(name)
    if versions := _versions(f"weather{level[2] or ''}" if level else name):
        suite = _read_frozen(max(versions, key=lambda frozen: int(frozen.rpartition("-v")[2])))
        return _at_level(suite, int(level[1])) if level else suite
    if held_out := _HELD_OUT.fullmatch(name):
        count, low, high = held_out.groups()
        options: dict[str, Any] = {} if count is None else {"num_obstacles": int(count)}
        options |= {} if low is None else {"obstacle_radius": (float(low), float(high))}
        return Suite.held_out(1000 if worlds is None else worlds, options, name=name)
    if not name or not path.exists():
        frozen = ", ".join(frozen_suites())
        raise FileNotFoundError(f"no suite {name!r}: frozen are {frozen}; or give held-out, a file or a folder")
    return _from_folder(path) if path.is_dir() else _read(path)


def _versions(name: str) -> list[str]:
    return [frozen for frozen in SHA256 if name in (frozen, frozen.rpartition("-v")[0])]


def _read_frozen(name: str) -> Suite:
    """Read a file of the package, which must be what it was."""
    path = FOLDER / f"{name}.npz"
    found = hashlib.sha256(path.read_bytes()).hexdigest()
    if found != SHA256[name]:
        raise ValueError(f"{path}: the frozen suite is damaged, its SHA-256 is {found}, not {SHA256[name]}")
    return _read(path)


def _at_level(suite: Suite, level: int) -> Suite:
    """Return the suite of a level: the worlds of all levels in its weather."""
    missions = tuple(replace(m, options={**m.options, "weather": level}) for m in suite.missions)
    return replace(suite, name=suite.name.replace("weather", f"weather-{level}"), missions=missions)


def _from_folder(folder: Path) -> Suite:
    """Read the scenario files of a folder and of the folders in it, in the order of their names."""
    missions = []
    for place in [folder, *sorted(entry for entry in folder.iterdir() if entry.is_dir())]:
        scenarios = tuple(load_scenario(file) for file in sorted(place.glob("*.json")))
        if scenarios:
            options = {"num_obstacles": max(len(scenario.obstacles) for scenario in scenarios)}
            name = place.resolve().name
            missions.append(Mission(name=name, env_id="HydroneGym/Mission-v0", options=options, scenarios=scenarios))
    if not missions:
        raise ValueError(f"{folder}: no scenario files (*.json), neither here nor one folder down")
    return Suite(name=folder.resolve().name, missions=tuple(missions))


def save_suite(suite: Suite, path: str | os.PathLike[str]) -> None:
    """Write a suite to an NPZ file that `load_suite` reads; every float is restored bit for bit, nothing is pickled.

    Raises ValueError where scenarios of one mission have different numbers of spheres, or weather of their own, and
    OSError if writing fails.
    """
    arrays: dict[str, Any] = {}
    for mission in suite.missions:
        if len({len(scenario.obstacles) for scenario in mission.scenarios}) > 1:
            raise ValueError(f"scenarios of mission {mission.name!r} must have equally many spheres to be saved")
        if any(scenario.weather is not None for scenario in mission.scenarios):
            raise ValueError(f"scenarios of mission {mission.name!r} must leave weather to its options to be saved")
        for part in _PARTS:
            arrays[f"{mission.name}/{part}"] = np.array([getattr(scenario, part) for scenario in mission.scenarios])
    described = [{"name": m.name, "env_id": m.env_id, "options": dict(m.options)} for m in suite.missions]
    arrays["suite"] = np.array(json.dumps({"name": suite.name, "missions": described}))
    with open(path, "wb") as stream:
        np.savez(stream, **arrays)


def _read(path: Path) -> Suite:
    """Read a file that `save_suite` wrote."""
    try:
        with np.load(path, allow_pickle=False) as arrays:
            content = json.loads(str(arrays["suite"]))
            missions = []
            for described in content["missions"]:
                columns = (arrays[f"{described['name']}/{part}"] for part in _PARTS)
                scenarios = (Scenario(start=s, goal=g, obstacles=o) for s, g, o in zip(*columns, strict=True))
                missions.append(Mission(**described, scenarios=tuple(scenarios)))
            return Suite(name=content["name"], missions=tuple(missions))
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{path}: not a suite file: {error}") from None
