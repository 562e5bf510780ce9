"""A flight as a page: one HTML file with a scene in three dimensions and a timeline, opened in any browser, offline."""

import contextlib
import io
import json
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from hydrone_gym._whole_file import whole
from hydrone_gym.rendering import style
from hydrone_gym.rendering.camera import FIELD_OF_VIEW, beside
from hydrone_gym.rendering.stage import DETECTED, GRID, UNKNOWN, VEHICLE_SCALE, Stage
from hydrone_gym.rendering.track import Flown, Moment, Tree, moment_of, moments
from hydrone_gym.simulation.simulation import TICK, Simulation
from hydrone_gym.world.world import World

# width by height of a window, where a camera sees the whole box from, and the point it turns around (m)
_Fitted = tuple[float, NDArray[np.float64], NDArray[np.float64]]
HOLD = 2.0  # s: the end stays in view before the page begins again
_ASPECTS = (0.4, 0.45, 0.5, 0.6, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5)  # width by height of windows
_FLIGHT = (
    ("line", style.RED, "path flown"),
    ("ball", style.BLACK, "moving reference; start"),
    ("ball", style.PURPLE, "goal, and how near counts as there"),
    ("ball", UNKNOWN, "obstacle not known yet"),
    ("ball", DETECTED, "obstacle detected"),
    ("band", style.WATER, "water; darker: transition zone"),
)
_WEATHER = (
    ("line", style.BLACK, "wind at the vehicle, half a metre for 1 m/s"),
    ("line", style.BLUE, "water at the vehicle, 4 m for 1 m/s"),
    ("thin", style.BLUE, "the moving surface"),
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


def load_viser() -> Any:
    """Return the module viser; DependencyNotInstalled without the extra `replay`."""
    try:
        import viser
    except ImportError as error:
        raise DependencyNotInstalled(
            'replay pages need viser, part of the extra "replay": pip install "hydrone-gym[replay]"'
        ) from error
    return viser


def write_replay(
    flight: Flown, simulation: Simulation, path: str | Path, *, title: str, trees: Sequence[Tree] = ()
) -> None:
    """Write a flight as a page that plays as fast as it was flown; DependencyNotInstalled without the extra `replay`.

    Args:
        flight: from `hydrone_gym.evaluation.fly`.
        simulation: that of the environment it was flown in.
        path: the file; its folder must exist, else FileNotFoundError.
        title: of the page.
        trees: what `planners.TreeRecorder` kept, one a period; empty for a flight without trees.
    """
    file, last, viser = Path(path).absolute(), moment_of(flight), load_viser()
    if not file.parent.is_dir():
        raise FileNotFoundError(f"the folder of the page does not exist: {file.parent}")
    poses, trees = _camera_poses(last, simulation.world), trees if any(len(tree.edges) for tree in trees) else ()
    # scenes are made with a server, although nobody connects to it; it tells where it listens
    with contextlib.redirect_stdout(io.StringIO()), contextlib.ExitStack() as stack:
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        stack.callback(server.stop)
        # where a browser begins that may not look at its own shape: in a frame without a file of its own
        _, server.initial_camera.position, server.initial_camera.look_at = poses[-3]
        server.initial_camera.fov = float(np.radians(FIELD_OF_VIEW))
        recording, stage = server.get_scene_serializer(), Stage(server.scene, last, simulation)
        played = moments(last, range(1, len(last.ticks) + 1), simulation.world.sensor_range)
        for tick, moment in enumerate(played):
            if tick % simulation.ticks == 0 and tick // simulation.ticks < len(trees):
                stage.plan(trees[tick // simulation.ticks])
            stage.show(moment)
            recording.insert_sleep(HOLD if moment is last else TICK)
        page = recording.as_html()
    page = _dressed(page, title, last, simulation.world, poses, trees=bool(trees))
    with whole(file) as part:
        part.write_text(page, encoding="utf-8")


def _camera_poses(moment: Moment, world: World) -> list[_Fitted]:
    """Return cameras beside the way from start to goal, for windows from narrow to wide."""
    middle = 0.5 * np.add(world.lower, world.upper)
    poses = [beside(world, moment.ticks[0, :3], moment.goal, aspect) for aspect in _ASPECTS]
    turned = [pose.eye + float((middle - pose.eye) @ pose.forward) * pose.forward for pose in poses]
    return [(aspect, pose.eye, point) for aspect, pose, point in zip(_ASPECTS, poses, turned, strict=True)]


def _dressed(page: str, title: str, last: Moment, world: World, poses: list[_Fitted], *, trees: bool) -> str:
    """Return viser's page with its title (plain text), its legend, and the cameras, from narrow to wide."""
    time, end = last.words(world.zone)
    entries = "".join(
        f'<li><i class="{kind}" style="background:{colour}"></i>{text}</li>'
        for kind, colour, text in (*_FLIGHT, *(_WEATHER if last.outdoors(world) else ()), *(_TREE if trees else ()))
    )
    about = (
        f'<div id="title"><h1>{escape(title)}</h1><p>{end} after {time}</p></div>'
        f'<details id="legend"><summary>Legend</summary><ul>{entries}</ul><p>Lines on the floor every {GRID:g} m; '
        f"vehicle {VEHICLE_SCALE:g} times its size, its front orange. Drag to turn, space to pause.</p></details>"
    )
    places = json.dumps([(aspect, *(",".join(f"{x:.2f}" for x in point) for point in pose)) for aspect, *pose in poses])
    head = f"<style>{_STYLE}</style><script>{_SCRIPT % places}</script></head>"
    page = page.replace("<title>Viser</title>", f"<title>{escape(title)}</title>", 1)
    return page.replace("</head>", head, 1).replace("</body>", f"{about}</body>", 1)
