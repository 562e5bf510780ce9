"""The egocentric interface by value: what is seen."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym import HYDRONE, HYDRONE_PHYSICAL, World
from hydrone_gym.envs.spaces import egocentric_space, relative_action_space
from hydrone_gym.perception.egocentric import NAMES, OBSERVATION_SIZE, Egocentric, EgocentricMemory, pack_egocentric
from hydrone_gym.perception.rays import REACH
from hydrone_gym.simulation.simulation import Simulation
from tests.envs.raw_observations import EGO, INDEX, VAST_EGO, WORLD, entry, extreme, random_raw, raw


def free_way(position, direction, spheres, world, radius):
    """Oracle: the first zero of the clearance along a ray, by sphere tracing; the box by its slabs one at a time."""
    walls = [
        ((world.upper if d > 0 else world.lower)[axis] - position[axis]) / d
        for axis, d in enumerate(direction)
        if d != 0.0
    ]
    limit = min(max(min(walls), 0.0), REACH)
    travelled = 0.0
    for _ in range(100_000):
        if travelled >= limit:
            break
        gap = np.linalg.norm(spheres[:, :3] - (position + travelled * direction), axis=1) - spheres[:, 3] - radius
        if gap.min() <= 1e-9:
            return travelled
        travelled += gap.min()
    return limit


def ray_directions(azimuth, state, goal):
    """Oracle: unit vectors of all rays in the order of the table."""
    rays = [
        (math.cos(e) * math.cos(azimuth + a), math.cos(e) * math.sin(azimuth + a), math.sin(e))
        for e in np.radians([-40.0, 0.0, 40.0])
        for a in np.radians(np.arange(0.0, 360.0, 30.0))
    ]
    ways = [goal - state[:3], state[6:9]]
    return np.array([*rays, (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), *(way / np.linalg.norm(way) for way in ways)])


def obvious(raw, start, clock, world=WORLD, radius=HYDRONE.radius):
    """Oracle: the table in the module's docstring, line by line."""
    state, goal = raw["state"], raw["goal"]
    position = state[:3]
    azimuth = math.atan2(goal[1] - start[1], goal[0] - start[0])
    turn = np.array([[math.cos(azimuth), math.sin(azimuth), 0], [-math.sin(azimuth), math.cos(azimuth), 0], [0, 0, 1]])
    offset = goal - position
    distance = np.linalg.norm(offset)
    spheres = raw["obstacles"][raw["obstacles"][:, 3] > 0]
    spheres = spheres if len(spheres) else np.array([[1e6, 0.0, 0.0, 1.0]])
    ahead, left = turn[0], turn[1]

    def wall(direction):
        bounds = np.where(direction > 0, world.upper, world.lower)
        return min((bounds[k] - position[k]) / direction[k] for k in range(3) if direction[k] != 0)

    rays = [
        free_way(position, direction, spheres, world, radius) / 4 for direction in ray_directions(azimuth, state, goal)
    ]
    flat = [
        *(turn @ offset / 5),
        *(turn @ (2 * offset / distance * min(1, distance))),
        position[2] / 3,
        *(turn @ state[6:9]),
        3 * state[3],
        3 * state[4],
        math.sin(state[5] - azimuth),
        math.cos(state[5] - azimuth),
        *(turn @ (raw["reference"][:3] - position)),
        1 if position[2] > 0 else -1,
        abs(position[2]) <= 0.8,
        *(wall(direction) / 5 for direction in (ahead, -ahead, left, -left)),
        (world.upper[2] - position[2]) / 5,
        (position[2] - world.lower[2]) / 5,
        np.hypot(*offset[:2]) / 5,
        abs(offset[2]) / 5,
        *rays,
        clock / 10,
    ]
    return np.clip(flat, -5, 5)


@pytest.mark.parametrize("seed", range(60))
def test_every_entry_is_what_the_table_says(seed):
    rng = np.random.default_rng(seed)
    observation, start = random_raw(rng)
    flat, _ = EGO.observe(observation, EgocentricMemory(start, -1.0, seed - 1.0))
    np.testing.assert_allclose(flat, obvious(observation, start, seed), atol=2e-6)


def test_rays_among_many_spheres_agree_with_sphere_tracing():
    """Spheres near enough that most rays end at one."""
    rng = np.random.default_rng(1)
    rays, free = slice(INDEX["ray_-40_0"], INDEX["ray_velocity"] + 1), []
    for _ in range(30):
        observation, start = random_raw(rng)
        way = rng.normal(size=(20, 3))
        way *= rng.uniform(1.5, 6.0, (20, 1)) / np.linalg.norm(way, axis=1)[:, None]
        observation["obstacles"] = np.column_stack([observation["state"][:3] + way, rng.uniform(0.1, 0.9, 20)])
        flat, _ = EGO.observe(observation, EgocentricMemory(start, -1.0, 0.0))
        np.testing.assert_allclose(flat[rays], obvious(observation, start, 1)[rays], atol=2e-6)
        free += (flat[rays] == 1).tolist()
    assert 0.05 < np.mean(free) < 0.95


@pytest.mark.parametrize("name", NAMES[INDEX["ray_-40_0"] : INDEX["ray_down"] + 1])
def test_a_ray_stops_at_the_inflated_sphere(name):
    """One small sphere 3 m along each ray: it alone sees it nearest, 3 - 0.2 - 0.45 m away."""
    angles = {"up": (90, 0), "down": (-90, 0)}.get(name[4:]) or map(int, name[4:].split("_"))
    elevation, azimuth = map(math.radians, angles)
    frame = math.atan2(3.0, 4.0)
    way = math.cos(elevation) * np.array([math.cos(frame + azimuth), math.sin(frame + azimuth), math.tan(elevation)])
    flat, _ = EGO.observe(raw([0.0, 0.0, 4.5], (8.0, 6.0, 4.5), [*(np.array([0, 0, 4.5]) + 3.0 * way), 0.2]))
    rays = flat[INDEX["ray_-40_0"] : INDEX["ray_goal"]]
    assert entry(flat, name) == pytest.approx((3.0 - 0.65) / 4.0, abs=1e-6)
    assert np.argmin(rays) == INDEX[name] - INDEX["ray_-40_0"]
    assert np.sum(rays < 1.0) == 1


def test_ray_to_the_goal_and_along_the_velocity():
    spheres = [(-1.0, 4.0, 5.0, 0.55), (-4.0, 1.0, 5.0, 0.3)]
    observation = raw([-1.0, 1.0, 5.0, 0, 0, 0, -0.7, 0, 0], (-1.0, 9.0, 5.0), spheres)
    flat, _ = EGO.observe(observation)
    assert entry(flat, "ray_goal") == pytest.approx(2.0 / 4.0)
    assert entry(flat, "ray_velocity") == pytest.approx((3.0 - 0.75) / 4.0)
    observation["state"][6:9] *= 1e-3  # drifting is not going anywhere
    assert entry(EGO.observe(observation)[0], "ray_velocity") == 1.0
    observation["state"][6:9] = 0.0
    observation["goal"] = observation["state"][:3]
    flat, _ = EGO.observe(observation)
    assert entry(flat, "ray_velocity") == 1.0
    assert entry(flat, "ray_goal") == 1.0


def test_inside_an_inflated_sphere_no_way_is_free():
    flat, _ = EGO.observe(raw([1.0, 1.0, 5.0, 0, 0, 0, 1, 0, 0], (8, 1, 5), [1.5, 1.0, 5.0, 0.5]))
    assert not flat[INDEX["ray_-40_0"] : INDEX["clock"]].any()


def test_on_a_wall():
    """The way out is closed, the way along it is open."""
    flat, _ = EGO.observe(raw([10.0, 0.0, 5.0], (0.0, 0.0, 5.0)))  # x' points to -x
    assert entry(flat, "wall_behind") == entry(flat, "ray_+0_180") == 0.0
    assert entry(flat, "wall_ahead") == pytest.approx(4.0)
    assert entry(flat, "wall_left") == entry(flat, "wall_right") == pytest.approx(2.0)
    assert entry(flat, "ray_+0_90") == entry(flat, "ray_+0_270") == entry(flat, "ray_up") == 1.0


def test_medium_and_zone():
    for z, medium, zone in ((0.81, 1, 0), (0.8, 1, 1), (1e-9, 1, 1), (0.0, -1, 1), (-0.8, -1, 1), (-0.81, -1, 0)):
        flat, _ = EGO.observe(raw([0.0, 0.0, z], (5, 0, 5)))
        assert (entry(flat, "medium"), entry(flat, "zone")) == (medium, zone)


def test_a_vertical_mission_falls_back_to_the_world_axes():
    flat, memory = EGO.observe(raw([1.0, 2.0, 6.0, 0, 0, 0.3, 0.5, -0.25, 0], (1.0, 2.0, -3.0)))
    assert entry(flat, "velocity_ahead") == 0.5
    assert entry(flat, "velocity_left") == -0.25
    assert entry(flat, "sin_yaw") == pytest.approx(math.sin(0.3))
    place = EGO.reference([1, 0, 0], raw([1.0, 2.0, 6.0], (1.0, 2.0, -3.0)), memory)
    np.testing.assert_array_equal(place[:3], [3.0, 2.0, 6.0])


def test_the_frame_belongs_to_the_start_not_to_the_moment():
    first = raw([0.0, 0.0, 5.0], (8.0, 0.0, 5.0))
    _, memory = EGO.observe(first)
    later = raw([4.0, 4.0, 5.0, 0, 0, 0, 1, 0, 0], (8.0, 0.0, 5.0))
    flat, _ = EGO.observe(later, memory)
    assert (entry(flat, "velocity_ahead"), entry(flat, "velocity_left")) == (1.0, 0.0)
    flat, _ = EGO.observe(later)
    assert entry(flat, "velocity_left") == pytest.approx(math.sqrt(0.5))


UNIT = st.floats(-1.0, 1.0)


def turned(observation, start, angle):
    """A raw observation and a start, the whole world turned about z."""
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    out = {key: value.copy() for key, value in observation.items()}
    for array in (out["state"][:2], out["state"][6:8], out["reference"][:2], out["goal"][:2]):
        array[:] = turn @ array
    out["state"][5] = math.remainder(out["state"][5] + angle, 2 * math.pi)
    out["obstacles"][:, :2] = out["obstacles"][:, :2] @ turn.T
    return out, np.append(turn @ start[:2], start[2])


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 10_000), st.floats(-math.pi, math.pi))
def test_turning_the_world_changes_nothing(seed, angle):
    """The walls are far away: they alone do not turn with it."""
    rng = np.random.default_rng(seed)
    observation, start = random_raw(rng)
    observation["obstacles"][:, :3] = observation["state"][:3] + rng.uniform(-4.0, 4.0, (20, 3))
    other, other_start = turned(observation, start, angle)
    flat, memory = VAST_EGO.observe(observation, EgocentricMemory(start, 3.0, 4.0))
    turned_flat, turned_memory = VAST_EGO.observe(other, EgocentricMemory(other_start, 3.0, 4.0))
    # A ray that grazes a sphere sees the square root of the rounding.
    np.testing.assert_allclose(turned_flat, flat, atol=2e-6)
    action = rng.uniform(-1.0, 1.0, 3)
    back, _ = turned(
        {**other, "reference": VAST_EGO.reference(action, other, turned_memory).astype(float)}, start, -angle
    )
    np.testing.assert_allclose(back["reference"][:3], VAST_EGO.reference(action, observation, memory)[:3], atol=5e-6)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_quarter_turns_take_the_square_box_along(quarters):
    rng = np.random.default_rng(quarters)
    for _ in range(20):
        observation, start = random_raw(rng)
        other, other_start = turned(observation, start, quarters * math.pi / 2)
        flat, _ = EGO.observe(observation, EgocentricMemory(start, 3.0, 4.0))
        turned_flat, _ = EGO.observe(other, EgocentricMemory(other_start, 3.0, 4.0))
        np.testing.assert_allclose(turned_flat, flat, atol=2e-6)


@pytest.mark.parametrize("seed", range(4))
def test_finite_and_bounded_whatever_the_input(seed):
    n, rng = 20_000, np.random.default_rng(seed)
    batch = {"state": extreme(rng, n, 12), "reference": extreme(rng, n, 4), "goal": extreme(rng, n, 3)}
    batch["obstacles"] = extreme(rng, n, 3, 4)
    for memory in (None, EgocentricMemory(extreme(rng, n, 3), np.full(n, 3.0), np.full(n, 1e300))):
        flat, after = EGO.observe(batch, memory)
        assert np.isfinite(flat).all()
        assert (abs(flat) <= 5.0).all()
        place = EGO.reference(np.tile([1.0, -1.0, 0.3], (n, 1)), batch, after)[:, :3]
        assert (place >= np.array(WORLD.lower) + 0.199).all()
        assert (place <= np.array(WORLD.upper) - 0.199).all()


def test_names_and_spaces():
    assert OBSERVATION_SIZE == len(set(NAMES)) == 68
    assert egocentric_space().shape == (68,)
    assert relative_action_space().shape == (3,)
    assert egocentric_space().dtype == relative_action_space().dtype == np.float32
    places = {"height": 6, "roll": 10, "sin_yaw": 12, "medium": 17, "wall_ahead": 19, "goal_horizontal": 25}
    places |= {"ray_-40_0": 27, "ray_+0_0": 39, "ray_+40_330": 62, "ray_up": 63, "ray_velocity": 66, "clock": 67}
    assert {name: INDEX[name] for name in places} == places


def test_vehicle_and_world_come_from_the_simulation():
    world = World(lower=(-1.0, -2.0, -3.0), upper=(4.0, 5.0, 6.0), zone=0.7)
    ego = Egocentric(Simulation(HYDRONE_PHYSICAL, world))
    np.testing.assert_array_equal(ego.values, pack_egocentric(HYDRONE_PHYSICAL, world))
    assert ego.values[0].item()[:8] == (-1, -2, -3, 4, 5, 6, 0.7, HYDRONE_PHYSICAL.radius)


def test_bad_input_is_named():
    observation, start = random_raw(np.random.default_rng(0))
    memory = EgocentricMemory(start, 1.0, 0.0)
    with pytest.raises(ValueError, match="lacks goal"):
        EGO.observe({key: value for key, value in observation.items() if key != "goal"})
    with pytest.raises(ValueError, match=r"\['reference'\] must have shape \(4,\), got \(3,\)"):
        EGO.observe({**observation, "reference": np.zeros(3)})
    with pytest.raises(ValueError, match=r"\['obstacles'\] must have shape"):
        EGO.observe({**observation, "obstacles": np.zeros(4)})
    with pytest.raises(ValueError, match=r"memory.start must have shape \(3,\)"):
        EGO.observe(observation, EgocentricMemory(np.zeros(2), 1.0, 0.0))
    with pytest.raises(ValueError, match=r"action must have shape \(3,\), got \(4,\)"):
        EGO.reference(np.zeros(4), observation, memory)
    with pytest.raises(ValueError, match="action must be finite"):
        EGO.reference([0.0, np.nan, 0.0], observation, memory)
