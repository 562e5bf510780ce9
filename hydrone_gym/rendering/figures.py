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

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LOWER = (-10.0, -10.0, -5.0)  # m: the box of the paper's experiments
UPPER = (10.0, 10.0, 10.0)
FORMATS = ("png", "pdf")
_DASH, _GAP = 0.3, 0.21  # m: a path under water


def plot_path(
    positions: NDArray[np.float64],
    goal: Sequence[float],
    detected: NDArray[np.float64],
    undetected: NDArray[np.float64],
    *,
    lower: tuple[float, float, float] = LOWER,
    upper: tuple[float, float, float] = UPPER,
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
    crossings = crossing_points(positions)
    for number, point in enumerate(crossings):
        scene.ring(point, "" if number else "crossing of the surface")
    scene.mark(positions[0], "o", style.BLACK, 10, "start")
    scene.mark(np.asarray(goal), "X", style.PURPLE, 14, "goal")
    _legend(scene, title, _path_entries(len(undetected) > 0, bool(air), bool(water)))
    return scene.figure


def plot_tree(
    edges: NDArray[np.float64],
    in_air: NDArray[np.bool_],
    start: Sequence[float],
    goal: Sequence[float],
    obstacles: NDArray[np.float64],
    *,
    solution: NDArray[np.float64] | None = None,
    lower: tuple[float, float, float] = LOWER,
    upper: tuple[float, float, float] = UPPER,
    title: str = "",
) -> Figure:
    """Draw a planner's tree with every obstacle known (paper, Fig. 5).

    Args:
        edges: (E, K, 3) the points of each edge, m, K at least 2.
        in_air: (E,) True for edges in air (red), False for edges under water (purple).
        start, goal: (3,) m, black dot and purple cross.
        obstacles: (M, BODY).
        solution: (N, 3) the chosen path, m, if any.
        lower, upper: corners of the world, m.
        title: shown above.

    Raises:
        ValueError: edges and media that do not match.
    """
    edges, in_air = np.asarray(edges, dtype=np.float64), np.asarray(in_air, dtype=bool)
    if edges.ndim != 3 or edges.shape[1] < 2 or edges.shape[2] != 3 or in_air.shape != edges.shape[:1]:
        raise ValueError(f"edges must be (E, K, 3) with K >= 2 and in_air (E,), got {edges.shape} and {in_air.shape}")
    scene = Scene(lower, upper, azimuth=side_azimuth(start, goal))
    scene.obstacles(obstacles, style.DETECTED)
    if solution is not None:  # beneath the branches, which keep their colour
        scene.lines([np.asarray(solution)], style.BLACK, 4.5, lower=2)
    scene.lines(list(edges[in_air]), style.RED, 1.3)
    scene.lines(list(edges[~in_air]), style.PURPLE, 1.6)
    scene.mark(np.asarray(start), "o", style.BLACK, 10, "start (root)")
    scene.mark(np.asarray(goal), "X", style.PURPLE, 14, "goal")
    entries: list[tuple[str, dict[str, Any]]] = [
        ("branch in air", {"color": style.RED, "linewidth": 2.0}),
        ("branch under water", {"color": style.PURPLE, "linewidth": 2.0}),
        ("obstacle", {**_BALL, "markerfacecolor": style.DETECTED[0]}),
    ]
    if solution is not None:
        entries.insert(2, ("chosen path", {"color": style.BLACK, "linewidth": 4.5}))
    _legend(scene, title, entries)
    return scene.figure


def save_figure(figure: Figure, path: str | Path) -> list[Path]:
    """Write a figure beside `path` (no suffix) as PNG and PDF; return both paths. The folder must exist."""
    written = [Path(f"{path}.{suffix}") for suffix in FORMATS]
    for target in written:
        # no date inside, so equal flights give equal files
        figure.savefig(
            target,
            dpi=style.DOTS_PER_INCH,
            metadata={"CreationDate": None} if target.suffix == ".pdf" else None,
        )
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


_BALL = {"linestyle": "none", "marker": "o", "markersize": 12, "markeredgecolor": "#888888"}


def _path_entries(unknown: bool, air: bool, water: bool) -> list[tuple[str, dict[str, Any]]]:
    entries: list[tuple[str, dict[str, Any]]] = []
    if air:
        entries.append(("path in air", {"color": style.RED, "linewidth": 2.8}))
    if water:
        entries.append(("path under water", {"color": style.RED, "linewidth": 2.8, "linestyle": (0, (1.6, 1.1))}))
    entries.append(("detected obstacle", {**_BALL, "markerfacecolor": style.DETECTED[0]}))
    if unknown:
        entries.append(("undetected obstacle", {**_BALL, "markerfacecolor": style.FAINT[0]}))
    return entries
