"""The figures of a flight: path, position and attitude over time, with the attitude that the control law asks for."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import kernel
from hydrone_gym._memory import gather
from hydrone_gym.control.law import tracked
from hydrone_gym.control.laws import named_law
from hydrone_gym.control.reference import FLAT, Instant, Reference
from hydrone_gym.evaluation.flight import Flight, Trace
from hydrone_gym.physics.dynamics import medium_at
from hydrone_gym.physics.kinematics import State, attitude_of, euler_rates
from hydrone_gym.rendering.files import drawn_width, save_figure
from hydrone_gym.simulation.simulation import TICK, Simulation
from hydrone_gym.simulation.storage import vehicle_of, world_of


@kernel
def _write_references(
    states: NDArray, airs: NDArray, moving: NDArray, values: NDArray[np.float64], gains: Any, out: NDArray[np.float64]
) -> None:
    """Write the attitude reference (φ, θ, ψ) of every sample; NaN where a law has none.

    Shapes: states (N, 12), airs (N,) whether the controller takes it to be in air, moving (N, 4), values packed
    `Model`, gains of the law, out (N, 3).
    """
    vehicle, world = vehicle_of(values), world_of(values)
    for n in range(states.shape[0]):
        state = gather(states[n], 0, 0, 1, State)
        # the reference moves evenly within a period; at rest before the first
        old, new = moving[max(n - 1, 0)], moving[n]
        vx, vy, vz = (new[0] - old[0]) / TICK, (new[1] - old[1]) / TICK, (new[2] - old[2]) / TICK
        reference = Reference(new[0], new[1], new[2], new[3], vx, vy, vz)
        attitude, air = attitude_of(state), airs[n]
        rates = euler_rates(attitude, state.p, state.q, state.r)
        vertical = abs(state.z) <= world.zone and world.vertical_mode > 0.0
        now = Instant(state, attitude, rates, reference, vertical, air, medium_at(vehicle, air), FLAT)
        out[n, 0], out[n, 1], out[n, 2] = tracked(gains, now)


def attitude_references(simulation: Simulation, trace: Trace) -> NDArray[np.float64]:
    """Return roll, pitch and yaw (rad) that the control law tracks at every tick of a trace, (N, 3).

    What a law does not track is NaN: by the paper's law roll is free in water, and yaw while the vehicle holds still.
    """
    out = np.empty((len(trace.times), 3))
    gains = named_law(simulation.law).gains_of(simulation.vehicle)
    _write_references(trace.states, trace.driven, trace.references, simulation.values, gains, out)
    return out


def draw_flight(
    flight: Flight,
    simulation: Simulation,
    directory: Path,
    name: str,
    *,
    title: str = "",
    width: float | None = None,
    titled: bool = True,
) -> list[Path]:
    """Write path, position, attitude and, if there is any, weather of a flight as PNG and PDF; return the paths.

    `simulation` is that of the environment it was flown in; `name` begins the name of every file in the existing
    `directory`, and `title` every title; unless given, that is the name. `width` (inches) is that of a paper's column.
    """
    from hydrone_gym.rendering.figures import WIDTH, plot_attitude, plot_path, plot_position, plot_weather

    times, states, references = flight.trace[:3]
    world, position, wanted = simulation.world, states[:, :3], attitude_references(simulation, flight.trace)
    title, zone = title or name[:1].upper() + name[1:].replace("-", " "), world.zone
    ending = f"{title}: {flight.outcome.name.lower().replace('_', ' ')} after {flight.time:.1f} s"
    weather = flight.trace.weather
    level: dict[str, Any] = {"elevations": weather.get("elevation", 0.0)}
    spheres = (flight.detected, flight.undetected)
    look: dict[str, Any] = {"world": world, "width": drawn_width(width, WIDTH), "title": ending, **level}
    figures = {
        "path": plot_path(position, flight.scenario.goal, *spheres, **look),
        "position": plot_position(
            times, position, references[:, :3], zone=zone, title=f"{title}: position over time", **level
        ),
        "attitude": plot_attitude(
            times, states[:, 3:6], wanted, states[:, 2], zone=zone, title=f"{title}: attitude over time", **level
        ),
    }
    if weather:
        told = f"{title}: weather at the vehicle"
        figures["weather"] = plot_weather(times, weather["wind"], weather["water"], weather["elevation"], title=told)
    files = []
    for kind, figure in figures.items():
        files += save_figure(figure, directory / f"{name}-{kind}", width=width, titled=titled)
    return files
