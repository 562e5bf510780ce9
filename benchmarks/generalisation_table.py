"""What `benchmarks.generalisation` measured, as tables, as a figure, and in docs/generalisation.md."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.tables import Sheet
from hydrone_gym.rendering.style import BLACK, BLUE, DOTS_PER_INCH, FONTS, GREEN, RED

Measured = dict[str, Any]
WORDS = {
    "ppo": "PPO",
    "ppo-shield": "PPO, shield",
    "sac": "SAC",
    "sac-shield": "SAC, shield",
    "straight-line-shield": "straight line, shield",
    "clrrt": "CL-RRT",
}
LETTERS = {
    "COLLISION": "C",
    "OUT_OF_BOUNDS": "B",
    "ROUGH_TRANSITION": "R",
    "TIMEOUT": "T",
    "DIVERGED": "D",
}
LEGEND = "C collision, B out of the box, R rough crossing, T time-out, D diverged"


def by_shape(measured: Measured) -> dict[str, dict[str, Measured]]:
    """Cells by shape, then by policy, in the order they were flown."""
    found: dict[str, dict[str, Measured]] = {}
    for cell in measured["cells"]:
        found.setdefault(cell["shape"], {})[cell["policy"]] = cell
    return found


def policies(measured: Measured) -> list[str]:
    """Policies in the order they were flown."""
    return list(dict.fromkeys(cell["policy"] for cell in measured["cells"]))


def _worlds(measured: Measured) -> str:
    """How many worlds a row each policy has flown, in words."""
    groups: dict[int, list[str]] = {}
    for name in policies(measured):
        count = next(cell["episodes"] for cell in measured["cells"] if cell["policy"] == name)
        groups.setdefault(count, []).append(WORDS.get(name, name))
    (most, _), *rest = sorted(groups.items(), reverse=True)
    fewer = "".join(f"; {' and '.join(names)} the first {count:,}" for count, names in rest)
    return f"{most:,} worlds a row{fewer}; seeds from {measured['seed']:,} on."


def success_sheet(measured: Measured) -> Sheet:
    """Share of flights that arrived, a shape a row and a policy a column."""
    rows = []
    for shape, cells in by_shape(measured).items():
        ends = ((100 * c["success"], *(100 * end for end in c["interval"])) for c in cells.values())
        # narrow columns break after the value, not inside its interval
        rows.append((shape, *(f"{value:.1f} [{low:.1f},\N{NO-BREAK SPACE}{high:.1f}]" for value, low, high in ends)))
    columns = ("worlds", *(WORDS.get(name, name) for name in policies(measured)))
    minutes = f"{measured['cpu_seconds'] / 60.0:.1f} minutes of one core"
    notes = [f"{_worlds(measured)} Wilson intervals of 95 %. {minutes}."]
    return Sheet("At the goal in worlds of another shape, % [95 %]", columns, rows, notes)


def _failures(outcomes: dict[str, int]) -> str:
    """Flights that did not arrive, by kind."""
    return ", ".join(f"{outcomes[kind]} {letter}" for kind, letter in LETTERS.items() if outcomes.get(kind)) or "–"


def failure_sheet(measured: Measured) -> Sheet:
    """How the other flights ended, and all of them summed up."""
    rows = [
        (shape, *(_failures(cell["outcomes"]) for cell in cells.values()))
        for shape, cells in by_shape(measured).items()
    ]
    sums = []
    for name in policies(measured):
        cells = [cell for cell in measured["cells"] if cell["policy"] == name]
        total = {kind: sum(cell["outcomes"].get(kind, 0) for cell in cells) for kind in LETTERS}
        sums.append(f"{_failures(total)} of {sum(cell['episodes'] for cell in cells):,}")
    columns = ("worlds", *(WORDS.get(name, name) for name in policies(measured)))
    return Sheet("How the other flights ended", columns, [*rows, ("all", *sums)], [f"{LEGEND}."])


def changes(measured: Measured) -> list[str]:
    """A line a policy: the shapes in which it arrives less often, or more often, than in the shape's reference."""
    shapes, lines = by_shape(measured), []
    for name in policies(measured):
        worse, better = [], []
        for shape, cells in shapes.items():
            cell, reference = cells[name], shapes.get(cells[name]["reference"], {}).get(name)
            if reference is None or shape == cell["reference"] or cell["group"] == reference["group"]:
                continue
            told = f"{shape} ({100 * cell['success']:.1f} against {100 * reference['success']:.1f})"
            if cell["interval"][1] < reference["interval"][0]:
                worse.append(told)
            elif cell["interval"][0] > reference["interval"][1]:
                better.append(told)
        less = f"less often in {', '.join(worse)}" if worse else "nowhere less often"
        more = f"; more often in {', '.join(better)}" if better else ""
        lines.append(f"- {WORDS.get(name, name)}: {less}{more}")
    return lines


def section(measured: Measured, origin: str) -> str:
    """Return the tables and their `origin` (command, machine) as Markdown."""
    parts = [
        success_sheet(measured).markdown(),
        failure_sheet(measured).markdown(),
        "### What is clearly different\n",
        "Flights at the goal against those in the worlds to compare with, in %, where the intervals do not overlap:\n",
        "\n".join(changes(measured)) + "\n",
        origin,
    ]
    return "\n".join(parts)


# Colour, marker and whether it is filled: agents alone are hollow.
LOOKS = {
    "ppo": (BLUE, "o", "white"),
    "ppo-shield": (BLUE, "o", BLUE),
    "sac": (RED, "s", "white"),
    "sac-shield": (RED, "s", RED),
    "straight-line-shield": (BLACK, "D", BLACK),
    "clrrt": (GREEN, "^", GREEN),
}


def _plot_policy(axes: Any, name: str, cells: list[Measured], lane: float) -> None:
    """Draw the share that did not arrive of a policy, a shape a row, `lane` (rows) below the middle of each."""
    colour, marker, face = LOOKS[name]
    lost = 100.0 * np.array([1.0 - cell["success"] for cell in cells])
    ends = 100.0 * np.array([[1.0 - cell["interval"][1], 1.0 - cell["interval"][0]] for cell in cells]).T
    axes.errorbar(
        lost,
        np.arange(len(cells)) + lane,
        xerr=np.abs(ends - lost),
        linestyle="none",
        elinewidth=1.2,
        color=colour,
        marker=marker,
        markerfacecolor=face,
        markersize=5.5,
        label=WORDS[name],
    )


def _set_rows(axes: Any, shapes: dict[str, dict[str, Measured]]) -> None:
    """Name the rows, shade every other one and part the groups."""
    groups = [next(iter(cells.values()))["group"] for cells in shapes.values()]
    for row in range(0, len(groups), 2):
        axes.axhspan(row - 0.5, row + 0.5, color="#f0f0f0", linewidth=0)
    for group in dict.fromkeys(groups):
        first, count = groups.index(group), groups.count(group)
        axes.axhline(first - 0.5, color=BLACK, linewidth=0.8)
        looks = {"rotation": 270, "ha": "left", "va": "center", "transform": axes.get_yaxis_transform()}
        axes.text(1.01, first + 0.5 * (count - 1), group, **looks)
    axes.set_yticks(range(len(shapes)), list(shapes))
    axes.set_ylim(len(shapes) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)


def draw(measured: Measured, path: Path) -> None:
    """Share of flights that did not arrive, with its interval, a shape a row; policies without looks are left out."""
    import matplotlib.pyplot as plt

    shapes, ticks = by_shape(measured), (0, 0.5, 1, 2, 5, 10, 20, 50, 100)
    names = [name for name in policies(measured) if name in LOOKS]
    with plt.rc_context(FONTS):  # type: ignore[arg-type]
        figure, axes = plt.subplots(figsize=(9.5, 0.6 * len(shapes) + 1.8), layout="constrained")
        _set_rows(axes, shapes)
        for k, name in enumerate(names):
            lane = 0.84 * ((k + 0.5) / len(names) - 0.5)
            _plot_policy(axes, name, [cells[name] for cells in shapes.values()], lane)
        axes.set_xscale("symlog", linthresh=1.0, linscale=0.6)  # no failure at all has a place too
        axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.set_xlim(-0.05, 105.0)
        axes.set_xlabel("flights that did not arrive (%), with the 95 % interval")
        axes.grid(axis="x", color="#cccccc", linewidth=0.8)
        axes.set_axisbelow(True)
        figure.legend(loc="outside upper center", ncols=3, frameon=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=DOTS_PER_INCH)
        plt.close(figure)
