"""Step responses of both vehicles in both media and through the surface: a Markdown table, and a figure on request.

    python benchmarks/step_responses.py
    python benchmarks/step_responses.py --figure step_responses.png
    python benchmarks/step_responses.py --controllers paper robust

Every manoeuvre starts at rest; the reference reaches its end within one period of 0.5 s and stays there.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.control.laws import LAWS
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL, Vehicle
from hydrone_gym.world.world import World

VEHICLES = (HYDRONE, HYDRONE_PHYSICAL)
WORLD = World()


@dataclass(frozen=True, kw_only=True)
class Step:
    name: str
    start: tuple[float, float, float]  # m
    move: tuple[float, float, float]  # m
    duration: float = 20.0  # s
    heading: float = 0.0  # rad, at the start; the reference's heading is zero


AIR = (
    Step(name="air, forward 1 m", start=(0, 0, 5), move=(1, 0, 0)),
    Step(name="air, forward 4 m", start=(-4, 0, 5), move=(4, 0, 0)),
    Step(name="air, left 2 m", start=(0, 0, 5), move=(0, 2, 0)),
    Step(name="air, diagonal 3, 3 m, heading 135°", start=(0, 0, 5), move=(3, 3, 0), heading=2.356),
    Step(name="air, up 1 m", start=(0, 0, 4), move=(0, 0, 1)),
    Step(name="air, up 3 m", start=(0, 0, 4), move=(0, 0, 3)),
    Step(name="air, down 2 m", start=(0, 0, 6), move=(0, 0, -2)),
)
DEPTH = (
    Step(name="water, up 1 m", start=(0, 0, -3), move=(0, 0, 1)),
    Step(name="water, up 2.8 m", start=(0, 0, -4), move=(0, 0, 2.8)),
    Step(name="water, down 1 m", start=(0, 0, -2), move=(0, 0, -1)),
    Step(name="water, down 2.8 m", start=(0, 0, -1.2), move=(0, 0, -2.8)),
)
SWIM = (
    Step(name="water, ahead 2 m", start=(0, 0, -3), move=(2, 0, 0)),
    Step(name="water, behind 1 m", start=(0, 0, -3), move=(-1, 0, 0)),
    Step(name="water, aside 2 m", start=(0, 0, -3), move=(0, 2, 0), duration=30.0),
)
CROSSINGS = (
    Step(name="water entry, straight down", start=(0, 0, 2), move=(0, 0, -4)),
    Step(name="water entry, 3 m aside", start=(0, 0, 2), move=(3, 0, -4)),
    Step(name="water exit, straight up", start=(0, 0, -2), move=(0, 0, 4)),
    Step(name="water exit, 2 m aside", start=(0, 0, -2), move=(2, 0, 4)),
)


@dataclass(frozen=True, kw_only=True)
class Response:
    times: NDArray[np.float64]  # s
    share: NDArray[np.float64]  # distance covered along the step, 0 to 1
    states: NDArray[np.float64]
    error: float  # m, mean distance to the reference over the last second
    overshoot: float  # share of the step
    settling: float  # s until the distance stays within 0.1 m (0.5 m under water across) of the reference
    lateral_speed: float  # m/s at the surface, worst crossing
    tilt: float  # deg
    crossing_time: float  # s


def respond(vehicle: Vehicle, step: Step, law: str = "paper") -> Response:
    """Fly one step under a law and measure it."""
    simulation = Simulation(vehicle, WORLD, law=law)
    start, move = np.array(step.start, float), np.array(step.move, float)
    state = np.array([*start, 0.0, 0.0, step.heading, *np.zeros(6)])
    references = np.tile([*(start + move), 0.0], (round(step.duration / simulation.period), 1))
    times, states, _, row = trajectory(simulation, row_at(state), references)
    if row["outcome"][0] != 0:
        raise RuntimeError(f"{vehicle.name}, {law}: {step.name} ended early with outcome {int(row['outcome'][0])}")
    distance = np.linalg.norm(states[:, :3] - (start + move), axis=1)
    share = (states[:, :3] - start) @ move / (move @ move)
    swims = step in SWIM
    late = np.flatnonzero(distance > (0.5 if swims else 0.1))
    log = row["crossing_log"][0, : min(int(row["crossings"][0]), 8)]
    return Response(
        times=times,
        share=share,
        states=states,
        error=float(distance[-20:].mean()),
        overshoot=float(max(share.max() - 1.0, 0.0)),
        settling=float(times[min(late[-1] + 1, len(times) - 1)]) if len(late) else 0.0,
        lateral_speed=float(log[:, 2].max()) if len(log) else 0.0,
        tilt=float(np.degrees(np.arccos(log[:, 3].min()))) if len(log) else 0.0,
        crossing_time=float(log[0, 0]) if len(log) else np.nan,
    )


def hold(vehicle: Vehicle, surge: float, sway: float, law: str = "paper") -> tuple[float, float, float]:
    """Hold still under water from a speed (m/s): seconds to rest (below 0.02 m/s), drift in m, speed (m/s) at 20 s."""
    state = np.array([0.0, 0.0, -3.0, 0.0, 0.0, 0.0, surge, sway, 0.0, 0.0, 0.0, 0.0])
    references = np.tile([0.0, 0.0, -3.0, 0.0], (40, 1))
    references[:, :2] = [0.1 * surge, 0.1 * sway]  # where a planner anchors the reference of a stop
    times, states, _, _ = trajectory(Simulation(vehicle, WORLD, law=law), row_at(state), references)
    speed = np.linalg.norm(states[:, 6:9], axis=1)
    moving = np.flatnonzero(speed >= 0.02)
    drift = np.linalg.norm(states[:, :2], axis=1).max()
    return float(times[min(moving[-1] + 1, len(times) - 1)]), float(drift), float(speed[-1])


def _head(laws: Sequence[str], what: str, measures: Sequence[str]) -> list[str]:
    """Head of a table; every measure has a column a law, named where there are several."""
    columns = [name if len(laws) == 1 else f"{name}, {law}" for name in measures for law in laws]
    return [f"| vehicle | {what} | {' | '.join(columns)} |", f"|---|---|{'---:|' * len(columns)}"]


def _line(vehicle: Vehicle, name: str, cells: Sequence[Sequence[str]]) -> str:
    """Line of a table: the cells of each law, put measure by measure."""
    return f"| {vehicle.name} | {name} | {' | '.join(cell for cells in zip(*cells, strict=True) for cell in cells)} |"


def _across(r: Response) -> tuple[str, ...]:
    return f"{r.error:.3f}", f"{100 * r.overshoot:.1f}", f"{r.settling:.1f}"


def _through(r: Response) -> tuple[str, ...]:
    return f"{r.crossing_time:.2f}", f"{r.lateral_speed:.4f}", f"{r.tilt:.3f}", f"{r.error:.3f}"


def _rest(seconds: float, drift: float, speed: float) -> tuple[str, ...]:
    return f"{seconds:.2f}", f"{drift:.2f}", f"{speed:.4f}"


def table(laws: Sequence[str] = ("paper",)) -> str:
    """Markdown tables of every response of both vehicles, laws side by side."""
    lines = _head(laws, "step", ("error (m)", "overshoot (%)", "settled after (s)"))
    for vehicle in VEHICLES:
        for step in (*AIR, *DEPTH, *SWIM):
            lines.append(_line(vehicle, step.name, [_across(respond(vehicle, step, law)) for law in laws]))
    lines += ["", *_head(laws, "crossing", ("at (s)", "lateral speed (m/s)", "tilt (deg)", "error after it (m)"))]
    for vehicle in VEHICLES:
        for step in CROSSINGS:
            lines.append(_line(vehicle, step.name, [_through(respond(vehicle, step, law)) for law in laws]))
    measures = ("at rest after (s)", "drift (m)", "speed after 20 s (m/s)")
    lines += ["", *_head(laws, "holding still under water from", measures)]
    for vehicle in VEHICLES:
        for surge, sway in ((1.0, 0.0), (0.5, 0.5), (0.0, 0.5)):
            name = f"{surge} m/s surge, {sway} m/s sway"
            lines.append(_line(vehicle, name, [_rest(*hold(vehicle, surge, sway, law)) for law in laws]))
    return "\n".join(lines)


# Okabe and Ito's palette, told apart with every kind of colour vision.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_DASHES = ("-", "--")
Flyer = tuple[Vehicle, str]  # a vehicle, and the law that flies it


def _panel(axis: Any, flyers: Sequence[Flyer], steps: tuple[Step, ...], title: str, until: float) -> None:
    """Share of the step covered against time, one colour a step, one line style a flyer."""
    axis.axhspan(0.95, 1.05, color="#000000", alpha=0.08, lw=0)
    axis.axhline(1.0, color="#000000", lw=0.8, ls=":")
    for step, colour in zip(steps, _COLOURS):
        for k, (vehicle, law) in enumerate(flyers):
            r = respond(vehicle, step, law)
            label = None if k else step.name.split(", ", 1)[1]
            axis.plot(r.times, r.share, _DASHES[k], color=colour, lw=1.4, label=label)
    axis.set(
        title=title, xlim=(0, until), ylim=(-0.05, 1.45), xlabel="time (s)", ylabel="share of the step covered (1)"
    )
    axis.legend(fontsize=8, loc="lower right")


def _crossing_panel(axis: Any, flyers: Sequence[Flyer]) -> None:
    """Height against time, with the transition zone shaded."""
    axis.axhspan(-WORLD.zone, WORLD.zone, color="#56B4E9", alpha=0.2, lw=0, label="transition zone")
    axis.axhline(0.0, color="#000000", lw=0.8, ls=":")
    for step, colour in zip(CROSSINGS, _COLOURS):
        for k, (vehicle, law) in enumerate(flyers):
            r = respond(vehicle, step, law)
            axis.plot(r.times, r.states[:, 2], _DASHES[k], color=colour, lw=1.4, label=None if k else step.name)
    axis.set(
        title="Crossings (both exits coincide)",
        xlim=(0, 10),
        ylim=(-2.4, 3.8),
        xlabel="time (s)",
        ylabel="height above the surface (m)",
    )
    axis.legend(fontsize=8, loc="upper left", ncols=2)


def figure(path: str, laws: Sequence[str] = ("paper",)) -> None:
    """Save the responses as a figure: of both vehicles under one law, or of the paper's vehicle under two."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    flyers = [(vehicle, laws[0]) for vehicle in VEHICLES] if len(laws) == 1 else [(HYDRONE, law) for law in laws]
    names = [f"{vehicle.name} set" if len(laws) == 1 else f"{law} law" for vehicle, law in flyers]
    drawing, axes = plt.subplots(2, 2, figsize=(12, 8), layout="constrained")
    _panel(axes[0, 0], flyers, AIR, "Air", 8.0)
    _panel(axes[0, 1], flyers, DEPTH, "Depth in water", 8.0)
    _panel(axes[1, 0], flyers, SWIM, "Across in water (the vehicle stops within its hold radius)", 12.0)
    _crossing_panel(axes[1, 1], flyers)
    drawing.suptitle(f"Step responses: solid = {names[0]}, dashed = {names[1]}; grey band = 5 % of the step")
    drawing.savefig(path, dpi=120)
    plt.close(drawing)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", nargs="+", choices=tuple(LAWS), default=["paper"], help="control laws")
    parser.add_argument("--figure", metavar="PATH", help="also save a figure of the responses")
    options = parser.parse_args()
    print(table(options.controllers))
    if options.figure:
        figure(options.figure, options.controllers)


if __name__ == "__main__":
    main()
