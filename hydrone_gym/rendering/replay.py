"""A flight as a page: one HTML file with a scene in three dimensions and a timeline, opened in any browser, offline."""

import contextlib
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from gymnasium.error import DependencyNotInstalled

from hydrone_gym.rendering.moment import Moment, replay
from hydrone_gym.rendering.replay_page import FIELD, camera_poses, dressed
from hydrone_gym.rendering.stage import Stage, Tree
from hydrone_gym.rendering.video import Flown, moment_of
from hydrone_gym.simulation.simulation import TICK, Simulation

HOLD = 2.0  # s: the end stays in view before the page begins again


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
    """Write a flight as a page that plays at the speed at which it was flown.

    Args:
        flight: from `hydrone_gym.evaluation.fly`.
        simulation: that of the environment it was flown in.
        path: the file; its folder must exist.
        title: of the page.
        trees: what `planners.TreeRecorder` kept, one a period; empty for a flight without trees.

    Raises:
        DependencyNotInstalled: without the extra `replay`.
        FileNotFoundError: the folder does not exist.
    """
    file, last = Path(path).absolute(), moment_of(flight)
    if not file.parent.is_dir():
        raise FileNotFoundError(f"the folder of the page does not exist: {file.parent}")
    poses, trees = camera_poses(last, simulation.world), trees if any(len(tree.edges) for tree in trees) else ()
    with _server() as server:
        # where a browser begins that may not look at its own shape: in a frame without a file of its own
        _, server.initial_camera.position, server.initial_camera.look_at = poses[-3]
        server.initial_camera.fov = FIELD
        recording = server.get_scene_serializer()
        _record(recording, Stage(server.scene, last, simulation), last, simulation, trees)
        page = recording.as_html()
    file.write_text(dressed(page, title, last, simulation.world, poses, trees=bool(trees)), encoding="utf-8")


@contextlib.contextmanager
def _server() -> Iterator[Any]:
    """Yield a viser server: scenes are made with one, although nobody connects to it."""
    viser = load_viser()
    with contextlib.redirect_stdout(io.StringIO()):  # it tells where it listens
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        try:
            yield server
        finally:
            server.stop()


def _record(recording: Any, stage: Stage, last: Moment, simulation: Simulation, trees: Sequence[Tree]) -> None:
    """Play the flight on the stage, tick by tick."""
    counts = range(1, len(last.ticks) + 1)
    for tick, moment in enumerate(replay(last, counts, simulation.world.sensor_range)):
        if tick % simulation.ticks == 0 and tick // simulation.ticks < len(trees):
            stage.plan(trees[tick // simulation.ticks])
        stage.show(moment)
        recording.insert_sleep(TICK if tick < len(last.ticks) - 1 else HOLD)
