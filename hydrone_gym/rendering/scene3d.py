"""The 3-D scene: box, water surface, spheres, paths and marks, painted in the order an eye above the water needs.

Matplotlib paints whole objects, nearest last by a guess that fails for large planes. Here the order is explicit: what
lies under water, then the surface, then what lies above it; within each half far before near.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering import style
from hydrone_gym.rendering.spheres import camera_axes, sphere_outlines

if TYPE_CHECKING:
    from matplotlib.collections import Collection
    from matplotlib.figure import Figure

_UNDER, _SURFACE, _ABOVE, _TOP = 1000.0, 2000.0, 3000.0, 4000.0  # paint order
_BINS = 40  # a path is painted in this many slices of depth
_PIECE = 0.25  # m: longest piece of a path that lies in one slice


class Scene:
    """A box of the world drawn from one side, to which objects are added.

    Args:
        lower, upper: corners of the box, m.
        elevation, azimuth: where the camera stands, degrees; it must look down on the water.
    """

    def __init__(
        self,
        lower: tuple[float, float, float],
        upper: tuple[float, float, float],
        elevation: float = 20.0,
        azimuth: float = -60.0,
    ) -> None:
        """Make the figure, its axes and the water surface."""
        import mpl_toolkits.mplot3d  # noqa: F401  (registers the projection)
        from matplotlib import rc_context
        from matplotlib.figure import Figure

        self.camera = camera_axes(elevation, azimuth)
        self._lower, self._upper = np.array(lower), np.array(upper)
        self._centre = 0.5 * (self._lower + self._upper)
        self._reach = float(np.linalg.norm(self._upper - self._lower))
        with rc_context(style.FONTS):
            self.figure: Figure = Figure(figsize=(7.6, 6.4), dpi=style.DOTS_PER_INCH)
            self.axes: Any = self.figure.add_axes((0.01, 0.09, 0.97, 0.89), projection="3d", computed_zorder=False)
        self._frame(elevation, azimuth)
        self._surface()

    def _frame(self, elevation: float, azimuth: float) -> None:
        """Camera, limits, equal scale on all axes, labels and a quiet background."""
        ax = self.axes
        ax.set_proj_type("ortho")
        ax.view_init(elev=elevation, azim=azimuth)
        ax.set(xlim=(self._lower[0], self._upper[0]), ylim=(self._lower[1], self._upper[1]))
        ax.set_zlim(self._lower[2], self._upper[2])
        ax.set_box_aspect(self._upper - self._lower, zoom=1.16)
        ax.set_xlabel("x (m)", labelpad=8)
        ax.set_ylabel("y (m)", labelpad=8)
        ax.set_zlabel("z (m)", labelpad=2)
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
            axis._axinfo["grid"].update(color=(0.88, 0.88, 0.88, 1.0), linewidth=0.6)
            axis.set_major_locator(_every_five())

    def _surface(self) -> None:
        """The translucent water surface z = 0."""
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        (x0, y0, _), (x1, y1, _) = self._lower, self._upper
        corners = [[(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)]]
        face = _rgba(style.WATER, 0.30)
        plane = Poly3DCollection(corners, facecolors=[face], edgecolors=[_rgba(style.BLUE, 0.5)], linewidths=0.8)
        plane.set_zorder(_SURFACE)
        self._add(plane)

    def _add(self, collection: Collection) -> None:
        """Add a collection; what reaches beyond the axes' rectangle is drawn too."""
        collection.set_clip_on(False)
        self.axes.add_collection3d(collection, autolim=False)

    def _order(self, point: NDArray[np.float64], above: bool) -> float:
        """Paint order of something at a point: nearer to the eye is later."""
        nearness = float((point - self._centre) @ self.camera[2]) / self._reach + 0.5
        return (_ABOVE if above else _UNDER) + 900.0 * min(max(nearness, 0.0), 1.0)

    def spheres(self, obstacles: NDArray[np.float64], shades: tuple[str, str], alpha: float = 1.0) -> None:
        """Add spheres (M, 4) x, y, z, r in m, shaded from the darkest to the lightest of two colours."""
        for x, y, z, r in obstacles:
            centre = np.array([x, y, z])
            if z - r < 0.0:
                self._sphere(centre, r, shades, alpha, False)
            if z + r > 0.0:
                self._sphere(centre, r, shades, alpha, True)

    def _sphere(
        self, centre: NDArray[np.float64], radius: float, shades: tuple[str, str], alpha: float, above: bool
    ) -> None:
        """Add one sphere, or only what of it rises above the water."""
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        polygons = sphere_outlines(centre, radius, self.camera, above)
        dark, light = np.array(_rgba(shades[0], alpha)), np.array(_rgba(shades[1], alpha))
        shares = np.linspace(0.0, 1.0, max(len(polygons), 2))[: len(polygons), None]
        faces = (1.0 - shares) * dark + shares * light
        edges = np.zeros_like(faces)
        edges[0] = _rgba("#888888", alpha)
        ball = Poly3DCollection(polygons, facecolors=faces, edgecolors=edges, linewidths=0.5)
        ball.set_zorder(self._order(centre, above))
        self._add(ball)

    def lines(
        self, polylines: list[NDArray[np.float64]], colour: str, width: float, hidden: float = 0.0, lower: int = 0
    ) -> None:
        """Add polylines, each (n, 3) in m.

        `hidden` is the opacity with which parts behind spheres shine through. `lower` puts a wide line beneath the thin
        ones along it, by so many slices of depth.
        """
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        pieces = [piece for line in polylines for piece in _pieces(np.asarray(line, dtype=np.float64))]
        if not pieces:
            return
        middles = np.array([piece.mean(axis=0) for piece in pieces])
        above = middles[:, 2] > 0.0
        order = np.array([self._order(middle, up) for middle, up in zip(middles, above, strict=True)])
        slices = np.floor(order / (900.0 / _BINS)).astype(int)
        for number in np.unique(slices):
            chosen = np.flatnonzero(slices == number)
            part = Line3DCollection([pieces[i] for i in chosen], colors=[colour], linewidths=width)
            part.set_capstyle("round")
            part.set_zorder((number - lower) * (900.0 / _BINS))
            self._add(part)
        if hidden > 0.0:
            ghost = Line3DCollection(polylines, colors=[_rgba(colour, hidden)], linewidths=0.6 * width)
            ghost.set_zorder(_TOP - 100.0)
            self._add(ghost)

    def mark(self, point: NDArray[np.float64], symbol: str, colour: str, size: float, label: str) -> None:
        """Add a mark at a point (3,) in m, never hidden; X and + are strokes, other symbols are filled discs."""
        stroke = symbol in "xX+"
        edge = "white" if not stroke or symbol == "X" else colour
        self.axes.plot(
            *[[value] for value in point],
            linestyle="none",
            marker=symbol,
            markersize=size,
            markerfacecolor=colour,
            markeredgecolor=edge,
            markeredgewidth=1.0,
            label=label,
            zorder=_TOP,
        )

    def ring(self, point: NDArray[np.float64], label: str) -> None:
        """Mark a crossing of the surface at a point (3,) in m with an open ring."""
        self.axes.plot(
            *[[value] for value in point],
            linestyle="none",
            marker="o",
            markersize=11,
            markerfacecolor="none",
            markeredgecolor=style.BLUE,
            markeredgewidth=2.2,
            label=label,
            zorder=_TOP - 1.0,
        )


def _every_five() -> Any:
    from matplotlib.ticker import MultipleLocator

    return MultipleLocator(5.0)


def _rgba(colour: str, alpha: float) -> tuple[float, float, float, float]:
    from matplotlib.colors import to_rgba

    return to_rgba(colour, alpha)


def _pieces(line: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Cut a polyline (n, 3) into consecutive pieces about `_PIECE` long that share their ends, and at the surface."""
    if len(line) < 2:
        return []
    line = split_at_surface(line)
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))
    count = max(int(np.ceil(along[-1] / _PIECE)), 1)
    sections = np.floor(along * count / max(along[-1], 1e-12) + 1e-9).astype(int)
    wet = line[:-1, 2] + line[1:, 2] < 0.0
    change = (np.diff(sections[:-1]) != 0) | (np.diff(wet.astype(int)) != 0)
    cuts = [0, *(np.flatnonzero(change) + 1).tolist(), len(line) - 1]
    return [line[first : last + 1] for first, last in itertools.pairwise(cuts) if last > first]


def split_at_surface(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a polyline (n, 3) with a point added on z = 0 wherever it crosses the surface."""
    before, after = line[:-1], line[1:]
    crossing = np.flatnonzero(before[:, 2] * after[:, 2] < 0.0)
    share = (before[crossing, 2] / (before[crossing, 2] - after[crossing, 2]))[:, None]
    points = before[crossing] + share * (after[crossing] - before[crossing])
    points[:, 2] = 0.0
    return np.insert(line, crossing + 1, points, axis=0)
