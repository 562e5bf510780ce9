"""A flight as a film: smooth, as flights are known at every tick, and at the speed at which it was flown."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray
from PIL import Image

from hydrone_gym.rendering.camera import View
from hydrone_gym.rendering.frame import Painter
from hydrone_gym.rendering.track import Flown, moment_of, moments
from hydrone_gym.simulation.simulation import TICK
from hydrone_gym.vehicle import HYDRONE, Vehicle
from hydrone_gym.world.world import World

_COLOURS, _SAMPLES = 255, 6  # of a GIF: colours, and pictures they are chosen from
_NONE = "a film must have at least one picture, got none"
_HOLD = 2000  # ms that a GIF shows its last picture before it begins again


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
    """Write pictures (height, width, 3), all of one even size, such as `frames` yields, as an MP4 film or a GIF.

    `fps` is pictures a second; the default plays those of every tick at the speed of the flight. A path that ends in
    ".gif" gives a GIF of 255 colours, which begins again after two seconds on its last picture; it counts in 10 ms.

    Raises:
        DependencyNotInstalled: for an MP4 film without the extra `render`.
        FileNotFoundError: the folder does not exist.
        ValueError: no picture.
    """
    file = Path(path).absolute()
    if not file.parent.is_dir():
        raise FileNotFoundError(f"the folder of the film does not exist: {file.parent}")
    (_save_gif if file.suffix == ".gif" else _save_mp4)(pictures, file, fps)


def _save_gif(pictures: Iterable[NDArray[np.uint8]], file: Path, fps: float) -> None:
    shown = [Image.fromarray(picture) for picture in pictures]
    if not shown:
        raise ValueError(_NONE)
    samples = [shown[k] for k in np.linspace(0, len(shown) - 1, _SAMPLES).astype(int)]
    # An octree keeps colours that cover few pixels, such as the path's.
    palette = Image.fromarray(np.vstack(list(map(np.asarray, samples)))).quantize(_COLOURS, Image.Quantize.FASTOCTREE)
    first, *rest = (one.quantize(palette=palette, dither=Image.Dither.NONE) for one in shown)
    times = [round(1000.0 / fps)] * len(rest) + [_HOLD]
    first.save(file, save_all=True, append_images=rest, duration=times, loop=0, optimize=True)


def _save_mp4(pictures: Iterable[NDArray[np.uint8]], file: Path, fps: float) -> None:
    try:
        import imageio_ffmpeg  # type: ignore[import-untyped]
    except ImportError as error:
        raise DependencyNotInstalled(
            'films need imageio-ffmpeg, part of the extra "render": pip install "hydrone-gym[render]"'
        ) from error
    film = None
    for picture in pictures:
        if film is None:
            size = picture.shape[1::-1]
            film = imageio_ffmpeg.write_frames(str(file), size, fps=fps, macro_block_size=2, quality=8)
            film.send(None)
        film.send(np.ascontiguousarray(picture))
    if film is None:
        raise ValueError(_NONE)
    film.close()
