"""Figures in three dimensions: the executed path in its world (paper, Figs. 6 and 9) and a planner's tree (Fig. 5).

Functions take arrays in SI units and return Matplotlib figures; `save_figure` writes them as PNG and PDF. Matplotlib is
imported when the first figure is drawn, and no display is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering import style
from hydrone_gym.rendering.camera import side_azimuth
from hydrone_gym.rendering.paths import crossing_points, dash, split_media
from hydrone_gym.rendering.scene3d import Scene
from hydrone_gym.rendering.track import Tree
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BOX = World()  # that of the paper's experiments
Array = NDArray[np.float64]
FORMATS = ("png", "pdf")
_DASH, _GAP = 0.3, 0.21  # m: a path under water


def plot_path(
    positions: Array,
    goal: Sequence[float],
    detected: Array,
    undetected: Array,
    *,
    lower: tuple[float, float, float] = _BOX.lower,
    upper: tuple[float, float, float] = _BOX.upper,
    title: str = "",
) -> Figure:
    """Draw an executed path in its world (paper, Figs. 6 and 9).

    Args:
        positions: (N, 3) m, in order of time; solid in air, dashed under water.
        goal: (3,) m.
        detected, undetected: (k, BODY) obstacles, black and faint.
        lower, upper: corners of the world, m.
        title: shown above.
    """
    scene = Scene(lower, upper, azimuth=side_azimuth(positions[0], goal))
    scene.obstacles(undetected, style.FAINT, alpha=0.55)
    scene.obstacles(detected, style.DETECTED)
    air, water = split_media(positions)
    scene.lines(air, style.RED, 2.8, hidden=0.5)
    scene.lines([piece for line in water for piece in dash(line, _DASH, _GAP)], style.RED, 2.8, hidden=0.5)
    for number, point in enumerate(crossing_points(positions)):
        scene.ring(point, "" if number else "crossing of the surface")
    scene.mark(positions[0], "o", style.BLACK, 10, "start")
    scene.mark(np.asarray(goal), "X", style.PURPLE, 14, "goal")
    entries = (
        ("path in air", {"color": style.RED, "linewidth": 2.8}, air),
        ("path under water", {"color": style.RED, "linewidth": 2.8, "linestyle": (0, (1.6, 1.1))}, water),
        ("detected obstacle", _ball(style.DETECTED), True),
        ("undetected obstacle", _ball(style.FAINT), len(undetected)),
    )
    _legend(scene, title, [(label, look) for label, look, there in entries if there])
    return scene.figure


def plot_tree(tree: Tree, scenario: Scenario, world: World, *, title: str = "") -> Figure:
    """Draw a planner's tree with every obstacle known (paper, Fig. 5).

    Args:
        tree: edges in air red, those under water purple, the path to the goal black.
        scenario, world: where it was grown.
        title: shown above.
    """
    start, goal = scenario.start[:3], scenario.goal
    scene = Scene(world.lower, world.upper, azimuth=side_azimuth(start, goal))
    scene.obstacles(scenario.obstacles, style.DETECTED)
    entries = [
        ("branch in air", {"color": style.RED, "linewidth": 2.0}),
        ("branch under water", {"color": style.PURPLE, "linewidth": 2.0}),
        ("obstacle", _ball(style.DETECTED)),
    ]
    if len(tree.path):  # beneath the branches, which keep their colour
        solution = tree.edges[tree.path]
        scene.lines([np.concatenate((solution[:1, 0], solution[:, 1]))], style.BLACK, 4.5, lower=2)
        entries.insert(2, ("chosen path", {"color": style.BLACK, "linewidth": 4.5}))
    scene.lines(list(tree.edges[tree.air]), style.RED, 1.3)
    scene.lines(list(tree.edges[~tree.air]), style.PURPLE, 1.6)
    scene.mark(np.asarray(start), "o", style.BLACK, 10, "start (root)")
    scene.mark(np.asarray(goal), "X", style.PURPLE, 14, "goal")
    _legend(scene, title, entries)
    return scene.figure


def save_figure(figure: Figure, path: str | Path) -> list[Path]:
    """Write a figure beside `path` (no suffix) as PNG and PDF; return both paths. The folder must exist."""
    written = [Path(f"{path}.{suffix}") for suffix in FORMATS]
    for target in written:
        # no date inside, so equal flights give equal files
        dateless = {"CreationDate": None} if target.suffix == ".pdf" else None
        figure.savefig(target, dpi=style.DOTS_PER_INCH, metadata=dateless)
    return written


def _legend(scene: Scene, title: str, entries: list[tuple[str, dict[str, Any]]]) -> None:
    """Put a title and a legend below the scene: the entries, then every mark that has a label."""
    from matplotlib import rc_context
    from matplotlib.lines import Line2D

    marks = [line for line in scene.axes.lines if not str(line.get_label()).startswith("_") and line.get_label()]
    handles = [Line2D([], [], label=label, **look) for label, look in entries]
    with rc_context(style.FONTS):
        scene.figure.legend(
            handles=[*handles, *marks], loc="lower center", ncols=4, frameon=False, columnspacing=1.4, handlelength=1.6
        )
        scene.figure.suptitle(title, y=0.975)


def _ball(shades: tuple[str, str]) -> dict[str, Any]:
    look = {"linestyle": "none", "marker": "o", "markersize": 12, "markeredgecolor": "#888888"}
    return {**look, "markerfacecolor": shades[0]}
