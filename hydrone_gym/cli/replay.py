"""The subcommand `hydrone replay`: a flight as a page that plays in a browser, or as MCAP."""

import json
import sys
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import tyro

from hydrone_gym.cli import refused
from hydrone_gym.cli.missions import MISSIONS, MissionOptions, title_of
from hydrone_gym.evaluation.flight import Flight, fly
from hydrone_gym.evaluation.plan import plan_of
from hydrone_gym.evaluation.policies import Policy, PolicySource, find_policy, known_policies
from hydrone_gym.evaluation.records import Record, record_of
from hydrone_gym.evaluation.run_folder import read_stored
from hydrone_gym.evaluation.saved import SavedFlight, read_flights, restore
from hydrone_gym.evaluation.shown import fly_record
from hydrone_gym.rendering.foxglove import load_mcap, write_mcap
from hydrone_gym.rendering.replay import load_viser, write_replay
from hydrone_gym.rendering.stage import Tree
from hydrone_gym.simulation.simulation import Simulation

RECORDERS = "hydrone_gym.recorders"  # entry points: "trees" wraps a policy and keeps its trees as `trees`
_ROW = ("policy", "suite", "mission", "world")  # options that name a row of an evaluation
_PAGES = {"saved", "out", "open", "json"}
_WRITERS = {".html": (load_viser, write_replay), ".mcap": (load_mcap, write_mcap)}  # by the suffix of a file


class Take(NamedTuple):
    """What one file shows."""

    name: str
    title: str
    flight: Flight
    simulation: Simulation
    trees: Sequence[Tree]


@dataclass(frozen=True, kw_only=True)
class Replay(MissionOptions):
    """Write a flight as a page that plays in a browser, offline, or for Foxglove.

    Of an evaluation, --mission, --policy and --world are those of its tables.
    """

    saved: tyro.conf.Positional[Path | None] = None
    """A flight.json of `hydrone fly`, or the folder of an evaluation; without it, a fresh flight."""
    flight: str | None = None  # Of a flight.json: only the flight of this name.
    suite: str | None = None  # Of an evaluation: the suite, if there are several.
    world: int | None = None  # Of an evaluation: the number of the world.
    out: Path = Path("replay.html")
    """File to write, .html or .mcap, or folder for a page; for several flights their names are appended."""
    open: bool = False  # Open the page in the browser.
    json: bool = False  # Print one JSON document instead of the names of the files.

    def run(self) -> int:
        """Fly, write the pages and return the exit code."""
        out = self.out if self.out.suffix in _WRITERS else self.out / "replay.html"
        if self.open and out.suffix != ".html":
            raise ValueError(f"--open shows pages, .html, not {out}")
        load, write = _WRITERS[out.suffix]
        load()
        takes, shown, files = self._takes(), [], []
        out.parent.mkdir(parents=True, exist_ok=True)
        for name, title, flight, simulation, trees in takes:
            file = out if len(takes) == 1 else out.with_name(f"{out.stem}-{name}{out.suffix}")
            try:
                write(flight, simulation, file, title=title, trees=trees)
            except OSError as error:  # a full disk, after the input was found good
                return refused(error, 1)
            facts = {"outcome": flight.outcome.name, "time": flight.time, "trees": sum(len(t.edges) > 0 for t in trees)}
            shown.append({"name": name, "title": title, "file": str(file), **facts})
            files.append(file)
        document = {"format": "hydrone_gym replays", "version": 1, "replays": shown}
        print(json.dumps(document, indent=1) if self.json else "\n".join(map(str, files)))
        for file in files if self.open else ():
            webbrowser.open(file.resolve().as_uri())
        return 0

    def _takes(self) -> list[Take]:
        """Fly what is asked for."""
        if self.saved is None:
            self._take_only({field.name for field in fields(MissionOptions)}, "a fresh flight")
            return self._fresh()
        if self.saved.is_dir():
            self._take_only(set(_ROW), "an evaluation")
            return [self._evaluated(self.saved)]
        self._take_only({"flight"}, "a saved flight")
        flights = read_flights(self.saved)
        chosen = [saved for saved in flights if self.flight in (None, saved.name)]
        if not chosen:
            names = ", ".join(saved.name for saved in flights)
            raise ValueError(f"--flight must be one of {names}, got {self.flight!r}")
        return [_restored(saved) for saved in chosen]

    def _take_only(self, names: set[str], source: str) -> None:
        """Raise ValueError if an option not among these, nor one of pages, has another value than its default."""
        others = [field for field in fields(self) if field.name not in names | _PAGES]
        given = sorted(field.name for field in others if getattr(self, field.name) != field.default)
        if given:
            listed = ", ".join("--" + name.replace("_", "-") for name in given)
            raise ValueError(f"{listed} cannot be used with {source}")

    def _fresh(self) -> list[Take]:
        """Fly the missions of the options."""
        takes = []
        for mission in self.prepare():
            recorder = tree_recorder(mission.policy)
            flight = fly(mission.env, recorder, seed=self.seed, scenario=mission.scenario)
            simulation = mission.env.get_wrapper_attr("simulation")
            takes.append(Take(mission.name, mission.title, flight, simulation, recorder.trees))
        return takes

    def _evaluated(self, folder: Path) -> Take:
        """Fly a row of an evaluation again."""
        stored = read_stored(folder)
        record, plan = self._row(stored.records), plan_of(stored.arguments)
        source = next(source for source in plan.policies if source.label == record.policy)
        recorders: list[Any] = []

        def recorded(env: gym.Env, seed: int) -> Any:
            recorders.append(tree_recorder(source.make(env, seed)))
            return recorders[-1]

        plan = replace(plan, policies=(PolicySource(label=source.label, factory=recorded),))
        flight, simulation = fly_record(record, plan)
        if not record.same_flight(record_of(record.key, flight)):
            print("hydrone: this flight differs from its row: code or clock led elsewhere", file=sys.stderr)
        name, title = f"{record.policy}-{record.mission}-{record.world}", f"{record.policy}: {record.place}"
        return Take(name, title, flight, simulation, recorders[-1].trees)

    def _row(self, records: Sequence[Record]) -> Record:
        """Return the one row that the options name; ValueError where none or several fit."""
        for name in _ROW:
            wanted, there = getattr(self, name), list(dict.fromkeys(getattr(record, name) for record in records))
            if wanted is None and len(there) == 1:
                continue
            if wanted not in there:
                known = ", ".join(map(str, there[:12])) + (", …" if len(there) > 12 else "")
                raise ValueError(f"--{name} must be one of {known}, got {wanted!r}")
            records = [record for record in records if getattr(record, name) == wanted]
        return records[0]


def _restored(saved: SavedFlight) -> Take:
    """Fly a saved flight again from its references, and its planner for the trees.

    There are none where the policy is not a registered one or flies otherwise now.
    """
    env = gym.make(
        MISSIONS["random"], num_obstacles=len(saved.scenario.obstacles), vehicle=saved.vehicle, weather=saved.weather
    )
    simulation = env.get_wrapper_attr("simulation")
    flight, trees = restore(saved, simulation), ()
    if saved.policy in known_policies():
        recorder = tree_recorder(find_policy(saved.policy).make(env, saved.seed))
        again = fly(env, recorder, seed=saved.seed, scenario=saved.scenario)
        if np.array_equal(again.states, saved.states):
            trees = recorder.trees
        else:
            print(f"hydrone: {saved.name}: shown without trees: {saved.policy} flies otherwise now", file=sys.stderr)
    return Take(saved.name, title_of(saved.name, saved.policy, saved.seed), flight, simulation, trees)


def tree_recorder(policy: Policy) -> Any:
    """Wrap a policy so that its trees are kept, as `trees`: by what a package has registered for it."""
    (recorder,) = entry_points(group=RECORDERS, name="trees")
    return recorder.load()(policy)
