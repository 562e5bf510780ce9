"""What is shown of a flight: its record as plain numbers, and its figures."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hydrone_gym.evaluation.attitude import attitude_references
from hydrone_gym.evaluation.flight import Flight
from hydrone_gym.evaluation.statistics import percentiles
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation


def flight_record(flight: Flight) -> dict[str, Any]:
    """Return a flight as numbers, strings, lists and dicts: SI units, angles in rad, planning times in ms.

    Every number is finite; what is not, such as the clearance in a world without obstacles, is None.
    """
    p50, p99 = percentiles(flight.decision_ms, (50.0, 99.0))
    scenario = flight.scenario
    record = {
        "scenario": {
            "name": scenario.name,
            "start": scenario.start,
            "goal": scenario.goal,
            "obstacles": scenario.obstacles,
        },
        "outcome": flight.outcome.name,
        "success": flight.outcome is Outcome.GOAL,
        "time": flight.time,
        "transitions": flight.transitions,
        "clearance": flight.clearance,
        "length": flight.length,
        "energy": flight.energy,
        "episode_return": flight.episode_return,
        "planning_ms": {"p50": p50, "p99": p99},
        "references": flight.references,
        "states": flight.states,
        "detected": flight.detected,
    }
    return {name: plain(value) for name, value in record.items()}


def plain(value: Any) -> Any:
    """Turn arrays, tuples and NumPy scalars into what JSON has, with None for numbers that are not finite."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def draw_flight(flight: Flight, simulation: Simulation, directory: Path, name: str) -> list[Path]:
    """Write the figures of a flight, path, position and attitude, as PNG and PDF; return their paths.

    Args:
        flight: the flight.
        simulation: that of the environment it was flown in.
        directory: an existing folder.
        name: begins every file's name, and with a capital letter every title.
    """
    from hydrone_gym.rendering.figures import plot_path, save_figure
    from hydrone_gym.rendering.histories import plot_attitude, plot_position

    times, states, references = flight.trace
    world, goal = simulation.world, flight.scenario.goal
    title = name[:1].upper() + name[1:].replace("-", " ")
    ending = f"{flight.outcome.name.lower().replace('_', ' ')} after {flight.time:.1f} s"
    path = plot_path(
        states[:, :3],
        goal,
        flight.detected,
        flight.undetected,
        lower=world.lower,
        upper=world.upper,
        title=f"{title}: {ending}",
    )
    position = plot_position(
        times, states[:, :3], references[:, :3], zone=world.zone, title=f"{title}: position over time"
    )
    attitude = plot_attitude(
        times,
        states[:, 3:6],
        attitude_references(simulation, flight.trace),
        states[:, 2],
        zone=world.zone,
        title=f"{title}: attitude over time",
    )
    figures = {"path": path, "position": position, "attitude": attitude}
    return [file for kind, figure in figures.items() for file in save_figure(figure, directory / f"{name}-{kind}")]
