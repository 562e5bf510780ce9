"""What a replay page shows, as nodes of a viser scene: what stands still, and what moves with the moment.

Three.js draws translucent nodes in the order of their origins, the farthest first, and what is hidden by one drawn
before it is not drawn at all. So every translucent node has its origin in its middle, each side of the water is a node
of its own, and unknown obstacles are two: those under water, in its middle, and those in the air.
"""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from hydrone_gym.rendering import shapes, style
from hydrone_gym.rendering.outdoors import Outdoors, barbed
from hydrone_gym.rendering.solids import CAPSULE
from hydrone_gym.rendering.track import Moment, Tree
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import UNIT, belt, mesh, placed
from hydrone_gym.world.world import World

VEHICLE_SCALE = 3.0  # times its true size
GRID = 5.0  # m between the lines on the floor
UNKNOWN, DETECTED = style.GLASS[0], "#2b2b2b"
_SAND, _LINES, _ARM, _ROTOR = "#ded0ad", "#8b98a5", "#10283a", "#9fb2c2"
_GONE = 1e-6  # scale of an obstacle that is not there; 0 would leave it without normals
_CHUNK = 20  # ticks of the path in one node: only the last one is sent anew at every tick
_FINE = 128.0  # steps a metre in the vertices of trees: round numbers make small pages
_GLASS = 0.5  # opacity
_SHADELESS = {"cast_shadow": False, "receive_shadow": False}
_THICK = 0.02  # half of a disc
_RECTANGLE = np.array([(0, 1, 2), (0, 2, 3)])


class Mesh(NamedTuple):
    """A surface of triangles, seen from outside."""

    vertices: NDArray[np.float64]  # (n, 3) m
    faces: NDArray[np.int64]  # (m, 3) vertices, counter-clockwise

    @classmethod
    def joined(cls, *meshes: "Mesh") -> Self:
        """Return several meshes as one."""
        counts = np.cumsum([0, *(len(part.vertices) for part in meshes)])
        faces = [part.faces + first for part, first in zip(meshes, counts)]
        return cls(np.concatenate([part.vertices for part in meshes]), np.concatenate(faces))


class Stage:
    """A mission as a viser scene: it begins with all that stands still, and with what moves where it begins."""

    def __init__(self, scene: Any, moment: Moment, simulation: Simulation) -> None:
        self._scene, self._world = scene, simulation.world
        self._middles, self._sizes = placed(moment.obstacles)
        self._vehicle = scene.add_frame("/vehicle", show_axes=False)
        for name, colour in (("frame", _ARM), ("front", style.RED), ("rotors", _ROTOR)):
            self._mesh(f"/vehicle/{name}", model(shapes.MODEL[name], simulation.vehicle.arm * VEHICLE_SCALE), colour)
        self._reference = self._mesh("/reference", ball(0.14, rings=8), style.BLACK)
        (_, _, bottom), (_, _, top) = self._world.lower, self._world.upper
        x, y, _ = 0.5 * np.add(self._world.lower, self._world.upper)
        # on top of the box it is in view and in nobody's way
        self._label = scene.add_label("/label", "", position=(x, y, top), anchor="center-center", font_screen_scale=1.2)
        self._plumb = self._lines("/plumb", np.zeros((1, 2, 3)), "#5d6f7d", 1.0)
        self._trees: dict[str, Any] = {}
        self._path: Any = None
        self._add_marks(moment, self._world)
        self._add_box(self._world)
        self._add_water(self._world)
        self._weather: dict[str, Any] = {}
        dry = in_air(self._middles[:, 2])
        groups = (
            ("detected", dry | True, True, None),
            ("unknown, under water", ~dry, False, (x, y, 0.5 * bottom)),
            ("unknown, in the air", dry, False, (x, y, 0.5 * top)),
        )
        self._obstacles = [
            (self._bodies(f"/obstacles/{name}", chosen, origin), chosen, known)
            for name, chosen, known, origin in groups
            if chosen.any()
        ]

    def show(self, moment: Moment) -> None:
        """Move to a moment; to be called for every tick in order."""
        state, reference = moment.ticks[-1, :12], moment.ticks[-1, 12:15]
        turn = Rotation.from_euler("ZXY", state[[5, 3, 4]])
        self._vehicle.position, self._vehicle.wxyz = state[:3], turn.as_quat(scalar_first=True)
        self._reference.position = reference
        outdoors = moment.outdoors(self._world)
        self._plumb.points = np.stack((state[:3], (*state[:2], outdoors.level if outdoors else 0.0)))[None]
        self._label.text = ", ".join(moment.words(self._world.zone) + ((outdoors.words,) if outdoors else ()))
        if outdoors is not None:
            self._blow(outdoors)
        self._grow(moment.ticks[:, :3])
        for bodies, chosen, known in self._obstacles:
            scales = np.where(moment.detected == known, self._sizes, _GONE)
            bodies.batched_scales = scales[chosen].astype(np.float32)

    def _blow(self, now: Outdoors) -> None:
        """Show the weather of a moment."""
        waves = np.stack((now.waves[:, :-1], now.waves[:, 1:]), axis=2).reshape(-1, 2, 3)
        for name, edges, colour, width in (
            ("/weather/waves", waves, style.BLUE, 1.0),
            ("/weather/wind", barbed(now.wind), style.BLACK, 3.0),
            ("/weather/current", barbed(now.current), style.BLUE, 3.0),
        ):
            if not len(edges):
                continue
            points = np.round(_FINE * edges) / _FINE
            if name in self._weather:
                self._weather[name].points = points.astype(np.float32)
            else:
                self._weather[name] = self._lines(name, points, colour, width)

    def plan(self, tree: Tree) -> None:
        """Show the tree of a period, and the path in it."""
        edges, followed = np.round(_FINE * tree.edges) / _FINE, np.zeros(len(tree.edges), bool)
        followed[tree.path] = True
        for name, chosen, colour, width in (
            ("/tree/air", tree.air & ~followed, style.RED, 1.0),
            ("/tree/water", ~tree.air & ~followed, style.PURPLE, 1.0),
            ("/tree/plan", followed, style.BLACK, 2.0),
        ):
            # three.js cannot draw no edges: without one, what is there is not seen
            points = edges[chosen] if chosen.any() else np.zeros((1, 2, 3))
            if name in self._trees:
                self._trees[name].points = points.astype(np.float32)
            else:
                self._trees[name] = self._lines(name, points, colour, width)
            self._trees[name].visible = bool(chosen.any())

    def _grow(self, path: NDArray[np.float64]) -> None:
        """Add the last tick to the path."""
        first = max(len(path) - 2, 0) // _CHUNK * _CHUNK
        edges = np.stack((path[first:-1], path[first + 1 :]), axis=1)
        if len(edges) == 1:
            self._path = self._lines(f"/path/{first}", edges, style.RED, 4.0)
        elif len(edges):
            self._path.points = edges.astype(np.float32)

    def _add_marks(self, moment: Moment, world: World) -> None:
        """Add start and goal, each with a line to the surface."""
        start, goal = moment.ticks[0, :3], moment.goal
        self._mesh("/start", ball(0.2, start, rings=8), style.BLACK)
        self._mesh("/goal/middle", ball(0.2, goal, rings=8), style.PURPLE)
        feet = np.stack((start, start * [1.0, 1.0, 0.0], goal, goal * [1.0, 1.0, 0.0])).reshape(2, 2, 3)
        self._lines("/goal/plumb", feet[1:], style.PURPLE, 1.0)
        self._lines("/start/plumb", feet[:1], "#5d6f7d", 1.0)
        self._mesh("/goal/reach", ball(world.goal_radius, goal), style.PURPLE, opacity=0.35)

    def _add_box(self, world: World) -> None:
        """Add the box and its floor."""
        (x0, y0, z0), (x1, y1, _) = world.lower, world.upper
        self._mesh("/box/floor", slab(z0 - 0.02, world.lower, world.upper), _SAND, side="double")
        sides = [side.vertices for side in walls(world.lower, world.upper, z0, world.upper[2])]
        edges = np.concatenate([np.stack((side, np.roll(side, -1, axis=0)), axis=1) for side in sides])
        self._lines("/box/edges", edges, _LINES, 1.5)  # those that stand are there twice
        across = [[(x, y0, z0), (x, y1, z0)] for x in np.arange(x0, x1 + 0.5 * GRID, GRID)]
        along = [[(x0, y, z0), (x1, y, z0)] for y in np.arange(y0, y1 + 0.5 * GRID, GRID)]
        self._lines("/box/grid", np.array(across + along), _LINES, 1.0)

    def _add_water(self, world: World) -> None:
        """Add water, surface and transition zone."""
        lower, upper, zone = world.lower, world.upper, world.zone
        self._mesh("/water/surface", slab(0.0, lower, upper), style.WATER, opacity=0.40, side="double")
        for name, (low, high), colour, opacity in (
            ("water/side", (lower[2], -zone), style.WATER, 0.20),
            ("water/transition zone, below", (-zone, 0.0), style.BLUE, 0.25),
            ("water/transition zone, above", (0.0, zone), style.BLUE, 0.12),
        ):
            for k, wall in enumerate(walls(lower, upper, low, high)):
                self._mesh(f"/{name} {k}", wall, colour, opacity=opacity, side="double")

    def _bodies(self, name: str, chosen: NDArray[np.bool_], origin: tuple[float, float, float] | None) -> Any:
        """Add some of the obstacles, none of them there yet; with an origin (m) they are glass."""
        count, middle = int(chosen.sum()), np.array(origin or (0.0, 0.0, 0.0))
        place = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)), self._middles[chosen] - middle
        look: dict[str, Any] = {"batched_colors": style.rgb(UNKNOWN if origin else DETECTED), "lod": "off"}
        look |= {"batched_scales": np.full(count, _GONE), "position": middle, "opacity": origin and _GLASS}
        return self._scene.add_batched_meshes_simple(name, *mesh(UNIT), *place, **look, **_SHADELESS)

    def _mesh(self, name: str, part: Mesh, colour: str, *, opacity: float | None = None, side: str = "front") -> Any:
        """Add a mesh; one that is translucent has its origin in its middle."""
        middle = np.zeros(3) if opacity is None else part.vertices.mean(axis=0)
        look = {"color": style.rgb(colour), "opacity": opacity, "side": side, **_SHADELESS}
        return self._scene.add_mesh_simple(name, part.vertices - middle, part.faces, position=middle, **look)

    def _lines(self, name: str, points: NDArray[np.float64], colour: str, width: float) -> Any:
        """Add edges (n, 2, 3), so many pixels wide."""
        return self._scene.add_line_segments(name, points, style.rgb(colour), thickness=width, thickness_units="screen")


def ball(radius: float, centre: ArrayLike = (0.0, 0.0, 0.0), rings: int = 16) -> Mesh:
    """Return a sphere (m)."""
    vertices, faces = mesh(UNIT, rings)
    return Mesh(np.array(centre) + radius * vertices, faces)


def rod(start: ArrayLike, end: ArrayLike, radius: float, sections: int = 12) -> Mesh:
    """Return a cylinder from one point to another (m), closed at both ends."""
    a, b = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    forward = (b - a) / np.linalg.norm(b - a)
    right = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
    right /= np.linalg.norm(right)
    turns = np.linspace(0.0, 2.0 * np.pi, sections, endpoint=False)[:, None]
    circle = radius * (np.cos(turns) * right + np.sin(turns) * np.cross(forward, right))
    return Mesh(np.concatenate((a + 0.0 * circle, a + circle, b + circle, b + 0.0 * circle)), belt(3, sections))


def slab(z: float, lower: ArrayLike, upper: ArrayLike) -> Mesh:
    """Return a level rectangle at height z between two corners of a box (m)."""
    (x0, y0, _), (x1, y1, _) = np.array(lower), np.array(upper)
    return Mesh(np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)]), _RECTANGLE)


def walls(lower: ArrayLike, upper: ArrayLike, low: float, high: float) -> list[Mesh]:
    """Return the four upright sides of a box between two heights (m), seen from outside."""
    floor, top = slab(low, lower, upper).vertices, slab(high, lower, upper).vertices
    return [Mesh(np.array([floor[k - 1], floor[k], top[k], top[k - 1]]), _RECTANGLE) for k in (1, 2, 3, 0)]


def model(rows: NDArray[np.float64], size: float) -> Mesh:
    """Return capsules and discs of the ray caster as rods, so many times as large."""
    a, b, discs = size * rows[:, 1:4], size * rows[:, 4:7], rows[:, :1] != CAPSULE
    starts, ends = np.where(discs, a - _THICK * b, a), np.where(discs, a + _THICK * b, b)
    return Mesh.joined(*(rod(*each, 20) for each in zip(starts, ends, size * rows[:, 7])))
