"""The figures of a flight: path, position and attitude over time."""

from pathlib import Path

from hydrone_gym.evaluation.attitude import attitude_references
from hydrone_gym.evaluation.flight import Flight
from hydrone_gym.simulation.simulation import Simulation


def draw_flight(flight: Flight, simulation: Simulation, directory: Path, name: str) -> list[Path]:
    """Write the figures of a flight, path, position and attitude, as PNG and PDF; return their paths.

    `simulation` is that of the environment it was flown in; `name` begins the name of every file in the existing
    `directory`, and with a capital letter every title.
    """
    from hydrone_gym.rendering.figures import plot_attitude, plot_path, plot_position, save_figure

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
