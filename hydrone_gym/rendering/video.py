"""A flight as a film: smooth, as flights are known at every tick, and at the speed at which it was flown."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from hydrone_gym.rendering.camera import View
from hydrone_gym.rendering.frame import Painter
from hydrone_gym.rendering.track import Flown, moment_of, moments
from hydrone_gym.simulation.simulation import TICK
from hydrone_gym.vehicle import HYDRONE, Vehicle
from hydrone_gym.world.world import World


def frames(
    flight: Flown,
    *,
    size: tuple[int, int] = (640, 480),
    camera: str = "overview",
    every: int = 1,
    world: World | None = None,
    vehicle: Vehicle = HYDRONE,
) -> Iterator[NDArray[np.uint8]]:
    """Yield pictures (height, width, 3) of a flight, the last of its end; ValueError for an option out of range.

    Args:
        flight: from `hydrone_gym.evaluation.fly`.
        size, camera: as `render_size` and `camera` of the environments.
        every: ticks of 0.05 s from picture to picture.
        world: the world it was flown in, the default one if None; its sensor range tells when obstacles were detected.
        vehicle: the vehicle.
    """
    if isinstance(every, bool) or not isinstance(every, int) or every < 1:
        raise ValueError(f"every must be a whole number of ticks of at least 1, got {every!r}")
    world = world or World()
    painter = Painter(View(size=size, camera=camera), world, vehicle)
    last = moment_of(flight)
    counts = range(len(last.ticks), 0, -every)[::-1]
    return map(painter.paint, moments(last, counts, world.sensor_range))


def save_film(pictures: Iterable[NDArray[np.uint8]], path: str | Path, *, fps: float = 1.0 / TICK) -> None:
    """Write pictures (height, width, 3), all of one even size, such as `frames` yields, as an MP4 film.

    `fps` is pictures a second; the default plays those of every tick at the speed of the flight.

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
    film = None
    for picture in pictures:
        if film is None:
            size = picture.shape[1::-1]
            film = imageio_ffmpeg.write_frames(str(file), size, fps=fps, macro_block_size=2, quality=8)
            film.send(None)
        film.send(np.ascontiguousarray(picture))
    if film is None:
        raise ValueError("a film must have at least one picture, got none")
    film.close()
