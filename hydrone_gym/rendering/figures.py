"""Figures of a flight: its path (paper, Figs. 6 and 9), position (7, 10) and attitude (8, 11); and a tree (5).

Functions take arrays in SI units and return Matplotlib figures; `rendering.files` writes them. Matplotlib is imported
when the first figure is drawn, and no display is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering import style
from hydrone_gym.rendering.camera import side_azimuth
from hydrone_gym.rendering.paths import crossing_points, dash, split_media
from hydrone_gym.rendering.scene3d import WIDE, WIDTH, Scene
from hydrone_gym.rendering.track import Tree
from hydrone_gym.surface import in_air
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Look = dict[str, Any]
_BOX = World()  # that of the paper's experiments
_DASH, _GAP = 0.3, 0.21  # m: a path under water
_CLOSE: Look = {"columnspacing": 1.2, "handlelength": 1.5}  # a legend that fits in a column
_LEAST_ANGLE_RANGE = 4.0  # degrees: a straight flight must not look wild
_EXECUTED: Look = {"color": style.RED, "linewidth": 2.4}
_REFERENCE: Look = {"color": style.BLACK, "linewidth": 1.7, "linestyle": ":"}
_ZONE: Look = {"color": style.WATER, "linewidth": 0}
_CROSSING: Look = {"color": style.BLUE, "linewidth": 1.2, "linestyle": "--"}


def plot_path(
    positions: Array,
    goal: Sequence[float],
    detected: Array,
    undetected: Array,
    *,
    world: World = _BOX,
    title: str = "",
    width: float = WIDTH,
    elevations: Array | float = 0.0,
) -> Figure:
    """Draw an executed path (N, 3) in its world (paper, Figs. 6 and 9), solid in air, dashed under water.

    Obstacles (k, BODY) are black where detected, else faint. A sphere around the goal, to scale, is where the flight
    arrives. `width` is in inches, `elevations` (N,) are those of the surface at the vehicle, m.
    """
    scene = Scene(world.lower, world.upper, azimuth=side_azimuth(positions[0], goal), width=width)
    scene.obstacles(undetected, style.FAINT, alpha=0.55)
    scene.obstacles(detected, style.DETECTED)
    air, water = split_media(positions, elevations)
    scene.lines(air, style.RED, 2.8, hidden=0.5)
    scene.lines([piece for line in water for piece in dash(line, _DASH, _GAP)], style.RED, 2.8, hidden=0.5)
    for number, point in enumerate(crossing_points(positions, elevations)):
        scene.mark(point, "o", style.BLUE, 11, "" if number else "crossing", hollow=True)
    red: Look = {"color": style.RED, "linewidth": 2.8}
    entries = {"path in air": red} if air else {}
    entries |= {"path under water": {**red, "linestyle": (0, (1.6, 1.1))}} if water else {}
    entries |= {"detected obstacle": _ball(style.DETECTED)}
    entries |= {"undetected obstacle": _ball(style.FAINT)} if len(undetected) else {}
    return _finished(scene, title, (positions[0], goal, world.goal_radius), "start", entries)


def plot_tree(tree: Tree, scenario: Scenario, world: World, *, title: str = "", width: float = WIDTH) -> Figure:
    """Draw a planner's tree with every obstacle known (paper, Fig. 5), red in air, purple under water."""
    start, goal = scenario.start[:3], scenario.goal
    scene = Scene(world.lower, world.upper, azimuth=side_azimuth(start, goal), width=width)
    scene.obstacles(scenario.obstacles, style.DETECTED)
    entries: dict[str, Look] = {
        "branch in air": {"color": style.RED, "linewidth": 2.0},
        "branch under water": {"color": style.PURPLE, "linewidth": 2.0},
    }
    if len(tree.path):  # beneath the branches, which keep their colour
        solution = tree.edges[tree.path]
        scene.lines([np.concatenate((solution[:1, 0], solution[:, 1]))], style.BLACK, 4.5, lower=2)
        entries["chosen path"] = {"color": style.BLACK, "linewidth": 4.5}
    scene.lines(list(tree.edges[tree.air]), style.RED, 1.3)
    scene.lines(list(tree.edges[~tree.air]), style.PURPLE, 1.6)
    entries["obstacle"] = _ball(style.DETECTED)
    return _finished(scene, title, (start, goal, world.goal_radius), "start (root)", entries)


def plot_position(
    times: Array,
    positions: Array,
    references: Array,
    *,
    zone: float = 0.8,
    title: str = "",
    elevations: Array | float = 0.0,
) -> Figure:
    """Draw x, y, z (N, 3) over time (N,), executed and reference (paper, Figs. 7 and 10).

    `zone` (m) is half the height of the transition zone: a band in z, and the time spent inside it in every panel.
    `elevations` (N,) are those of the surface at the vehicle, m.
    """
    labels = ("x (m)", "y (m)", "z (m)")
    heights = positions[:, 2], elevations
    figure = _histories(title, times, labels, positions, references, heights, zone)
    figure.axes[2].axhspan(-zone, zone, alpha=0.22, **_ZONE)
    if isinstance(elevations, np.ndarray):
        figure.axes[2].plot(times, elevations, color=style.BLUE, linewidth=1.0)
    else:
        figure.axes[2].axhline(elevations, color=style.BLUE, linewidth=1.0)
    return figure


def plot_weather(times: Array, winds: Array, waters: Array, elevations: Array, *, title: str = "") -> Figure:
    """Draw wind and water velocities (N, 3) in m/s and the surface's elevation (N,) in m at the vehicle over time."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(style.FONTS):
        figure = Figure(figsize=(WIDTH, 5.6), dpi=style.DOTS_PER_INCH, layout="constrained")
        figure.suptitle(title)
        panels = figure.subplots(3, 1, sharex=True)
        axes = (("x", style.RED, "-"), ("y", style.BLUE, "--"), ("z", style.BLACK, ":"))
        for panel, label, velocity in zip(panels, ("wind (m/s)", "water (m/s)"), (winds, waters), strict=False):
            for (axis, colour, dashes), values in zip(axes, velocity.T, strict=True):
                panel.plot(times, values, color=colour, linestyle=dashes, linewidth=1.6, label=axis)
            panel.set_ylabel(label)
        panels[2].plot(times, elevations, color=style.BLUE, linewidth=1.6)
        panels[2].set(ylabel="surface (m)", xlabel="time (s)", xlim=(times[0], times[-1]))
        for panel in panels:
            panel.grid(color="#e6e6e6", linewidth=0.6)
        figure.align_ylabels(panels)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return figure


def plot_attitude(
    times: Array,
    attitudes: Array,
    references: Array,
    heights: Array,
    *,
    zone: float = 0.8,
    title: str = "",
    elevations: Array | float = 0.0,
) -> Figure:
    """Draw roll, pitch and yaw (N, 3) in rad over time (N,), executed and reference (paper, Figs. 8 and 11).

    A reference is what the control laws track, NaN where a law has none. `heights` (N,) and half the height of the
    transition `zone`, in m, tell when the vehicle is inside it; with `elevations` (N,) when it crosses the surface.
    """
    yaw = np.unwrap(attitudes[:, 2])
    nearest = yaw + (references[:, 2] - yaw + np.pi) % (2.0 * np.pi) - np.pi
    executed = np.degrees(np.column_stack((attitudes[:, :2], yaw)))
    wanted = np.degrees(np.column_stack((references[:, :2], nearest)))
    labels = ("roll φ (°)", "pitch θ (°)", "yaw ψ (°)")
    figure = _histories(title, times, labels, executed, wanted, (heights, elevations), zone)
    for panel in figure.axes:
        low, high = panel.get_ylim()
        if high - low < _LEAST_ANGLE_RANGE:
            panel.set_ylim(0.5 * (low + high - _LEAST_ANGLE_RANGE), 0.5 * (low + high + _LEAST_ANGLE_RANGE))
    return figure


def _histories(
    title: str,
    times: Array,
    labels: Sequence[str],
    executed: Array,
    references: Array,
    heights: tuple[Array, Array | float],
    zone: float,
) -> Figure:
    """Return three panels over time, executed red, reference dotted black, with the time in the zone and crossings.

    `heights` (m) are the vehicle's and the surface's.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    air, inside = in_air(heights[0] - heights[1]), np.abs(heights[0]) <= zone
    crossings = times[1:][air[1:] != air[:-1]]
    with rc_context(style.FONTS):
        figure = Figure(figsize=(WIDTH, 6.4), dpi=style.DOTS_PER_INCH, layout="constrained")
        figure.suptitle(title)
        panels = figure.subplots(3, 1, sharex=True)
        for panel, label, flown, sent in zip(panels, labels, executed.T, references.T, strict=True):
            panel.plot(times, flown, **_EXECUTED)
            panel.plot(times, sent, **_REFERENCE)
            panel.set_ylabel(label)
            panel.grid(color="#e6e6e6", linewidth=0.6)
            panel.set_axisbelow(True)
            panel.fill_between(times, 0.0, 1.0, inside, transform=panel.get_xaxis_transform(), alpha=0.22, **_ZONE)
            for time in crossings:
                panel.axvline(time, **_CROSSING)
        panels[-1].set(xlabel="time (s)", xlim=(times[0], times[-1]))
        figure.align_ylabels(panels)
        lines = {"executed": _EXECUTED, "reference": _REFERENCE, "crossing": _CROSSING}
        handles: list[Any] = [Line2D([], [], label=label, **look) for label, look in lines.items()]
        handles.insert(2, Patch(alpha=0.35, label="transition zone", **_ZONE))
        figure.legend(
            handles=handles[: 4 if len(crossings) else 3], loc="outside lower center", ncols=4, frameon=False, **_CLOSE
        )
    return figure


def _finished(
    scene: Scene, title: str, ends: tuple[Sequence[float], Sequence[float], float], start: str, entries: dict[str, Look]
) -> Figure:
    """Mark start, goal and the radius of arrival; put a title above, and below a legend: entries, then all marks."""
    from matplotlib import rc_context
    from matplotlib.lines import Line2D

    scene.mark(ends[0], "o", style.BLACK, 10, start)
    scene.circle(ends[1], ends[2], style.PURPLE)
    scene.mark(ends[1], "X", style.PURPLE, 10, "goal")
    handles = [Line2D([], [], label=label, **look) for label, look in entries.items()]
    handles += [line for line in scene.axes.lines if line.get_label() and not line.get_label().startswith("_")]
    ring: Look = {"markerfacecolor": "none", "markeredgecolor": style.PURPLE, "markeredgewidth": 1.4}
    handles.append(
        Line2D([], [], label=f"arrival ({ends[2]:g} m)", marker="o", markersize=13, linestyle="none", **ring)
    )
    columns = 4 if scene.figure.get_figwidth() >= WIDE else 2
    look: Look = {"ncols": columns, "frameon": False, "columnspacing": 1.4, "handlelength": 1.6}
    with rc_context(style.FONTS):
        scene.figure.legend(handles=handles, loc="lower center", **look)
        scene.figure.suptitle(title, y=0.975, wrap=True)
    return scene.figure


def _ball(shades: tuple[str, str]) -> Look:
    look = {"linestyle": "none", "marker": "o", "markersize": 12, "markeredgecolor": "#888888"}
    return {**look, "markerfacecolor": shades[0]}
