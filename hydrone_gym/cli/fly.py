"""The subcommand `hydrone fly`: the paper's experiments, a table and figures."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from hydrone_gym.cli.missions import MissionOptions, Prepared
from hydrone_gym.evaluation.flight import Flight, fly
from hydrone_gym.evaluation.flight_figures import draw_flight
from hydrone_gym.evaluation.saved import FORMAT, VERSION, flight_record
from hydrone_gym.evaluation.tables import Table, print_tables
from hydrone_gym.rendering.files import Width, drawn_width, inches, save_figure

_TREE_ITERATIONS = 400  # samples of the tree figure


@dataclass(frozen=True, kw_only=True)
class Fly(MissionOptions):
    """Fly the paper's experiments, print what happened and draw the figures."""

    out: Path = Path("flights")  # Folder for figures and flight.json; made if missing.
    json: bool = False  # Print one JSON document instead of the table.
    no_figures: bool = False  # Draw no figures.
    width: Width | None = None
    """Width of the figures on paper: inches, or column (3.5) or text (7.16); unless given, as large as on a screen."""
    no_title: bool = False  # Leave the titles out of the figures.

    def run(self) -> int:
        """Fly, report and return the exit code."""
        width = inches(self.width)
        missions = self.prepare()
        self.out.mkdir(parents=True, exist_ok=True)
        records = []
        with tqdm(missions, unit="flight", disable=None) as bar:
            for mission in bar:
                bar.set_description(f"{mission.name}: flying")
                mission.policy.predict(mission.observation)  # loads the kernels: no cycle's time shall hold that
                flight = fly(mission.env, mission.policy, seed=self.seed, scenario=mission.scenario)
                bar.set_description(f"{mission.name}: drawing")
                figures = (
                    []
                    if self.no_figures
                    else [str(file) for file in _draw(mission, flight, self.out, width=width, titled=not self.no_title)]
                )
                records.append({"name": mission.name, **flight_record(flight), "figures": figures})
        options = {"policy": self.policy, "seed": self.seed, "vehicle": self.vehicle}
        document = {"format": FORMAT, "version": VERSION, **options, "flights": records}
        text, saved = json.dumps(document, indent=1, allow_nan=False), self.out / "flight.json"
        saved.write_text(text + "\n", encoding="utf-8")
        if self.json:
            print(text)
        else:
            heads, columns = ("", *(record["name"] for record in records)), [_cells(record) for record in records]
            print_tables([Table("", heads, tuple(zip(columns[0], *(column.values() for column in columns))))])
            print(*(path for record in records for path in record["figures"]), saved, sep="\n")
        return 0 if all(record["success"] for record in records) else 1


def _draw(mission: Prepared, flight: Flight, folder: Path, *, width: float | None, titled: bool) -> list[Path]:
    """Write the figures of a mission and return their paths.

    Of a planner with `grow_tree` also the tree that it grows from the start, every obstacle known (paper, Fig. 5).
    """
    files = draw_flight(
        flight, mission.env.get_wrapper_attr("simulation"), folder, mission.name, width=width, titled=titled
    )
    grow_tree = getattr(mission.policy, "grow_tree", None)
    if grow_tree is None:
        return files
    from hydrone_gym.rendering.figures import WIDTH, plot_tree

    tree = grow_tree({**mission.observation, "obstacles": mission.scenario.obstacles}, _TREE_ITERATIONS)
    title = f"{mission.name.replace('-', ' ').capitalize()}: tree of {len(tree.edges)} edges, every obstacle known"
    figure = plot_tree(
        tree, mission.scenario, mission.env.get_wrapper_attr("world"), title=title, width=drawn_width(width, WIDTH)
    )
    return files + save_figure(figure, folder / f"{mission.name}-tree", width=width, titled=titled)


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
