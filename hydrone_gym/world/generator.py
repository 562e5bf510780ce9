"""Seeded random scenarios: the law they are drawn by, the draw itself, and the proof that each can be flown.

A draw costs microseconds, because a batch of environments resets thousands of times a second: blocks of uniform numbers
from the generator go to one kernel that places ends and spheres and tries a few simple routes. Only a scenario without
such a route is searched with a flood fill over a coarse grid.
"""

import functools
import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.world.scenario import Scenario, check_end
from hydrone_gym.world.solvability import flight_space, has_grid_route, has_simple_route
from hydrone_gym.world.world import World

WALL_MARGIN = 1.0  # m from a random end to the walls
ZONE_MARGIN = 0.5  # m from a random end to the transition zone
ATTEMPTS = 100  # scenarios drawn before a law is called unsolvable
MOST_NUMBERS = 64  # one attempt gives up after this many times the usual count of uniform numbers
MEDIA = ("air", "water")

# What `place` returns.
NO_ENDS, NO_SPHERES, NO_SIMPLE_ROUTE, SIMPLE_ROUTE = range(4)

DRAW = np.dtype(
    [
        ("water_share", "f8", 2),  # probability of water, for start and goal
        ("low", "f8", (2, 2, 3)),  # end, medium, axis: the boxes in which the ends are drawn; a fixed end is a point
        ("high", "f8", (2, 2, 3)),
        ("yaw", "f8"),  # half the range of the start's yaw
        ("separation", "f8"),
        ("clearance", "f8"),
        ("radius", "f8", 2),
    ]
)


@dataclass(frozen=True, kw_only=True)
class ScenarioLaw:
    """What random scenarios are drawn by (paper, Sec. 4: spheres randomly distributed between two ends).

    Raises ValueError for a value out of range, named with its unit.
    """

    num_obstacles: int = 20  # spheres; their centres are uniform in the box, above and under water alike
    obstacle_radius: tuple[float, float] = (0.5, 1.5)  # m, least and greatest, uniform in between
    end_clearance: float = 1.0  # m, beyond the vehicle's radius, that every sphere's surface keeps to start and goal
    start: tuple[float, float, float] | None = None  # m, with null yaw; None to draw it, with any yaw
    goal: tuple[float, float, float] | None = None  # m; None to draw it
    min_separation: float = 8.0  # m between start and goal, at least, where one of them is drawn
    media: tuple[str, str] | None = None  # of start and goal, of `MEDIA`; None: a fair coin for each drawn end

    def __post_init__(self) -> None:
        """Check every field as far as no world is needed; lists become tuples, so that the law stays hashable."""
        count, radius, media = self.num_obstacles, self.obstacle_radius, self.media
        whole = isinstance(count, int | np.integer) and not isinstance(count, bool)
        self._must(whole and count >= 0, "num_obstacles", "a whole number, not negative")
        self._must(_are_numbers(radius, 2), "obstacle_radius", "2 finite numbers (m)")
        self._must(0.0 < radius[0] <= radius[1], "obstacle_radius", "positive and ascending (m)")
        for name in ("end_clearance", "min_separation"):
            value = getattr(self, name)
            self._must(_are_numbers((value,), 1) and value >= 0.0, name, "finite and not negative (m)")
        for name, end in (("start", self.start), ("goal", self.goal)):
            self._must(end is None or _are_numbers(end, 3), name, "3 finite numbers (m)")
        pair = isinstance(media, tuple | list) and len(media) == 2 and all(medium in MEDIA for medium in media)
        self._must(media is None or pair, "media", 'None or a pair of "air" and "water"')
        for name in ("obstacle_radius", "start", "goal", "media"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, tuple(getattr(self, name)))
        for name, end, medium in zip(("start", "goal"), (self.start, self.goal), media or ()):
            if end is not None and (end[2] < 0.0) != (medium == "water"):
                raise ValueError(f"ScenarioLaw.{name} must lie in {medium} as media says, got z = {end[2]!r} m")

    def _must(self, sound: bool, name: str, rule: str) -> None:
        if not sound:
            raise ValueError(f"ScenarioLaw.{name} must be {rule}, got {getattr(self, name)!r}")


def _are_numbers(values: Any, length: int) -> bool:
    """Whether these are so many finite numbers."""
    if not isinstance(values, tuple | list) or len(values) != length or any(isinstance(v, bool) for v in values):
        return False
    return all(isinstance(value, int | float | np.integer | np.floating) and math.isfinite(value) for value in values)


EXPERIMENT_1 = ScenarioLaw(start=(-9.0, -9.0, 8.0), goal=(9.0, 9.0, -3.0))
EXPERIMENT_2 = ScenarioLaw(start=(9.0, -9.0, -3.0), goal=(-9.0, 9.0, 7.0))


@functools.lru_cache(maxsize=64)
def prepare(law: ScenarioLaw, world: World, vehicle_radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Flatten a law in a world, for a vehicle of this radius (m), into the two read-only records that `draw` takes.

    Raises ValueError when the law is impossible in this world: an end where none may be, no room for a drawn end or for
    the greatest sphere, ends that cannot be as far apart.
    """
    space = flight_space(world, vehicle_radius)
    room = min(high - low for low, high in zip(world.lower, world.upper, strict=True))
    if 2.0 * law.obstacle_radius[1] >= room:
        raise ValueError(
            f"ScenarioLaw.obstacle_radius must be less than {room / 2.0:g} m, half the shortest edge of the box, "
            f"got {law.obstacle_radius[1]!r} m"
        )
    record = np.zeros(1, DRAW)
    for end, name in enumerate(("start", "goal")):
        fixed = getattr(law, name)
        if fixed is not None:
            check_end(f"ScenarioLaw.{name}", fixed, world)
            record["low"][0, end] = record["high"][0, end] = fixed
            record["water_share"][0, end] = float(fixed[2] < 0.0)
            continue
        record["water_share"][0, end] = 0.5 if law.media is None else float(law.media[end] == "water")
        for medium in range(2) if law.media is None else (MEDIA.index(law.media[end]),):
            record["low"][0, end, medium], record["high"][0, end, medium] = _room_for_end(name, medium, world)
    record["clearance"] = law.end_clearance + vehicle_radius
    record["radius"] = law.obstacle_radius
    record["yaw"] = math.pi if law.start is None else 0.0
    if law.start is None or law.goal is None:
        record["separation"] = law.min_separation
        _check_separation(law.min_separation, record[0])
    record.flags.writeable = False
    return record, space


def _room_for_end(name: str, medium: int, world: World) -> tuple[list[float], list[float]]:
    """Corners (m) of the part of a medium in which an end may be drawn."""
    low, high = [value + WALL_MARGIN for value in world.lower], [value - WALL_MARGIN for value in world.upper]
    if medium == 0:
        low[2] = world.zone + ZONE_MARGIN
    else:
        high[2] = -world.zone - ZONE_MARGIN
    for axis, least, most in zip("xyz", low, high, strict=True):
        if least > most:
            raise ValueError(
                f"World leaves no room to draw a {name} in {MEDIA[medium]}: {WALL_MARGIN} m from the walls and "
                f"{ZONE_MARGIN} m from the transition zone, {axis} would lie between {least:g} and {most:g} m"
            )
    return low, high


def _check_separation(separation: float, record: np.void) -> None:
    """Raise ValueError when for some pair of media the ends cannot be so far apart (m)."""
    low, high, water = record["low"], record["high"], record["water_share"]
    for start, goal in itertools.product(range(2), repeat=2):
        never = water[0] == 1 - start or water[1] == 1 - goal
        most = float(np.linalg.norm(np.maximum(high[0, start] - low[1, goal], high[1, goal] - low[0, start])))
        if most < separation and not never:
            raise ValueError(
                f"ScenarioLaw.min_separation must be at most {most:.3g} m for a start in {MEDIA[start]} and a goal "
                f"in {MEDIA[goal]} of this world, got {separation!r} m"
            )


@inlined
def _place_ends(law, numbers, start, goal):
    """Draw both ends; returns how many of the uniform numbers were used, or 0 when there were too few."""
    first = 1 if numbers[0] < law.water_share[0] else 0
    second = 1 if numbers[1] < law.water_share[1] else 0
    used = 2
    while used + 7 <= numbers.size:
        apart2 = 0.0
        for axis in range(3):
            low, high = law.low[0, first, axis], law.high[0, first, axis]
            start[axis] = low + numbers[used + axis] * (high - low)
            low, high = law.low[1, second, axis], law.high[1, second, axis]
            goal[axis] = low + numbers[used + 3 + axis] * (high - low)
            apart2 += (goal[axis] - start[axis]) ** 2
        start[3] = law.yaw * (2.0 * numbers[used + 6] - 1.0)
        used += 7
        if apart2 >= law.separation * law.separation:
            return used
    return 0


@kernel
def place(record, space, numbers, start, goal, obstacles):
    """Draw ends and spheres from uniform numbers in [0, 1) and try the simple routes.

    Shapes: record and space (1,) from `prepare`, numbers (K,); start (4,), goal (3,) and obstacles (M, 4) are written.
    Returns NO_ENDS or NO_SPHERES when the numbers ran out, else whether there is a simple route.
    """
    law, box = record[0], space[0]
    used = _place_ends(law, numbers, start, goal)
    if used == 0:
        return NO_ENDS
    x, y, z = box.lower[0], box.lower[1], box.lower[2]
    dx, dy, dz = box.upper[0] - x, box.upper[1] - y, box.upper[2] - z
    placed = 0
    while placed < obstacles.shape[0]:
        if used + 4 > numbers.size:
            return NO_SPHERES
        cx, cy, cz = x + numbers[used] * dx, y + numbers[used + 1] * dy, z + numbers[used + 2] * dz
        radius = law.radius[0] + numbers[used + 3] * (law.radius[1] - law.radius[0])
        used += 4
        reach2 = (radius + law.clearance) ** 2
        to_start2 = (cx - start[0]) ** 2 + (cy - start[1]) ** 2 + (cz - start[2]) ** 2
        to_goal2 = (cx - goal[0]) ** 2 + (cy - goal[1]) ** 2 + (cz - goal[2]) ** 2
        if to_start2 >= reach2 and to_goal2 >= reach2:
            obstacles[placed, 0], obstacles[placed, 1], obstacles[placed, 2], obstacles[placed, 3] = cx, cy, cz, radius
            placed += 1
    return SIMPLE_ROUTE if has_simple_route(space, start, goal, obstacles) else NO_SIMPLE_ROUTE


@kernel
def place_many(record, space, numbers, chosen, starts, goals, obstacles):
    """Place many scenarios at once: line i of `numbers` (k, K) for entry chosen[i] of the three outputs.

    Returns (k,) bool, whether each has a simple route; the others go on with `draw` and the same numbers.
    """
    solved = np.zeros(chosen.size, np.bool_)
    for i in range(chosen.size):
        k = chosen[i]
        solved[i] = place(record, space, numbers[i], starts[k], goals[k], obstacles[k]) == SIMPLE_ROUTE
    return solved


def first_numbers(law: ScenarioLaw) -> int:
    """How many uniform numbers `draw` takes from a generator at a time."""
    return 30 + 5 * law.num_obstacles


def draw(
    law: ScenarioLaw,
    prepared: tuple[np.ndarray, np.ndarray],
    rng: np.random.Generator,
    start: np.ndarray,
    goal: np.ndarray,
    obstacles: np.ndarray,
    first: np.ndarray | None = None,
) -> None:
    """Draw a solvable scenario into arrays: start (4,), goal (3,), obstacles (num_obstacles, 4), float64, contiguous.

    `prepared` comes from `prepare`; `first` holds the `first_numbers` of the generator if those are taken. Raises
    ValueError when there is no room for ends or spheres, or when none of `ATTEMPTS` scenarios was solvable.
    """
    record, space = prepared
    usual = first_numbers(law)
    for attempt in range(ATTEMPTS):
        numbers = first if first is not None and attempt == 0 else rng.random(usual)
        status = place(record, space, numbers, start, goal, obstacles)
        while status <= NO_SPHERES:
            if numbers.size >= MOST_NUMBERS * usual:
                raise ValueError(
                    f"no ends found that are {law.min_separation} m apart: lower ScenarioLaw.min_separation"
                    if status == NO_ENDS
                    else f"no room for {law.num_obstacles} obstacles of radius {law.obstacle_radius} m that keep "
                    f"{law.end_clearance} m beyond the vehicle's radius to start and goal: lower "
                    "ScenarioLaw.end_clearance or num_obstacles"
                )
            # The same beginning is placed again: no state has to survive between the blocks.
            numbers = np.concatenate((numbers, rng.random(numbers.size)))
            status = place(record, space, numbers, start, goal, obstacles)
        if status == SIMPLE_ROUTE or has_grid_route(space, start, goal, obstacles):
            return
    raise ValueError(
        f"no solvable scenario after {ATTEMPTS} attempts: num_obstacles={law.num_obstacles}, "
        f"radius={law.obstacle_radius} m"
    )


def generate(law: ScenarioLaw, world: World, vehicle_radius: float, rng: np.random.Generator) -> Scenario:
    """Draw a random scenario that a vehicle of this radius (m) can solve; equal states of `rng` give equal bits.

    Raises ValueError for a law that is impossible in this world, see `prepare` and `draw`.
    """
    start, goal, obstacles = np.empty(4), np.empty(3), np.empty((law.num_obstacles, 4))
    draw(law, prepare(law, world, vehicle_radius), rng, start, goal, obstacles)
    ends: dict[str, Any] = {"start": start, "goal": goal}
    return Scenario(**ends, obstacles=obstacles)
