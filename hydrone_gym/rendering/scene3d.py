"""The 3-D scene: box, water surface, obstacles, paths and marks, painted in the order an eye above the water needs.

Matplotlib paints whole objects, nearest last by a guess that fails for large planes. Here the order is explicit: what
lies under water, then the surface, then what lies above it; within each half far before near.

Obstacles are a few flat polygons: exact outlines under an orthographic camera, small files, crisp in print. A body lit
from direction L is shaded by nested caps, where its surface faces L to within an angle. Each cap, or the part of it
above the water, is convex, so its picture is the convex hull of its projected rim.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull, QhullError

from hydrone_gym.rendering import style
from hydrone_gym.rendering.camera import ELEVATION, axes
from hydrone_gym.rendering.paths import pieces
from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import bounds, section, support

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_UNDER, _SURFACE, _ABOVE, _TOP = 1000.0, 2000.0, 3000.0, 4000.0  # paint order
Array = NDArray[np.float64]
_SLICE = 900.0 / 40.0  # a path is painted in 40 slices of depth
_PIECE = 0.25  # m: longest piece of a path that lies in one slice
# half-angles of the lit caps, all in full view of the camera
_CAPS = np.radians([52.0, 46.0, 40.0, 34.0, 28.0, 22.0, 15.0])
_LIGHT = np.array([-0.35, 0.45, 0.82])  # in camera axes: right, up, towards the eye
WIDTH, WIDE = 7.6, 6.8  # inches: the usual width; the least that has room for four names side by side
_LEGEND, _LEGENDS = 0.58, 1.1  # inches beneath the scene for two lines of names, and for four with numbers above
_RIM = 64  # points round an outline


class Scene:
    """A box of the world between two corners (m), seen from an azimuth (degrees), to which objects are added."""

    def __init__(
        self, lower: Sequence[float], upper: Sequence[float], azimuth: float = -60.0, width: float = WIDTH
    ) -> None:
        from matplotlib import rc_context
        from matplotlib.figure import Figure

        self._thin, self._zoom = width / WIDTH, 1.16 if width >= WIDE else 1.0
        self.camera = axes(azimuth, ELEVATION)
        (x0, y0, _), (x1, y1, _) = box = np.array((lower, upper))
        self._centre, self._reach = box.mean(axis=0), float(np.linalg.norm(box[1] - box[0]))
        with rc_context(style.FONTS):
            beneath = _LEGEND if width >= WIDE else _LEGENDS
            height, legend = 0.766 * width + beneath, beneath / (0.766 * width + beneath)
            self.figure: Figure = Figure(figsize=(width, height), dpi=style.DOTS_PER_INCH)
            place = (0.01, legend, 0.97, 0.98 - legend)
            self.axes: Any = self.figure.add_axes(place, projection="3d", computed_zorder=False)
        self._frame(box, azimuth)
        surface = [[(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)]]
        self._fill(surface, [(style.WATER, 0.30)], [(style.BLUE, 0.5)], 0.8, _SURFACE)

    def _frame(self, box: Array, azimuth: float) -> None:
        """Limits, equal scale on all axes, labels and a quiet background."""
        from matplotlib.ticker import MultipleLocator

        ax = self.axes
        ax.view_init(elev=ELEVATION, azim=azimuth)
        ax.set(proj_type="ortho", xlim=box[:, 0], ylim=box[:, 1], zlim=box[:, 2])
        ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        ax.set_box_aspect(box[1] - box[0], zoom=self._zoom)
        for axis, pad in ((ax.xaxis, 8), (ax.yaxis, 8), (ax.zaxis, 2)):
            axis.labelpad = pad
            axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
            axis._axinfo["grid"].update(color=(0.88, 0.88, 0.88, 1.0), linewidth=0.6)
            axis.set_major_locator(MultipleLocator(5.0))

    def _fill(self, polygons: Any, faces: Any, edges: Any, width: float, order: float) -> None:
        """Add polygons, each (n, 3) in m, their edges so many points wide."""
        from mpl_toolkits.mplot3d.art3d import Poly3DCollection

        look = {"facecolors": faces, "edgecolors": edges, "linewidths": width, "zorder": order}
        self.axes.add_collection3d(Poly3DCollection(polygons, clip_on=False, **look), autolim=False)

    def _stroke(self, lines: list[Array], colour: Any, width: float, order: float) -> None:
        """Add lines, each (n, 3) in m, so many points wide."""
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        look = {"colors": [colour], "linewidths": width * self._thin, "capstyle": "round", "zorder": order}
        self.axes.add_collection3d(Line3DCollection(lines, clip_on=False, **look), autolim=False)

    def _order(self, points: Array, above: Any) -> Array:
        """Paint order of things at points (…, 3): nearer to the eye is later."""
        nearness = (points - self._centre) @ self.camera[2] / self._reach + 0.5
        return np.where(above, _ABOVE, _UNDER) + 900.0 * np.clip(nearness, 0.0, 1.0)

    def obstacles(self, bodies: Array, shades: tuple[str, str], alpha: float = 1.0) -> None:
        """Add obstacles (M, BODY), shaded from the darkest to the lightest of two colours."""
        dark, light = ((*style.rgb(shade), alpha) for shade in shades)
        for body, box in zip(bodies, bounds(bodies), strict=True):
            dry = in_air(box[:, 2])
            for above in np.unique(dry):  # what rises above the water once more, over the surface
                polygons = outlines(body, self.camera, above)
                faces = np.linspace(dark, light, max(len(polygons), 2))[: len(polygons)]
                edges = [("#888888", alpha), *["none"] * (len(polygons) - 1)]
                self._fill(polygons, faces, edges, 0.5, float(self._order(box.mean(axis=0), above)))

    def lines(self, polylines: list[Array], colour: str, width: float, hidden: float = 0.0, lower: int = 0) -> None:
        """Add polylines, each (n, 3) in m.

        `hidden` is the opacity with which what obstacles hide shines through. `lower` puts a wide line beneath the thin
        ones along it, by so many slices of depth.
        """
        parts = [part for line in polylines for part in pieces(np.asarray(line, dtype=np.float64), _PIECE)]
        if not parts:
            return
        middles = np.array([part.mean(axis=0) for part in parts])
        slices = np.floor(self._order(middles, in_air(middles[:, 2])) / _SLICE).astype(int)
        for number in np.unique(slices):
            chosen = [parts[i] for i in np.flatnonzero(slices == number)]
            self._stroke(chosen, colour, width, (number - lower) * _SLICE)
        if hidden > 0.0:
            self._stroke(polylines, (colour, hidden), 0.6 * width, _TOP - 100.0)

    def circle(self, centre: ArrayLike, radius: float, colour: str) -> None:
        """Add the outline of a sphere around a point (3,), radius in m, never hidden."""
        turn = np.linspace(0.0, 2.0 * np.pi, _RIM + 1)[:, None]
        rim = np.asarray(centre) + radius * (np.cos(turn) * self.camera[0] + np.sin(turn) * self.camera[1])
        self._fill([rim], [(colour, 0.18)], [colour], 1.4, _TOP - 2.0)

    def mark(self, point: ArrayLike, symbol: str, colour: str, size: float, label: str, hollow: bool = False) -> None:
        """Add a mark at a point (3,) in m, never hidden; a hollow one is open and lies beneath the others."""
        face, edge, width = ("none", colour, 2.2 * self._thin) if hollow else (colour, "white", self._thin)
        look = {
            "markersize": size * self._thin,
            "markerfacecolor": face,
            "markeredgecolor": edge,
            "markeredgewidth": width,
        }
        x, y, z = np.reshape(point, (3, 1))
        self.axes.plot(x, y, z, symbol, label=label, zorder=_TOP - hollow, **look)


def _rim(axis: Array, half_angle: float) -> Array:
    """Unit directions (n, 3) at an angle (rad) from a unit axis."""
    first = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    turn = np.linspace(0.0, 2.0 * np.pi, _RIM, endpoint=False)[:, None]
    circle = np.cos(turn) * first + np.sin(turn) * np.cross(axis, first)
    return np.cos(half_angle) * axis + np.sin(half_angle) * circle


def outlines(body: Array, camera: Array, above: bool) -> list[Array]:
    """Return the outline of an obstacle (BODY,) and of its lit caps, darkest first, as polygons in the world, (n, 3).

    `camera` is from `camera.axes`; if `above`, only what rises above the water is kept.
    """
    light = _LIGHT / np.linalg.norm(_LIGHT) @ camera
    line, normals = section(body, 0.0, _RIM)
    front = float(bounds(body[None])[0].mean(axis=0) @ camera[2])
    polygons = []
    for level, half_angle in enumerate((0.5 * np.pi, *_CAPS)):
        points = support(body, _rim(light if level else camera[2], half_angle))
        if above:
            inside = (level == 0) | (normals @ light >= np.cos(half_angle))
            points = np.vstack((points[points[:, 2] >= 0.0], line[inside]))
        flat = points @ camera[:2].T
        try:
            corners = flat[ConvexHull(flat).vertices]
        except (QhullError, ValueError):  # nothing of it, or next to nothing
            continue
        # all in one plane that faces the camera, lit caps a hair in front
        depth = np.full((len(corners), 1), front + 1e-3 * level)
        polygons.append(np.hstack((corners, depth)) @ camera)
    return polygons
