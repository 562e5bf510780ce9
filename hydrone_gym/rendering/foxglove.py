"""A flight as MCAP, a file of timed messages that Foxglove and Rerun play: Foxglove's own messages, as Protobuf.

| topic | message | when |
|---|---|---|
| `/vehicle` | `foxglove.FrameTransform` from `world` to `vehicle` | every tick |
| `/reference` | `foxglove.PoseInFrame`, the moving reference | every tick |
| `/goal` | `foxglove.PoseInFrame` | at the start |
| `/scene` | `foxglove.SceneUpdate`: vehicle, box, water, goal, obstacles, path | at the start, and what has changed |
| `/tree` | `foxglove.SceneUpdate`: the planner's tree | every period of a flight with trees |
| `/weather/wind`, `/weather/water` | `foxglove.Vector3`, m/s, around the vehicle | every tick, in weather |
| `/weather/surface` | `foxglove.PoseInFrame`: the surface above or below the vehicle | every tick, in weather |
| `/weather/scene` | `foxglove.SceneUpdate`: arrows of wind and current, lines on the surface | every tick, in weather |

Messages are written down here as the JSON that Protobuf takes, a field that has no value left out.
"""

from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from hydrone_gym._whole_file import whole
from hydrone_gym.rendering import shapes, style
from hydrone_gym.rendering.outdoors import Outdoors, barbed
from hydrone_gym.rendering.stage import DETECTED, UNKNOWN, VEHICLE_SCALE, Mesh, model, walls
from hydrone_gym.rendering.track import CONDITIONS_AT, Flown, Moment, Tree, moment_of, moments
from hydrone_gym.simulation.conditions import weather_at
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.world.bodies import placed
from hydrone_gym.world.world import World

_POSE_IN_FRAME, _SCENE_UPDATE = "PoseInFrame", "SceneUpdate"
_TOPICS = {
    "/vehicle": "FrameTransform",
    "/reference": _POSE_IN_FRAME,
    "/goal": _POSE_IN_FRAME,
    "/scene": _SCENE_UPDATE,
    "/tree": _SCENE_UPDATE,
    "/weather/wind": "Vector3",
    "/weather/water": "Vector3",
    "/weather/surface": _POSE_IN_FRAME,
    "/weather/scene": _SCENE_UPDATE,
}
_TIMELESS = {"/weather/wind": "wind", "/weather/water": "water"}  # topics of messages without a time of their own
_SECOND = 1_000_000_000  # ns
_STRIP, _LOOP, _LIST = 0, 1, 2  # what lines connect: one point to the next, all of them in a ring, or every two
_GLASS = 0.5  # opacity
_DIGITS = 3  # of a metre, where only the eye reads them
_LEVEL, _NOWHERE = Rotation.identity(), (0.0, 0.0, 0.0)
_Message = dict[str, Any]
_Entities = Iterator[tuple[str, _Message]]  # names, and what they are made of


def load_mcap() -> Any:
    """Return the module mcap_protobuf.writer; DependencyNotInstalled without the extra `mcap`."""
    try:
        return import_module("mcap_protobuf.writer")
    except ImportError as error:
        raise DependencyNotInstalled(
            'MCAP files need mcap-protobuf-support, part of the extra "mcap": pip install "hydrone-gym[mcap]"'
        ) from error


def write_mcap(
    flight: Flown, simulation: Simulation, path: str | Path, *, title: str, trees: Sequence[Tree] = ()
) -> None:
    """Write a flight as MCAP, its start at time 0; DependencyNotInstalled without the extra `mcap`.

    Args:
        flight: from `hydrone_gym.evaluation.fly`.
        simulation: that of the environment it was flown in.
        path: the file; its folder must exist, else FileNotFoundError.
        title: kept in the file's metadata, with outcome and time (s).
        trees: what `planners.TreeRecorder` kept, one a period; empty for a flight without trees.
    """
    file, writing = Path(path).absolute(), load_mcap()
    if not file.parent.is_dir():
        raise FileNotFoundError(f"the folder of the MCAP file does not exist: {file.parent}")
    parsed = import_module("google.protobuf.json_format").ParseDict
    modules = {kind: import_module(f"foxglove_schemas_protobuf.{kind}_pb2") for kind in set(_TOPICS.values())}
    with whole(file) as part, part.open("wb") as stream, writing.Writer(stream) as writer:
        for time, topic, message in _messages(flight, simulation, trees):
            made = parsed(message, getattr(modules[_TOPICS[topic]], _TOPICS[topic])())
            writer.write_message(topic, made, log_time=time, publish_time=time)
        about = {"title": title, "outcome": flight.outcome.name, "time": f"{flight.time:g}"}
        writer.add_metadata("flight", about)


def _messages(flight: Flown, simulation: Simulation, trees: Sequence[Tree]) -> Iterator[tuple[int, str, _Message]]:
    """Yield what there is to tell of a flight, tick by tick: time in ns, topic, message."""
    last, world, before = moment_of(flight), simulation.world, None
    for now in moments(last, range(1, len(last.ticks) + 1), world.sensor_range):
        tick = len(now.ticks) - 1
        period, within = divmod(tick, simulation.ticks)
        time = round(_SECOND * float(flight.trace.times[tick]))
        stamp = f"{np.datetime64(time, 'ns')}Z"
        for topic, message in _moving(now):
            yield time, topic, message if topic in _TIMELESS else {"timestamp": stamp, **message}
        entities = [] if before else [*_standing(now, simulation)]
        entities += [*_detected(now, before), *_flown(now, simulation.ticks)]
        if entities:
            yield time, "/scene", _update(stamp, entities)
        if not within and period < len(trees):
            yield time, "/tree", _update(stamp, [("tree", {"lines": _branches(trees[period])})])
        if (outdoors := now.outdoors(world)) is not None:
            yield time, "/weather/scene", _update(stamp, [("weather", {"lines": _blowing(outdoors)})])
        before = now


def _moving(now: Moment) -> Iterator[tuple[str, _Message]]:
    """Yield where the vehicle and its reference are and what moves around it, topic and message without its time."""
    state, reference = now.ticks[-1, :12], now.ticks[-1, 12:16]
    frames = {"parent_frame_id": "world", "child_frame_id": "vehicle"}
    turn = Rotation.from_euler("ZXY", state[[5, 3, 4]])
    yield "/vehicle", {**frames, "translation": _xyz(state[:3]), "rotation": _xyzw(turn)}
    yield "/reference", {"frame_id": "world", "pose": _pose(reference[:3], Rotation.from_euler("Z", reference[3]))}
    if len(now.ticks) == 1:
        yield "/goal", {"frame_id": "world", "pose": _pose(now.goal)}
    if (conditions := now.ticks[-1:, CONDITIONS_AT:]).size:
        around = weather_at(conditions, 1, 1)
        for topic, name in _TIMELESS.items():
            yield topic, _xyz(around[name][0])
        surface = (state[0], state[1], around["elevation"][0])
        yield "/weather/surface", {"frame_id": "world", "pose": _pose(surface)}


def _standing(now: Moment, simulation: Simulation) -> _Entities:
    """Yield what never changes; the vehicle goes where its frame goes."""
    world, size = simulation.world, simulation.vehicle.arm * VEHICLE_SCALE
    colours = {"frame": style.BLACK, "front": style.RED, "rotors": UNKNOWN}
    yield "vehicle", {"triangles": [_mesh(model(shapes.MODEL[name], size), colour) for name, colour in colours.items()]}
    (_, _, bottom), (_, _, top) = world.lower, world.upper
    sides = walls(world.lower, world.upper, bottom, top)
    yield "box", {"lines": [_line(side.vertices, UNKNOWN, _LOOP) for side in sides]}
    water, zone = _slab(world, bottom, 0.0, style.WATER), _slab(world, -world.zone, world.zone, style.BLUE)
    yield "water", {"cubes": [water, zone]}
    yield "goal", {"spheres": [_sphere(now.goal, world.goal_radius, style.PURPLE, _GLASS)]}


def _detected(now: Moment, before: Moment | None) -> _Entities:
    """Yield the obstacles that look otherwise than a tick before."""
    for k, (middle, radius) in enumerate(zip(*placed(now.obstacles), strict=True)):
        known = now.detected[k]
        if before is None or before.detected[k] != known:
            look = (DETECTED, 1.0) if known else (UNKNOWN, _GLASS)
            yield f"obstacle {k}", {"spheres": [_sphere(middle, radius, *look)]}


def _flown(now: Moment, ticks: int) -> _Entities:
    """Yield the path of a period that ends, of so many ticks."""
    count = len(now.ticks) - 1
    if count and (count % ticks == 0 or now.outcome):
        period = (count - 1) // ticks
        yield f"path {period}", {"lines": [_line(now.ticks[period * ticks :, :3], style.RED, _STRIP)]}


def _branches(tree: Tree) -> list[_Message]:
    """Return a tree as lines: in the air, under water, and its path to the goal."""
    followed = np.zeros(len(tree.edges), bool)
    followed[tree.path] = True
    groups = ((tree.air & ~followed, style.RED), (~tree.air & ~followed, style.PURPLE), (followed, style.BLACK))
    return [_line(tree.edges[chosen], colour, _LIST) for chosen, colour in groups]


def _blowing(now: Outdoors) -> list[_Message]:
    """Return an arrow each for wind and current, and the lines on the surface."""
    arrows = [_line(barbed(now.wind), style.BLACK, _LIST), _line(barbed(now.current), style.BLUE, _LIST)]
    return arrows + [_line(wave, style.BLUE, _STRIP) for wave in now.waves]


def _update(stamp: str, entities: Iterable[tuple[str, _Message]]) -> _Message:
    """Return entities, names and what they are made of, as a message; each replaces the one of its name."""
    places = {"vehicle": {"frame_id": "vehicle", "frame_locked": True}}
    still = {"frame_id": "world", "frame_locked": False}
    named = [{"timestamp": stamp, **places.get(name, still), "id": name, **parts} for name, parts in entities]
    return {"entities": named}


def _slab(world: World, low: float, high: float, colour: str) -> _Message:
    """Return all of the box between two heights (m)."""
    (x0, y0, _), (x1, y1, _) = world.lower, world.upper
    middle, size = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (low + high)), (x1 - x0, y1 - y0, high - low)
    return {"pose": _pose(middle), "size": _xyz(size), "color": _colour(colour, 0.5 * _GLASS)}


def _sphere(middle: ArrayLike, radius: float, colour: str, opacity: float) -> _Message:
    return {"pose": _pose(middle), "size": _xyz(np.full(3, 2.0 * radius)), "color": _colour(colour, opacity)}


def _line(points: ArrayLike, colour: str, kind: int) -> _Message:
    """Return lines through points (…, 3), two pixels wide."""
    look = {"type": kind, "pose": _pose(_NOWHERE), "thickness": 2.0, "scale_invariant": True}
    return {**look, "points": _points(points), "color": _colour(colour)}


def _mesh(part: Mesh, colour: str) -> _Message:
    faces = part.faces.ravel().tolist()
    drawn = {"points": _points(part.vertices), "color": _colour(colour), "indices": faces}
    return {"pose": _pose(_NOWHERE), **drawn}


def _pose(position: ArrayLike, turn: Rotation = _LEVEL) -> _Message:
    return {"position": _xyz(position), "orientation": _xyzw(turn)}


def _points(points: ArrayLike) -> list[_Message]:
    return [_xyz(point) for point in np.asarray(points, dtype=np.float64).round(_DIGITS).reshape(-1, 3)]


def _xyz(vector: ArrayLike) -> _Message:
    return dict(zip("xyz", np.asarray(vector, dtype=np.float64).tolist(), strict=True))


def _xyzw(turn: Rotation) -> _Message:
    return dict(zip("xyzw", turn.as_quat().tolist(), strict=True))


def _colour(colour: str, opacity: float = 1.0) -> _Message:
    return dict(zip("rgba", (*style.rgb(colour), opacity), strict=True))
