"""Write benchmarks/RESULTS.md and docs/images/throughput.png from what the benchmarks last measured.

python -m benchmarks.results
"""

import json
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt

from benchmarks import tables
from benchmarks.peers import run as peers
from benchmarks.timing import RESULTS, ROOT
from hydrone_gym.rendering.style import BLACK, BLUE, DOTS_PER_INCH, FONTS, PURPLE, RED, WATER

ORDER = ("environments", "peers", "c_reference", "edges", "threads", "neighbour", "memory", "start", "versions")
HEAD = """# Measured speed

Written by `python -m benchmarks.results` from `benchmarks/results/*.json`; each table names the command that measures
it again. Rates are per CPU second on one core unless a table says otherwise, medians of turns taken alternately, after
a warm-up, so that compared figures come from the same minute of the same machine. One environment step is 0.5 s of
flight: 50 substeps of control and dynamics, collision and sensing every 50 ms against 20 spheres, observation, reward.
"""


def load() -> dict[str, dict[str, Any]]:
    """Measurements by name, as far as they exist."""
    paths = {name: RESULTS / f"{name}.json" for name in ORDER}
    return {name: json.loads(path.read_text(encoding="utf-8")) for name, path in paths.items() if path.exists()}


def sheet_of(name: str, measured: dict[str, Any]) -> tables.Sheet:
    """The table of a measurement."""
    return peers.sheet(measured) if name == "peers" else tables.BUILDERS[name](measured)


def describe(record: dict[str, Any]) -> str:
    """Machine, versions, commit and date in one line."""
    machine = record["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    load_words = f", load {machine['load'][0]}" if machine["load"] else ""
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}{load_words}; {versions}; "
        f"commit {machine['commit']}; {machine['date']}"
    )


def write_page(records: dict[str, dict[str, Any]], path: Path) -> None:
    """One section a measurement."""
    parts = [HEAD, "![Physics substeps a CPU second](../docs/images/throughput.png)\n"]
    for name, record in records.items():
        parts.append(sheet_of(name, record["measured"]).markdown())
        parts.append(f"`{record['command']}`  \n{describe(record)}\n")
    path.write_text("\n".join(parts), encoding="utf-8")


def _series(records: dict[str, dict[str, Any]]) -> list[tuple[str, str, str, list[tuple[int, float]]]]:
    """Lines of the figure: label, colour, marker, (number of vehicles, physics substeps a CPU second)."""
    found: dict[str, list[tuple[int, float]]] = {}
    for row in records["peers"]["measured"]["rows"]:
        size, _, substeps = row["run"].partition(", ")
        count = 1 if size == "single" else int(size.removeprefix("N = "))
        key = f"{row['name']} single" if size == "single" else f"{row['name']} {substeps}"
        found.setdefault(key, []).append((count, row["physics"]))
    looks = {
        "hydrone_gym 50 substeps": ("hydrone_gym, vector env (whole steps)", BLUE, "o"),
        "hydrone_gym single": ("hydrone_gym, single env (whole steps)", WATER, "D"),
        "crazyflow 50 substeps": ("crazyflow, bare physics, 50 substeps a call", RED, "s"),
        "crazyflow 10 substeps": ("crazyflow, bare physics, 10 substeps a call", PURPLE, "^"),
        "PyFlyt 2 substeps": ("PyFlyt, bare physics", BLACK, "v"),
    }
    return [(*looks[key], sorted(found[key])) for key in looks if key in found]


def draw(records: dict[str, dict[str, Any]], path: Path) -> None:
    """Physics substeps a CPU second over the number of vehicles, logarithmic both ways."""
    with plt.rc_context(FONTS):  # type: ignore[arg-type]
        figure, axes = plt.subplots(figsize=(8.5, 5.0), layout="constrained")
        for label, colour, marker, points in _series(records):
            x, y = zip(*points, strict=True)
            axes.plot(x, y, color=colour, marker=marker, markersize=8, linewidth=2, label=label)
            end = (x[-1], y[-1])
            axes.annotate(tables.number(y[-1]), end, xytext=(9, -4), textcoords="offset points", color=colour)
        axes.set_xscale("log", base=4)
        axes.set_yscale("log")
        axes.set_xticks([1, 64, 1024, 4096], ["1", "64", "1024", "4096"])
        axes.minorticks_off()
        axes.set_xlim(0.7, 4096 * 6)
        axes.set_xlabel("vehicles side by side")
        axes.set_ylabel("physics substeps a CPU second (1/s)")
        axes.set_title("Flying to position references, one core", loc="left")
        axes.grid(axis="y", color="#dddddd", linewidth=0.8)
        axes.legend(frameon=False, loc="center right", bbox_to_anchor=(1.0, 0.36))
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
    missing = [name for name in ORDER if name not in records]
    if missing:
        print(f"not measured yet, so left out: {', '.join(missing)}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
