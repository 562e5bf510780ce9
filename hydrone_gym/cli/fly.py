"""The subcommand `hydrone fly`: the paper's experiments, a table and figures."""

import json
import math
import re
import textwrap
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from tqdm import tqdm

from hydrone_gym._folder_lock import held
from hydrone_gym._whole_file import whole
from hydrone_gym.cli import refused
from hydrone_gym.cli.missions import MissionOptions, Prepared
from hydrone_gym.evaluation.flight import Flight, fly
from hydrone_gym.evaluation.flight_figures import draw_flight
from hydrone_gym.evaluation.saved import FORMAT, VERSION, flight_record, plain, read_flights
from hydrone_gym.evaluation.tables import Table, print_tables
from hydrone_gym.rendering.files import Width, drawn_width, inches, save_figure

SAVED = "flight.json"  # in the folder of a run
_TREE_ITERATIONS = 400  # samples of the tree figure


@dataclass(frozen=True, kw_only=True)
class Fly(MissionOptions):
    """Fly the paper's experiments, print what happened and draw the figures."""

    # Folder for figures and flight.json, flights/MISSION-POLICY-seed-SEED unless given; made if missing.
    out: Path | None = None
    json: bool = False  # Print one JSON document instead of the table.
    no_figures: bool = False  # Draw no figures.
    width: Width | None = None
    """Width of the figures on paper: inches, or column (3.5) or text (7.16); unless given, as large as on a screen."""
    no_title: bool = False  # Leave the titles out of the figures.

    def run(self) -> int:
        """Fly, report and return the exit code."""
        inches(self.width)  # raises before anything is flown
        missions, folder = self.prepare(), self._folder()
        with held(folder):
            self._check(folder)
            try:
                return self._fly(missions, folder)
            except OSError as error:  # a full disk, after the input was found good
                return refused(error, 1)

    def _fly(self, missions: list[Prepared], folder: Path) -> int:
        """Fly missions, write and show what came of it, and return the exit code."""
        records = []
        with tqdm(missions, unit="flight", disable=None, ncols=80) as bar:
            for mission in bar:
                bar.set_description(f"{mission.name}: flying")
                mission.policy.predict(mission.observation)  # loads the kernels: no cycle's time shall hold that
                flight = fly(mission.env, mission.policy, seed=self.seed, scenario=mission.scenario)
                bar.set_description(f"{mission.name}: drawing")
                stem = folder / f"{mission.name}-{self._flyer()}"
                figures = [] if self.no_figures else [str(file) for file in self._draw(mission, flight, stem)]
                records.append({"name": mission.name, **flight_record(flight), "figures": figures})
        document = {"format": FORMAT, "version": VERSION, **self._options(), "flights": records}
        text = json.dumps(document, indent=1, allow_nan=False)
        with whole(folder / SAVED) as part:
            part.write_text(text + "\n", encoding="utf-8")
        if self.json:
            print(text)
        else:
            heads = ("", *("\n".join(textwrap.wrap(record["name"], 40)) for record in records))
            columns = [_cells(record) for record in records]
            print_tables([Table("", heads, tuple(zip(columns[0], *(column.values() for column in columns))))])
            print(*(path for record in records for path in record["figures"]), folder / SAVED, sep="\n")
        return 0 if all(record["success"] for record in records) else 1

    def _flyer(self) -> str:
        """Return policy and seed as a part of a file's name."""
        policy = re.sub(r"[^\w.+=-]+", "-", self.policy).strip("-")
        return f"{policy[-80:]}-seed-{self.seed}"

    def _folder(self) -> Path:
        """Return the folder of this run."""
        if self.out is not None:
            return self.out
        name = self.scenario.stem if self.scenario else "-".join(() if self.mission is None else self._missions())
        return Path("flights") / f"{name}-{self._flyer()}".lstrip("-")

    def _options(self) -> dict[str, Any]:
        """Return what the flights depend on, as plain data."""
        return plain({field.name: getattr(self, field.name) for field in fields(MissionOptions)}) | {
            "mission": None if self.mission is None else self._missions()[0],
            "scenario": None if self.scenario is None else str(self.scenario),
        }

    def _check(self, folder: Path) -> None:
        """Raise ValueError for a folder that holds another run: figures of both would lie side by side."""
        if not (folder / SAVED).exists():
            return
        read_flights(folder / SAVED)
        before, now = json.loads((folder / SAVED).read_bytes()), self._options()
        changes = [f"{key} was {before.get(key)}, is {now[key]}" for key in now if before.get(key) != now[key]]
        if changes:
            raise ValueError(f"{folder}: holds another run ({'; '.join(changes)}): choose another folder with --out")

    def _draw(self, mission: Prepared, flight: Flight, stem: Path) -> list[Path]:
        """Write the figures of a mission, whose names begin with `stem`, and return their paths.

        Of a planner with `grow_tree` also the tree that it grows from the start, every obstacle known (paper, Fig. 5).
        """
        simulation, width, titled = mission.env.get_wrapper_attr("simulation"), inches(self.width), not self.no_title
        files = draw_flight(flight, simulation, stem.parent, stem.name, title=mission.title, width=width, titled=titled)
        grow_tree = getattr(mission.policy, "grow_tree", None)
        if grow_tree is None:
            return files
        from hydrone_gym.rendering.figures import WIDTH, plot_tree

        tree = grow_tree({**mission.observation, "obstacles": mission.scenario.obstacles}, _TREE_ITERATIONS)
        title = f"{mission.title}: tree of {len(tree.edges)} edges, every obstacle known"
        figure = plot_tree(tree, mission.scenario, simulation.world, title=title, width=drawn_width(width, WIDTH))
        return files + save_figure(figure, Path(f"{stem}-tree"), width=width, titled=titled)


def _cells(record: dict[str, Any]) -> dict[str, str]:
    """Format what the table shows of one flight, label to text."""

    def each(key: str, scale: float, digits: int) -> str:
        return ", ".join(f"{scale * crossing[key]:.{digits}f}" for crossing in record["transitions"]) or "-"

    return {
        "outcome": record["outcome"],
        "time (s)": f"{record['time']:.2f}",
        "crossing at (s)": each("time", 1.0, 2),
        "lateral speed at crossing (m/s)": each("lateral_speed", 1.0, 3),
        "tilt at crossing (°)": each("tilt", 180.0 / math.pi, 2),
        "least clearance (m)": "-" if record["clearance"] is None else f"{record['clearance']:.2f}",
        "length (m)": f"{record['length']:.1f}",
        "energy (J)": f"{record['energy']:.0f}",
        "planning p50 (ms)": f"{record['planning_ms']['p50']:.2f}",
        "planning p99 (ms)": f"{record['planning_ms']['p99']:.2f}",
    }
