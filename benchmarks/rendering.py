"""Pictures a CPU second at the end of a flight; and the pictures and the film of docs/rendering.md.

python -m benchmarks.rendering
python -m benchmarks.rendering --pictures
"""

import dataclasses
from typing import Any

import gymnasium as gym
import tyro
from PIL import Image
from rich.console import Console

import hydrone_gym  # noqa: F401  (registers the environments)
from benchmarks import freeze_suites, tables
from benchmarks.timing import ROOT, Contestant, in_turns, save
from hydrone_gym.evaluation import Flight, fly
from hydrone_gym.rendering.camera import View
from hydrone_gym.rendering.frame import Painter
from hydrone_gym.rendering.track import moment_of, moments
from hydrone_gym.rendering.video import frames, save_film
from planners import CLRRT
from planners.named import clrrt_weather

DENSE = {"num_obstacles": 40, "obstacle_radius": freeze_suites.DENSE}
SCENES: dict[str, tuple[dict[str, Any], View]] = {
    "640 x 480, 20 spheres": ({}, View()),
    "640 x 480, 40 large spheres": (DENSE, View()),
    "640 x 480, 20 spheres, chase": ({}, View(camera="chase")),
    "320 x 240, 20 spheres": ({}, View(size=(320, 240))),
}
TICKS = 10  # pictures a call
IMAGES = ROOT / "docs" / "images"
PICTURES = {"frame.png": ("overview", 315), "frame-chase.png": ("chase", 105)}  # camera, ticks flown


@dataclasses.dataclass
class Settings:
    rounds: int = 15
    """Turns for each scene."""
    seconds: float = 0.5
    """CPU seconds a turn."""
    pictures: bool = False
    """Draw docs/images/frame*.png and weather-2.gif instead."""


def flown(seed: int, options: dict[str, Any]) -> tuple[gym.Env, Flight]:
    """A flight from air into water, by the CL-RRT."""
    env = gym.make("HydroneGym/AirToWater-v0", **options)
    return env, fly(env, CLRRT.for_env(env), seed=seed)


def scene(name: str) -> Contestant:
    """Pictures of the end of a flight, one a tick, as a film has them."""
    options, view = SCENES[name]
    env, flight = flown(12, options)
    painter = Painter(view, env.unwrapped.world, env.unwrapped.vehicle)  # type: ignore[attr-defined]
    last = moment_of(flight)
    counts = range(len(last.ticks) - TICKS + 1, len(last.ticks) + 1)
    shown = list(moments(last, counts, env.unwrapped.world.sensor_range))  # type: ignore[attr-defined]

    def run() -> float:
        for moment in shown:
            painter.paint(moment)
        return len(shown)

    return Contestant(name, run)


def draw() -> None:
    """Write the pictures and the film of docs/rendering.md."""
    env, flight = flown(5, DENSE)
    world, vehicle = env.unwrapped.world, env.unwrapped.vehicle  # type: ignore[attr-defined]
    for name, (camera, ticks) in PICTURES.items():
        (moment,) = moments(moment_of(flight), [ticks], world.sensor_range)
        picture = Painter(View(camera=camera), world, vehicle).paint(moment)
        Image.fromarray(picture).save(IMAGES / name, optimize=True)
    env = gym.make("HydroneGym/AirToWater-v0", weather=2, controller="robust")
    flight, world = fly(env, clrrt_weather(env), seed=12), env.unwrapped.world  # type: ignore[attr-defined]
    save_film(frames(flight, size=(800, 500), every=3, world=world), IMAGES / "weather-2.gif", fps=12.5)


def main(settings: Settings) -> None:
    if settings.pictures:
        draw()
        return
    contestants = [scene(name) for name in SCENES]
    in_turns(contestants, settings.rounds, settings.seconds)
    measured = {entry.name: {"rate": entry.rate, "spread": entry.spread} for entry in contestants}
    save("rendering", "python -m benchmarks.rendering", {"measured": measured})
    Console().print(tables.rendering(measured))


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
