"""Worlds of other shapes than those agents train on: more spheres, other sizes, other ends, another vehicle.

`SHAPES` lists them. World `seed` of a shape is one scenario, drawn by the package's generator, and
`gym.make_vec(SHAPED, n, vectorization_mode="vector_entry_point", shape=NAME)` flies worlds `seed + i`. Shapes that
differ only in the number of spheres share missions, and the spheres of the sparser world are in the denser one too,
unless a draw had no way to the goal and was made again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import gymnasium as gym
import numpy as np

from benchmarks.freeze_suites import DENSE
from hydrone_gym.envs.vector_env import HydroneVectorEnv
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.world.generator import (
    EXPERIMENT_1,
    EXPERIMENT_2,
    MEDIA,
    WALL_MARGIN,
    ZONE_MARGIN,
    ScenarioLaw,
    generate,
)
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World

SHAPED = "HydroneBenchmarks/Shaped-v0"
WORLD = World()
RANDOM = ScenarioLaw()
BLOCK, BLOCKS = 512, 1000  # pairs of ends drawn at a time, and how many times before a law is called impossible
_NEAREST = WORLD.zone + ZONE_MARGIN  # m: where random missions may begin and end, as in the generator
_HIGHEST, _DEEPEST = WORLD.upper[2] - WALL_MARGIN, -WORLD.lower[2] - WALL_MARGIN


@dataclass(frozen=True, kw_only=True)
class EndLaw:
    """Random starts and goals that `ScenarioLaw` cannot say, or too rare for it: uniform among those that fit, any yaw.

    Attributes:
        media: those that each end is drawn in, all equally likely.
        air, water: least and greatest distance to the surface in each medium, m.
        wall: least and greatest distance to the nearest side wall, m.
        distance: least and greatest distance between start and goal, m.
        across: the most of it that may be horizontal, m.
    """

    media: tuple[str, ...] = MEDIA
    air: tuple[float, float] = (_NEAREST, _HIGHEST)
    water: tuple[float, float] = (_NEAREST, _DEEPEST)
    wall: tuple[float, float] = (WALL_MARGIN, WORLD.upper[0])
    distance: tuple[float, float] = (RANDOM.min_separation, np.inf)
    across: float = np.inf

    def draw(self, rng: np.random.Generator) -> tuple[list[float], list[float]]:
        """Start (x, y, z in m, yaw in rad) and goal (x, y, z); ValueError if none are found."""
        reach = WORLD.upper[0] - self.wall[0]
        for _ in range(BLOCKS):
            ends = rng.uniform(-reach, reach, (BLOCK, 2, 3))
            share, wet = rng.random((BLOCK, 2)), rng.choice(self.media, (BLOCK, 2)) == "water"
            low, high = (np.where(wet, water, air) for water, air in zip(self.water, self.air, strict=True))
            ends[:, :, 2] = np.where(wet, -1.0, 1.0) * (low + share * (high - low))
            apart = ends[:, 1] - ends[:, 0]
            length, across = np.linalg.norm(apart, axis=1), np.linalg.norm(apart[:, :2], axis=1)
            to_wall = WORLD.upper[0] - np.abs(ends[:, :, :2]).max(axis=2)
            fits = (length >= self.distance[0]) & (length <= self.distance[1]) & (across <= self.across)
            found = np.flatnonzero(fits & (to_wall <= self.wall[1]).all(axis=1))
            if len(found):
                start, goal = ends[found[0]].tolist()
                return [*start, float(rng.uniform(-np.pi, np.pi))], goal
        raise ValueError(f"no ends found in {BLOCK * BLOCKS} draws: {self}")


def _mirrored(end: Any) -> tuple[float, float, float]:
    """The other side of the plane x = 0."""
    x, y, z = end
    return -x, y, z


TRAINED = (RANDOM, EXPERIMENT_1, EXPERIMENT_2)
# The box is symmetric, so the mirrored missions join the other two pairs of corners.
MIRRORED = tuple(
    replace(law, start=_mirrored(law.start), goal=_mirrored(law.goal)) for law in (EXPERIMENT_1, EXPERIMENT_2)
)


@dataclass(frozen=True, kw_only=True)
class Shape:
    """What the worlds of a row are like.

    Attributes:
        group: what kind of change it is.
        name: what tables call it.
        reference: shape it is compared with, which has the same missions or the nearest that agents train on.
        missions: how starts and goals are drawn; world `seed` flies mission `seed % len(missions)`.
        spheres: their number.
        radii: least and greatest radius, m.
        vehicle: parameter set.
        sensor_range: m.
    """

    group: Literal["as in training", "spheres", "starts and goals", "vehicle and sensing"]
    name: str
    reference: str = "as in training"
    missions: Sequence[ScenarioLaw | EndLaw] = TRAINED
    spheres: int = RANDOM.num_obstacles
    radii: tuple[float, float] = RANDOM.obstacle_radius
    vehicle: str = "paper"
    sensor_range: float = WORLD.sensor_range

    @property
    def options(self) -> dict[str, Any]:
        """Keyword options of the environment."""
        return {
            "num_obstacles": self.spheres,
            "obstacle_radius": self.radii,
            "vehicle": self.vehicle,
            "sensor_range": self.sensor_range,
        }

    def scenario(self, seed: int) -> Scenario:
        """The world of a seed; with the generator's own laws it is the one an environment draws from that seed."""
        rng, mission = np.random.default_rng(seed), self.missions[seed % len(self.missions)]
        spheres = {"num_obstacles": self.spheres, "obstacle_radius": self.radii}
        radius = named_vehicle(self.vehicle).radius
        if isinstance(mission, ScenarioLaw):
            return generate(replace(mission, **spheres), WORLD, radius, rng)
        start, goal = mission.draw(rng)
        law = ScenarioLaw(start=tuple(start[:3]), goal=tuple(goal), **spheres)
        return replace(generate(law, WORLD, radius, rng), start=tuple(start))


def _ends(name: str, *missions: ScenarioLaw | EndLaw, reference: str = "random missions") -> Shape:
    """A shape with other starts and goals."""
    return Shape(group="starts and goals", name=name, reference=reference, missions=missions)


SHAPES = {
    shape.name: shape
    for shape in (
        Shape(group="as in training", name="as in training"),
        Shape(group="as in training", name="random missions", missions=(RANDOM,)),
        Shape(group="as in training", name="corner missions", missions=(EXPERIMENT_1, EXPERIMENT_2)),
        Shape(group="spheres", name="no spheres", spheres=0),
        Shape(group="spheres", name="10 spheres", spheres=10),
        Shape(group="spheres", name="30 spheres", spheres=30),
        Shape(group="spheres", name="40 spheres", spheres=40),
        Shape(group="spheres", name="60 spheres", spheres=60),
        Shape(group="spheres", name="60 small spheres", spheres=60, radii=(0.2, 0.5)),
        Shape(group="spheres", name="8 big spheres", spheres=8, radii=(1.5, 2.5)),
        Shape(group="spheres", name="40 larger spheres", spheres=40, radii=DENSE),
        _ends("short", EndLaw(distance=(2.0, 6.0))),
        _ends("long in air", EndLaw(media=("air",), distance=(20.0, np.inf))),
        _ends("long in water", EndLaw(media=("water",), distance=(20.0, np.inf))),
        _ends("straight up or down", EndLaw(across=0.5, distance=(3.0, np.inf))),
        _ends("close to the surface", EndLaw(air=(0.85, 1.25), water=(0.85, 1.25))),
        _ends("close to the walls", EndLaw(wall=(0.4, 0.9))),
        _ends("mirrored corners", *MIRRORED, reference="corner missions"),
        Shape(group="vehicle and sensing", name="physical vehicle", vehicle="physical"),
        Shape(group="vehicle and sensing", name="sensing within 2 m", sensor_range=2.0),
        Shape(group="vehicle and sensing", name="sensing within 5 m", sensor_range=5.0),
    )
}


class ShapedRows(HydroneVectorEnv):
    """The vector environment on the worlds of a shape: row i begins in the world of `seed + i`.

    Args:
        num_envs: number of rows.
        shape: key of `SHAPES`.
    """

    def __init__(self, num_envs: int = 1, *, shape: str) -> None:
        self._shape = SHAPES[shape]
        super().__init__(num_envs, **self._shape.options)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin in the worlds of a seed; rows without one draw any mission with the shape's spheres."""
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else list(seed or ())
        scenarios = [None if each is None else self._shape.scenario(each) for each in seeds]
        return super().reset(seed=seed, options={**(options or {}), "scenario": scenarios or None})


gym.register(id=SHAPED, vector_entry_point=ShapedRows)
