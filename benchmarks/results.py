"""Write what the benchmarks last measured: benchmarks/RESULTS.md, figures, and tables in two pages of docs/.

python -m benchmarks.results
"""

import json
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from benchmarks import generalisation_table, tables, training_seeds
from benchmarks.peers import run as peers
from benchmarks.timing import RESULTS, ROOT
from hydrone_gym.rendering.style import BLACK, BLUE, DOTS_PER_INCH, FONTS, PURPLE, RED, WATER

ORDER = (
    "environments",
    "peers",
    "c_reference",
    "edges",
    "learning",
    "threads",
    "neighbour",
    "memory",
    "start",
    "rendering",
    "versions",
    "training_seeds",
    "generalisation",
)
HEAD = """# Measured speed

Written by `python -m benchmarks.results` from `benchmarks/results/*.json`; each table names the command that measures
it again. Rates are per CPU second on one core unless a table says otherwise, medians of turns taken alternately, after
a warm-up, so that compared figures come from the same minute of the same machine. One environment step is 0.5 s of
flight: 50 substeps of control and dynamics, collision and sensing every 50 ms against 20 spheres, observation, reward.
The last four tables are about agents: [how much the seed of a training matters](../docs/training.md), and
[how policies fare in worlds of another shape](../docs/generalisation.md).
"""


def load() -> dict[str, dict[str, Any]]:
    """Measurements by name, as far as they exist."""
    paths = {name: RESULTS / f"{name}.json" for name in ORDER}
    return {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.exists()}


def sheets_of(name: str, measured: dict[str, Any]) -> list[tables.Sheet]:
    """The tables of a measurement."""
    if name == "generalisation":
        return [generalisation_table.success_sheet(measured), generalisation_table.failure_sheet(measured)]
    if name == "training_seeds":
        return training_seeds.sheets(measured)
    return [peers.sheet(measured) if name == "peers" else tables.BUILDERS[name](measured)]


def describe(record: dict[str, Any]) -> str:
    """Machine, versions, commit and date in one line."""
    machine = record["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    load_words = f", load {machine['load'][0]}" if machine["load"] else ""
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}{load_words}; {versions}; "
        f"commit {machine['commit']}; {machine['date']}"
    )


def origin_of(record: dict[str, Any]) -> str:
    """Where a measurement comes from, in two lines of Markdown."""
    return f"`{record['command']}`  \n{describe(record)}\n"


def write_page(records: dict[str, dict[str, Any]], path: Path) -> None:
    """One section a measurement."""
    parts = [HEAD, "![Physics substeps a CPU second](../docs/images/throughput.png)\n"]
    for name, record in records.items():
        parts += [sheet.markdown() for sheet in sheets_of(name, record["measured"])]
        parts.append(origin_of(record))
    path.write_text("\n".join(parts), encoding="utf-8")


# Runs in the figure: label, colour, marker, and where its rate stands beside its last point.
LOOKS = {
    "hydrone_gym 50 substeps": ("hydrone_gym, vector env (whole steps)", BLUE, "o", (9, -4)),
    "hydrone_gym single": ("hydrone_gym, single env (whole steps)", WATER, "D", (-8, 10)),
    "crazyflow 50 substeps": ("crazyflow, bare physics, 50 substeps a call", RED, "s", (9, 3)),
    "crazyflow 10 substeps": ("crazyflow, bare physics, 10 substeps a call", PURPLE, "^", (9, -13)),
    "PyFlyt 2 substeps": ("PyFlyt, bare physics", BLACK, "v", (9, -4)),
}


def _series(rows: list[dict[str, Any]]) -> dict[str, list[tuple[int, float]]]:
    """Points (number of vehicles, physics substeps a CPU second) by run."""
    found: dict[str, list[tuple[int, float]]] = {}
    for row in rows:
        size, _, substeps = row["run"].partition(", ")
        count = 1 if size == "single" else int(size.removeprefix("N = "))
        key = f"{row['name']} {'single' if size == 'single' else substeps}"
        found.setdefault(key, []).append((count, row["physics"]))
    return found


def _short(value: float) -> str:
    """A rate in three digits."""
    return f"{value / 1e6:.3g} M" if value >= 1e6 else f"{value / 1e3:.3g} k"


def draw(records: dict[str, dict[str, Any]], path: Path) -> None:
    """Physics substeps a CPU second over the number of vehicles, logarithmic both ways."""
    found = _series(records["peers"]["measured"]["rows"])
    with plt.rc_context(FONTS):  # type: ignore[arg-type]
        figure, axes = plt.subplots(figsize=(8.5, 5.0), layout="constrained")
        for key in (key for key in LOOKS if key in found):
            label, colour, marker, offset = LOOKS[key]
            x, y = zip(*sorted(found[key]), strict=True)
            line = "-" if len(x) > 1 else "none"
            axes.plot(x, y, color=colour, marker=marker, markersize=8, linewidth=2, linestyle=line, label=label)
            axes.annotate(_short(y[-1]), (x[-1], y[-1]), xytext=offset, textcoords="offset points", color=colour)
        axes.set_xscale("log", base=4)
        axes.set_yscale("log")
        axes.set_xticks([1, 64, 1024, 4096], ["1", "64", "1024", "4096"])
        axes.minorticks_off()
        axes.set_xlim(0.7, 4096 * 4)
        axes.set_xlabel("vehicles side by side")
        axes.set_ylabel("physics substeps a CPU second (1/s)")
        axes.set_title("Flying to position references, one core", loc="left")
        axes.grid(axis="y", color="#dddddd", linewidth=0.8)
        axes.legend(frameon=False, loc="lower right", bbox_to_anchor=(1.0, 0.04))
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=DOTS_PER_INCH)
        plt.close(figure)


def main() -> int:
    records = load()
    if not records:
        print(f"nothing measured yet: {RESULTS} holds no results")
        return 1
    write_page(records, ROOT / "benchmarks" / "RESULTS.md")
    if "peers" in records:
        draw(records, ROOT / "docs" / "images" / "throughput.png")
    if "generalisation" in records:
        record = records["generalisation"]
        generalisation_table.draw(record["measured"], ROOT / "docs" / "images" / "generalisation.png")
        section = generalisation_table.section(record["measured"], origin_of(record))
        tables.put_into(ROOT / "docs" / "generalisation.md", section)
    if "training_seeds" in records:
        record = records["training_seeds"]
        parts = [*(sheet.markdown() for sheet in training_seeds.sheets(record["measured"])), origin_of(record)]
        tables.put_into(ROOT / "docs" / "training.md", "\n".join(parts))
    missing = [name for name in ORDER if name not in records]
    if missing:
        print(f"not measured yet, so left out: {', '.join(missing)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
