"""What the messages of `hydrone_gym.rendering.foxglove` hold, as JSON schemas.

Those that begin with `foxglove.` are Foxglove's own, known by name; https://docs.foxglove.dev/docs/sdk/schemas tells
what each field means.
"""

from typing import Any

Schema = dict[str, Any]


def _object(title: str, fields: dict[str, Schema]) -> Schema:
    """Return the schema of an object that must have these fields."""
    return {"title": title, "type": "object", "properties": fields, "required": list(fields)}


def _list(of: Schema) -> Schema:
    return {"type": "array", "items": of}


_NUMBER, _INTEGER, _FLAG, _TEXT = ({"type": kind} for kind in ("number", "integer", "boolean", "string"))
_COUNT = {**_INTEGER, "minimum": 0}
_NSEC = {**_COUNT, "maximum": 999_999_999}
_TIME = _object("time", {"sec": _COUNT, "nsec": _NSEC})
_DURATION = _object("duration", {"sec": _INTEGER, "nsec": _NSEC})
_VECTOR = _object("foxglove.Vector3", dict.fromkeys("xyz", _NUMBER))
_POINTS = _list(_object("foxglove.Point3", dict.fromkeys("xyz", _NUMBER)))
_QUATERNION = _object("foxglove.Quaternion", dict.fromkeys("xyzw", _NUMBER))
_POSE = _object("foxglove.Pose", {"position": _VECTOR, "orientation": _QUATERNION})
_COLOUR = _object("foxglove.Color", dict.fromkeys("rgba", _NUMBER))
_COLOURED = {"color": _COLOUR, "colors": _list(_COLOUR), "indices": _list(_COUNT)}
_SOLID = {"pose": _POSE, "size": _VECTOR, "color": _COLOUR}
_ARROW = dict.fromkeys(("shaft_length", "shaft_diameter", "head_length", "head_diameter"), _NUMBER)
_WRITTEN = {"pose": _POSE, "billboard": _FLAG, "font_size": _NUMBER, "scale_invariant": _FLAG}
_MODEL = {"pose": _POSE, "scale": _VECTOR, "color": _COLOUR, "override_color": _FLAG, "url": _TEXT, "media_type": _TEXT}
_BYTES = {"type": "string", "contentEncoding": "base64"}
_LINE = {"type": _INTEGER, "pose": _POSE, "thickness": _NUMBER, "scale_invariant": _FLAG, "points": _POINTS}
#: what an entity of a scene is made of
PRIMITIVES: dict[str, Schema] = {
    "arrows": _object("foxglove.ArrowPrimitive", {"pose": _POSE, **_ARROW, "color": _COLOUR}),
    "cubes": _object("foxglove.CubePrimitive", _SOLID),
    "spheres": _object("foxglove.SpherePrimitive", _SOLID),
    "cylinders": _object("foxglove.CylinderPrimitive", {**_SOLID, "bottom_scale": _NUMBER, "top_scale": _NUMBER}),
    "lines": _object("foxglove.LinePrimitive", {**_LINE, **_COLOURED}),
    "triangles": _object("foxglove.TriangleListPrimitive", {"pose": _POSE, "points": _POINTS, **_COLOURED}),
    "texts": _object("foxglove.TextPrimitive", {**_WRITTEN, "color": _COLOUR, "text": _TEXT}),
    "models": _object("foxglove.ModelPrimitive", {**_MODEL, "data": _BYTES}),
}
_METADATA = _object("foxglove.KeyValuePair", {"key": _TEXT, "value": _TEXT})
_NAMED = {"timestamp": _TIME, "frame_id": _TEXT, "id": _TEXT, "lifetime": _DURATION, "frame_locked": _FLAG}
_MADE_OF = {kind: _list(primitive) for kind, primitive in PRIMITIVES.items()}
_ENTITY = _object("foxglove.SceneEntity", {**_NAMED, "metadata": _list(_METADATA), **_MADE_OF})
_DELETION = _object("foxglove.SceneEntityDeletion", {"timestamp": _TIME, "type": _INTEGER, "id": _TEXT})
_FRAMES = {"timestamp": _TIME, "parent_frame_id": _TEXT, "child_frame_id": _TEXT}

FRAME_TRANSFORM = _object("foxglove.FrameTransform", {**_FRAMES, "translation": _VECTOR, "rotation": _QUATERNION})
POSE_IN_FRAME = _object("foxglove.PoseInFrame", {"timestamp": _TIME, "frame_id": _TEXT, "pose": _POSE})
SCENE_UPDATE = _object("foxglove.SceneUpdate", {"deletions": _list(_DELETION), "entities": _list(_ENTITY)})
#: wind and water around the vehicle in m/s, and how high the surface is there in m
WEATHER = _object("hydrone_gym.Weather", {"timestamp": _TIME, "wind": _VECTOR, "water": _VECTOR, "elevation": _NUMBER})
