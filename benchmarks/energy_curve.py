"""Seconds against joules: what CL-RRT flies as a second is worth more, and where it then crosses; a table, a figure.

    python -m benchmarks.energy_curve                    # docs/images/energy-curve.png, 100 worlds of each experiment

World k is drawn from seed k; every weight flies the same worlds.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.crossing_points import Crossed, fly_columns
from benchmarks.planning import law_of
from hydrone_gym.evaluation import wilson_interval
from hydrone_gym.rendering import style
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.generator import generate
from hydrone_gym.world.world import World

OBJECTIVES: tuple[str | float, ...] = ("energy", 15.0, 20.0, 25.0, 30.0, 40.0, "time")
MISSIONS = {"experiment-1": "Experiment 1, air to water", "experiment-2": "Experiment 2, water to air"}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What to fly and where the figure goes."""

    worlds: int = 100
    """Worlds flown with each weight."""
    controller: Literal["paper", "robust"] = "paper"
    """The control law."""
    out: Path = Path("docs/images/energy-curve.png")
    """The figure."""


class Point(NamedTuple):
    """Medians of the flights that arrived with one objective."""

    label: str
    time: float  # s
    energy: float  # J
    share: float  # of the way from start to goal where it crosses, %
    swimming: float  # s under water


def point_of(objective: str | float, flown: list[Crossed]) -> Point:
    """Summarise the flights of one objective."""
    label = objective if isinstance(objective, str) else f"{objective:.0f} W"
    columns = [(sum(flight.legs), flight.energy, 100.0 * flight.progress, flight.legs[2]) for flight in flown]
    return Point(label, *np.median(columns, axis=0))


def plot(axes: Axes, points: list[Point], name: str) -> None:
    """Draw one quantity of all points against the time."""
    times, values = [point.time for point in points], [getattr(point, name) for point in points]
    axes.plot(times, values, color=style.WATER, zorder=1)
    axes.plot(times[1:-1], values[1:-1], "o", color=style.BLUE, markersize=7)
    axes.plot(times[0], values[0], "s", color=style.GREEN, markersize=9, label='objective="energy"')
    axes.plot(times[-1], values[-1], "^", color=style.RED, markersize=9, label='objective="time"')


def draw(results: dict[str, list[Point]], worlds: int) -> Figure:
    """Draw energy and crossing point against time, an experiment a column."""
    with style.applied("energy-curve"):
        figure, axes = plt.subplots(2, len(results), figsize=(11.0, 7.0), sharex="col", sharey="row")
        figure.set_layout_engine("constrained")
        for column, (mission, points) in zip(axes.T, results.items()):
            plot(column[0], points, "energy")
            for k, point in enumerate(points[1:-1]):  # on either side in turn: they may lie close
                offset, side = ((7, 5), "left") if k % 2 else ((-7, -14), "right")
                place = point.time, point.energy
                column[0].annotate(point.label, place, offset, textcoords="offset points", ha=side)
            plot(column[1], points, "share")
            low, high = column[1].get_xlim()
            column[1].set_xlim(low - 0.06 * (high - low), high)  # room for the labels on the left
            column[0].set_title(MISSIONS[mission])
            column[1].set(xlabel="median time (s)", ylim=(0.0, 100.0))
        axes[0, 0].set_ylabel("median energy (J)")
        axes[1, 0].set_ylabel("crosses after % of the way")
        axes[0, -1].legend(loc="upper right", frameon=False)
        figure.suptitle(f"Seconds against joules, by what a second is worth: {worlds} worlds of 20 spheres")
    return figure


def main(a: Settings) -> None:
    """Fly, print the table, save the figure."""
    print("| mission | a second is worth | at the goal [95 %] | time s | under water s | energy J | crosses after % |")
    print("|---|---|---|---|---|---|---|")
    results: dict[str, list[Point]] = {}
    for mission in MISSIONS:
        law, points = law_of(mission, 20), []
        scenarios = [generate(law, World(), HYDRONE.radius, np.random.default_rng(k)) for k in range(a.worlds)]
        for objective in OBJECTIVES:
            flown: list[Any] = fly_columns(scenarios, objective, controller=a.controller)
            points.append(point := point_of(objective, flown))
            low, high = (100.0 * share for share in wilson_interval(len(flown), a.worlds))
            goal = f"{len(flown)}/{a.worlds} [{low:.1f}, {high:.1f}]"
            cells = f"{point.time:.1f} | {point.swimming:.1f} | {point.energy:.0f} | {point.share:.0f}"
            print(f"| {mission} | {point.label} | {goal} | {cells} |", flush=True)
        results[mission] = points
    a.out.parent.mkdir(parents=True, exist_ok=True)
    draw(results, a.worlds).savefig(a.out, dpi=style.DOTS_PER_INCH)
    print(a.out)


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
