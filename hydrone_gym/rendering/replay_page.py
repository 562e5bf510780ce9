"""What a replay page has around its scene: title, legend, and a camera that fits the shape of the window."""

import json
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering import style
from hydrone_gym.rendering.camera import FIELD_OF_VIEW, overview
from hydrone_gym.rendering.caption import describe
from hydrone_gym.rendering.figures import camera_azimuth
from hydrone_gym.rendering.moment import Moment
from hydrone_gym.rendering.stage import DETECTED, GRID, UNKNOWN, VEHICLE_SCALE
from hydrone_gym.world.world import World

_ELEVATION = 20.0  # degrees
_ASPECTS = (0.4, 0.45, 0.5, 0.6, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5)  # width by height of windows
FIELD = float(np.radians(FIELD_OF_VIEW))  # rad, over the height of the window

_FLIGHT = (
    ("line", style.RED, "path flown"),
    ("ball", style.BLACK, "moving reference; start"),
    ("ball", style.PURPLE, "goal, and how near counts as there"),
    ("ball", UNKNOWN, "obstacle not known yet"),
    ("ball", DETECTED, "obstacle detected"),
    ("band", style.WATER, "water; darker: transition zone"),
)
_TREE = (
    ("thin", style.RED, "tree of the planner, in the air"),
    ("thin", style.PURPLE, "the same, under water"),
    ("line", style.BLACK, "its path to the goal"),
)
_STYLE = """
#title, #legend { position: fixed; left: .8em; z-index: 2; font: 12px/1.35 system-ui, sans-serif; color: #1f2d3a;
  background: #ffffffc0; border-radius: 4px; padding: .2em .4em }
#title { top: .6em; max-width: calc(100vw - 3em); font-size: 14px } #title h1 { font-size: 1.15em; margin: 0 }
#legend { bottom: 54px; max-width: min(21em, calc(100vw - 3em)) } #legend summary { cursor: pointer }
#title p, #legend p { margin: 0 } #legend ul { list-style: none; margin: .2em 0; padding: 0 }
#legend li { padding-left: 2.1em; position: relative }
#legend i { position: absolute; left: 0; top: .7em; width: 1.5em; transform: translateY(-50%) }
#legend .line { height: 4px } #legend .thin { height: 2px } #legend .band { height: .8em; opacity: .6 }
#legend .ball { height: .9em; width: .9em; left: .3em; border-radius: 50% }
"""
_SCRIPT = """
(poses => {
  const query = new URLSearchParams(location.search);
  const fitted = query.get("fitted") !== null;
  if (query.get("initialCameraPosition") === null || fitted) {
    const aspect = innerWidth / Math.max(innerHeight - 45, 1);
    const pose = poses.filter(p => p[0] <= aspect).pop() || poses[0];
    query.set("fitted", ""); query.set("initialCameraPosition", pose[1]); query.set("initialCameraLookAt", pose[2]);
    try { history.replaceState(null, "", "?" + query + location.hash) } catch { }
  }
  addEventListener("DOMContentLoaded", () => {
    document.querySelector("#legend").open = innerHeight >= 600;
  });
})(%s);
"""


class CameraPose(NamedTuple):
    """Where a camera sees the whole box from, in windows of this shape or wider ones."""

    aspect: float  # width by height
    eye: NDArray[np.float64]  # (3,) m
    towards: NDArray[np.float64]  # (3,) m: the point it turns around


def camera_poses(moment: Moment, world: World) -> list[CameraPose]:
    """Return cameras beside the way from start to goal, for windows from narrow to wide."""
    corners = np.array([[x, y, z] for x, y, z in np.ndindex(2, 2, 2)]) * np.subtract(world.upper, world.lower)
    corners += world.lower
    azimuth = camera_azimuth(moment.ticks[0, :3].tolist(), moment.goal.tolist())
    poses = []
    for aspect in _ASPECTS:
        pose = overview(corners, azimuth, _ELEVATION, aspect)
        depth = float((corners.mean(axis=0) - pose.eye) @ pose.forward)
        poses.append(CameraPose(aspect, pose.eye, pose.eye + depth * pose.forward))
    return poses


def dressed(page: str, title: str, last: Moment, world: World, poses: list[CameraPose], *, trees: bool) -> str:
    """Return viser's page with its title, legend and camera.

    Args:
        page: HTML.
        title: of the page, plain text.
        last: the end of the mission.
        world: its world.
        poses: cameras, from narrow to wide.
        trees: whether trees are shown.
    """
    end = describe(last.time, float(last.ticks[-1, 2]), world.zone, last.outcome)[0].split("   ")
    entries = "".join(
        f'<li><i class="{kind}" style="background:{colour}"></i>{text}</li>'
        for kind, colour, text in (*_FLIGHT, *(_TREE if trees else ()))
    )
    about = (
        f'<div id="title"><h1>{escape(title)}</h1><p>{end[1]} after {end[0]}</p></div>'
        f'<details id="legend"><summary>Legend</summary><ul>{entries}</ul><p>Lines on the floor every {GRID:g} m; '
        f"vehicle {VEHICLE_SCALE:g} times its size, its front orange. Drag to turn, space to pause.</p></details>"
    )
    places = json.dumps([(pose.aspect, *(",".join(f"{x:.2f}" for x in place) for place in pose[1:])) for pose in poses])
    head = f"<style>{_STYLE}</style><script>{_SCRIPT % places}</script></head>"
    page = page.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1)
    return page.replace("</head>", head, 1).replace("</body>", f"{about}</body>", 1)
