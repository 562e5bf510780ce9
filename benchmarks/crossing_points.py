"""Where each objective crosses the surface, and how long it is and how far it turns in each medium: tables, a figure.

    python -m benchmarks.crossing_points                 # docs/images/crossings.png, 100 worlds of Experiment 1
    python -m benchmarks.crossing_points --worlds 20 --mission air-water

World k is drawn from seed k; every objective flies the same worlds.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import gymnasium as gym
import matplotlib.pyplot as plt
import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from tqdm import tqdm

from benchmarks.planning import law_of
from hydrone_gym import Outcome
from hydrone_gym.evaluation import Flight, fly
from hydrone_gym.rendering import style
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.generator import generate
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World
from planners import CLRRT

OBJECTIVES = {"time": style.BLUE, "energy": style.GREEN, "paper": style.RED}
LEGS = {"air": style.DETECTED[1], "zone": style.WATER, "water": style.BLUE}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What to fly and where the figure goes."""

    worlds: int = 100
    """Worlds flown with each objective."""
    mission: Literal["experiment-1", "experiment-2", "air-water", "water-air"] = "experiment-1"
    """Mission type, named as in benchmarks.planning."""
    out: Path = Path("docs/images/crossings.png")
    """The figure."""


class Crossed(NamedTuple):
    """One flight: crossing point (m); seconds, and degrees turned, in air, zone and water; start and goal (m)."""

    point: np.ndarray
    legs: tuple[float, float, float]
    turned: tuple[float, float, float]
    apart: float  # between the first and the last heading, degrees
    start: np.ndarray
    goal: np.ndarray
    energy: float
    progress: float  # share of the way from start to goal, seen from above


def crossed(flight: Flight, zone: float) -> Crossed:
    """Take from a flight where it crossed first and how its time and its turning are divided."""
    states, scenario = flight.trace.states, flight.scenario
    air = float((states[:-1, 2] > zone).mean()) * flight.time
    water = float((states[:-1, 2] < -zone).mean()) * flight.time
    heading, z = np.unwrap(states[:, 5]), states[:-1, 2]
    turns = np.degrees(np.abs(np.diff(heading)))
    turned = float(turns[z > zone].sum()), float(turns[np.abs(z) <= zone].sum()), float(turns[z < -zone].sum())
    apart = float(np.degrees(abs(heading[-1] - heading[0])))
    passed = int(np.flatnonzero(np.diff(np.sign(states[:, 2])))[0])
    point, start, goal = states[passed, :2], np.array(scenario.start[:2]), np.array(scenario.goal[:2])
    way = goal - start
    share = float((point - start) @ way / (way @ way))
    legs = (air, flight.time - air - water, water)
    return Crossed(point, legs, turned, apart, start, goal, flight.energy, share)


def fly_columns(scenarios: list[Scenario], objective: str | float, controller: str = "paper") -> list[Crossed]:
    """Fly every world with one objective; those that arrive count."""
    env = gym.make("HydroneGym/Mission-v0", controller=controller)
    planner: Any = CLRRT.for_env(env, objective=objective)
    zone = env.get_wrapper_attr("world").zone
    flights = (fly(env, planner, scenario=scenario) for scenario in tqdm(scenarios, desc=str(objective), leave=False))
    return [crossed(flight, zone) for flight in flights if flight.outcome is Outcome.GOAL]


def plot_points(axes: Axes, flown: list[Crossed], objective: str, world: World) -> None:
    """Draw the crossing points of one objective from above."""
    points = np.array([flight.point for flight in flown])
    axes.scatter(points[:, 0], points[:, 1], s=22, color=OBJECTIVES[objective], alpha=0.7, linewidth=0)
    axes.plot(*np.mean([flight.start for flight in flown], axis=0), "^", color=style.BLACK, markersize=9)
    axes.plot(*np.mean([flight.goal for flight in flown], axis=0), "*", color=style.PURPLE, markersize=15)
    axes.set(title=f'objective="{objective}"', xlabel="x (m)", aspect="equal")
    axes.set_xlim(world.lower[0], world.upper[0])
    axes.set_ylim(world.lower[1], world.upper[1])


def draw(results: dict[str, list[Crossed]], mission: str) -> Figure:
    """Draw the points of every objective, and below them the time in each medium."""
    with plt.rc_context(style.FONTS):
        figure = plt.figure(figsize=(11.0, 6.6), layout="constrained")
        grid = figure.add_gridspec(2, len(results), height_ratios=(3.0, 1.3))
        for column, (objective, flown) in enumerate(results.items()):
            axes = figure.add_subplot(grid[0, column])
            plot_points(axes, flown, objective, World())
            if column == 0:
                axes.set_ylabel("y (m)")
        bars = figure.add_subplot(grid[1, :])
        left = np.zeros(len(results))
        for leg, (name, colour) in enumerate(LEGS.items()):
            seconds = np.array([np.median([flight.legs[leg] for flight in flown]) for flown in results.values()])
            bars.barh(list(results), seconds, left=left, color=colour, label=name, height=0.6)
            for row, (value, begin) in enumerate(zip(seconds, left)):
                bars.text(begin + 0.5 * value, row, f"{value:.1f}", ha="center", va="center", color="white")
            left += seconds
        bars.invert_yaxis()
        bars.set_xlabel("median time (s) in each medium; zone: within 0.8 m of the surface")
        bars.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
        worlds = len(next(iter(results.values())))
        figure.suptitle(f"Where CL-RRT crosses: {mission}, {worlds} worlds of 20 spheres, seen from above")
    return figure


def print_turning(results: dict[str, list[Crossed]]) -> None:
    """Print how far the vehicle turned in each medium and in all, and how far its first and last heading lie apart."""
    print("\n| objective | turned in air ° | zone ° | water ° | in all ° [5 %, 95 %] | first to last heading ° |")
    print("|---|---|---|---|---|---|")
    for objective, flown in results.items():
        turned, total = np.array([flight.turned for flight in flown]), [sum(flight.turned) for flight in flown]
        cells = " | ".join(f"{part:.0f}" for part in np.median(turned, axis=0))
        low, middle, high = np.percentile(total, (5.0, 50.0, 95.0))
        apart = np.median([flight.apart for flight in flown])
        print(f"| {objective} | {cells} | {middle:.0f} [{low:.0f}, {high:.0f}] | {apart:.0f} |")


def main(a: Settings) -> None:
    """Fly, print the table, save the figure."""
    law = law_of(a.mission, 20)
    scenarios = [generate(law, World(), HYDRONE.radius, np.random.default_rng(k)) for k in range(a.worlds)]
    results = {objective: fly_columns(scenarios, objective) for objective in OBJECTIVES}
    print("| objective | worlds | air s | zone s | water s | in all s | energy J | crosses after % of the way |")
    print("|---|---|---|---|---|---|---|---|")
    for objective, flown in results.items():
        legs = [np.median([flight.legs[leg] for flight in flown]) for leg in range(3)]
        total = np.median([sum(flight.legs) for flight in flown])
        energy = np.median([flight.energy for flight in flown])
        share = 100.0 * np.median([flight.progress for flight in flown])
        cells = " | ".join(f"{leg:.1f}" for leg in legs)
        print(f"| {objective} | {len(flown)} | {cells} | {total:.1f} | {energy:.0f} | {share:.0f} |")
    print_turning(results)
    a.out.parent.mkdir(parents=True, exist_ok=True)
    draw(results, a.mission).savefig(a.out, dpi=style.DOTS_PER_INCH)
    print(a.out)


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
