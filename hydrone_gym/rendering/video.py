"""A flight as a film: smooth, as flights are known at every tick, and at the speed at which it was flown."""

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from hydrone_gym.rendering.frame import Painter
from hydrone_gym.rendering.moment import Moment, replay
from hydrone_gym.rendering.view import View
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import TICK
from hydrone_gym.vehicle import HYDRONE, Vehicle
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World


class Flown(Protocol):
    """What a film needs of a flight, such as `hydrone_gym.evaluation.fly` returns."""

    @property
    def scenario(self) -> Scenario:
        """What was flown."""

    @property
    def outcome(self) -> Outcome:
        """How it ended."""

    @property
    def time(self) -> float:
        """When it ended, s."""

    @property
    def detected(self) -> NDArray[np.float64]:
        """Spheres detected by then, (k, 4) x, y, z, r in m."""

    @property
    def trace(self) -> Any:
        """Every tick: `states` (N, 12) and `references` (N, 4)."""


def moment_of(flight: Flown) -> Moment:
    """Return the end of a flight as a moment to be drawn."""
    known = {tuple(sphere) for sphere in flight.detected.tolist()}
    obstacles = flight.scenario.obstacles
    return Moment(
        ticks=np.hstack((flight.trace.states, flight.trace.references)),
        goal=np.array(flight.scenario.goal),
        obstacles=obstacles,
        detected=np.array([tuple(sphere) in known for sphere in obstacles.tolist()], dtype=bool),
        time=flight.time,
        outcome=flight.outcome,
    )


def frames(
    flight: Flown,
    *,
    size: tuple[int, int] = (640, 480),
    camera: str = "overview",
    every: int = 1,
    world: World | None = None,
    vehicle: Vehicle = HYDRONE,
) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures (height, width, 3) of a flight, the last of its end.

    Args:
        flight: from `hydrone_gym.evaluation.fly`.
        size, camera: as `render_size` and `camera` of the environments.
        every: ticks of 0.05 s from picture to picture.
        world: the world it was flown in, the default one if None; its sensor range tells when spheres were detected.
        vehicle: the vehicle.

    Raises:
        ValueError: an option out of range.
    """
    if isinstance(every, bool) or not isinstance(every, int) or every < 1:
        raise ValueError(f"every must be a whole number of ticks of at least 1, got {every!r}")
    world = world or World()
    painter = Painter(View(size=size, camera=camera), world, vehicle)
    last = moment_of(flight)
    counts = range(len(last.ticks), 0, -every)[::-1]
    return map(painter.paint, replay(last, counts, world.sensor_range))


def save_film(pictures: Iterable[NDArray[np.uint8]], path: str | Path, *, fps: float = 1.0 / TICK) -> None:
    """Write pictures as an MP4 film.

    Args:
        pictures: (height, width, 3) each, all of one even size, such as `frames` yields.
        path: the file; its folder must exist.
        fps: pictures a second; the default plays those of every tick at the speed of the flight.

    Raises:
        DependencyNotInstalled: without the extra `render`.
        FileNotFoundError: the folder does not exist.
        ValueError: no picture.
    """
    try:
        import imageio_ffmpeg  # type: ignore[import-untyped]
    except ImportError as error:
        raise DependencyNotInstalled(
            'films need imageio-ffmpeg, part of the extra "render": pip install "hydrone-gym[render]"'
        ) from error
    file = Path(path).absolute()
    if not file.parent.is_dir():
        raise FileNotFoundError(f"the folder of the film does not exist: {file.parent}")
    waiting = iter(pictures)
    first = next(waiting, None)
    if first is None:
        raise ValueError("a film must have at least one picture, got none")
    height, width, _ = first.shape
    film = imageio_ffmpeg.write_frames(str(file), (width, height), fps=fps, macro_block_size=2, quality=8)
    film.send(None)
    for picture in itertools.chain((first,), waiting):
        film.send(np.ascontiguousarray(picture))
    film.close()
