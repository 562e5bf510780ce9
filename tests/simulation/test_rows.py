"""One row, many rows, whole periods, parts of them: the same numbers bit for bit."""

import dataclasses

import numpy as np
import pytest

from hydrone_gym.control.laws import LAWS
from hydrone_gym.simulation.advance import SPEED_BOUND
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.rows import advance_rows
from hydrone_gym.simulation.simulation import Simulation, row_at, ticks_in, trajectory
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from tests.simulation.batches import play, random_references, random_rows
from tests.simulation.closed_loop import ClosedLoop

WORLD = World()
OPEN = World(lower=(-1e3, -1e3, -1e3), upper=(1e3, 1e3, 1e3), rough_transition="count")
VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)

EITHER_LAW = pytest.mark.parametrize("law", LAWS)


def random_spheres(rng, rows, count):
    centres = rng.uniform(WORLD.lower, WORLD.upper, (rows, count, 3))
    return np.concatenate([centres, rng.uniform(0.2, 1.0, (rows, count, 1))], axis=2)


def mission(rng, count=100, periods=12, spheres=6):
    """Rows of every kind: collided, out of bounds, rough, arrived and running; some are finished from the start."""
    rows = random_rows(rng, count, WORLD)
    rows["goal"] = random_references(rng, count, WORLD)[:, :3]
    rows["goal"][::3] = rows["state"][::3, :3] + 1.0
    rows["outcome"][::9] = rng.integers(1, 7, len(rows[::9]))
    references = np.stack([random_references(rng, count, WORLD) for _ in range(periods)])
    references[:, ::3, :3] = rows["goal"][::3]
    return rows, references, random_spheres(rng, count, spheres)


def equal(first, second):
    assert first.tobytes() == second.tobytes()


@EITHER_LAW
@VEHICLES
def test_sixteen_lanes_equal_one(vehicle, law):
    rows, references, spheres = mission(np.random.default_rng(10))
    many, near = play(Simulation(vehicle, WORLD, lanes=16, law=law), rows, references, spheres)
    single = Simulation(vehicle, WORLD, lanes=1, law=law)
    for i in range(len(rows)):
        one, distance = play(single, rows[i : i + 1], references[:, i : i + 1], spheres[i : i + 1])
        equal(one[0], many[i])
        equal(distance[0], near[i])
    seen = {Outcome(int(outcome)) for outcome in many["outcome"]}
    assert {Outcome.RUNNING, Outcome.GOAL, Outcome.COLLISION, Outcome.ROUGH_TRANSITION} <= seen


def test_a_finished_row_is_frozen():
    rows, references, spheres = mission(np.random.default_rng(11), count=40)
    rows["outcome"] = Outcome.GOAL
    after, near = play(Simulation(HYDRONE, WORLD, lanes=16), rows, references, spheres)
    rows["reference"] = references[-1]  # what was asked for is recorded, though nothing follows it
    equal(after, rows)
    assert np.isinf(near).all()


@VEHICLES
def test_a_period_cut_up_is_the_period(vehicle):
    rows, references, spheres = mission(np.random.default_rng(12), count=20, periods=4)
    simulation = Simulation(vehicle, WORLD, lanes=1)
    for i in range(len(rows)):
        flat, count = spheres[i].reshape(1, -1), spheres.shape[1]
        whole, near = play(simulation, rows[i : i + 1], references[:, i : i + 1], spheres[i : i + 1])
        cut, closest = rows[i : i + 1].copy(), np.full((1, count), np.inf)
        for reference in references[:, i]:
            for first, last in ((0, 1), (1, 4), (4, 10)):
                simulation.advance(cut, reference[None], flat, closest, count, first, last)
        equal(cut, whole)
        equal(closest, near)


@VEHICLES
def test_trajectory_ends_where_whole_periods_end(vehicle):
    rows, references, spheres = mission(np.random.default_rng(13), count=30, periods=6)
    simulation = Simulation(vehicle, WORLD)
    for i in np.flatnonzero(rows["outcome"] == 0):
        before = rows[i : i + 1].copy()
        times, states, moving, row = trajectory(simulation, rows[i : i + 1], references[:, i], spheres[i])
        equal(before, rows[i : i + 1])
        whole, _ = play(simulation, rows[i : i + 1], references[:, i : i + 1], spheres[i : i + 1])
        for field in ("state", "integral", "ticks", "energy", "clearance", "outcome", "crossings", "crossing_log"):
            equal(row[field], whole[field])
        assert len(times) == len(states) == len(moving) == row["ticks"][0] + 1
        np.testing.assert_allclose(np.diff(times), TICK)
        equal(states[-1], whole["state"][0])


@EITHER_LAW
@VEHICLES
@pytest.mark.parametrize("height", [4.0, -3.0, 1.5, -1.5])
def test_energy_and_states_equal_a_step_by_step_replay(vehicle, height, law):
    """Shaft power summed outside the kernel, from the rotor speeds of every step."""
    rng = np.random.default_rng(14)
    start = np.array([0.0, 0.0, height, *np.zeros(9)])
    references = np.column_stack([rng.uniform(-1, 1, (12, 2)), np.full(12, -np.sign(height)), np.zeros(12)])
    _, states, _, row = trajectory(Simulation(vehicle, OPEN, law=law), row_at(start), references)
    loop = ClosedLoop(vehicle, OPEN, 0.5, start, [*start[:3], 0.0], law)
    energy, replay = 0.0, [start]
    water = height <= 0.0
    for state in loop.play(references, loop.advance_stepped):
        density, torque = (1000.0, vehicle.torque_water) if water else (1.293, vehicle.torque_air)
        rate = np.abs(loop.rotor_speeds) * 2.0 * np.pi / 60.0  # rad/s
        energy += np.sum(density * torque * loop.rotor_speeds**2 * rate) * 0.01
        water = state[2] <= 0.0
        replay.append(state.copy())
    assert row["outcome"][0] == Outcome.RUNNING
    equal(np.array(replay[::5]), states)
    assert row["energy"][0] == pytest.approx(energy, rel=1e-12)
    equal(row["integral"][0], loop.integral)


def test_hover_power():
    """eta = kappa zeta with kappa = 0.0125 m: 3.144 N x 0.0125 m x 330 rad/s, 13 W a rotor."""
    start = np.array([0.0, 0.0, 5.0, *np.zeros(9)])
    _, _, _, row = trajectory(Simulation(HYDRONE, OPEN), row_at(start), np.tile([0.0, 0.0, 5.0, 0.0], (4, 1)))
    assert row["energy"][0] / 2.0 == pytest.approx(4 * 3.144 * 0.0125 * 3150.5 * 2 * np.pi / 60, rel=1e-3)


@pytest.mark.parametrize("lanes", [1, 16])
@pytest.mark.parametrize(
    ("entry", "value"),
    [(6, 2 * SPEED_BOUND), (4, 2.5), (8, 1e200), (9, -1e300), (0, np.nan), (7, np.inf), (3, np.nan)],
)
def test_divergence_keeps_the_last_state(entry, value, lanes):
    rows = np.repeat(row_at(np.array([0.0, 0.0, 5.0, *np.zeros(9)])), 3)
    rows["state"][1, entry] = value
    references = np.tile([0.0, 0.0, 5.0, 0.0], (2, 3, 1))
    after, _ = play(Simulation(HYDRONE, OPEN, lanes=lanes), rows, references)
    assert [Outcome(int(o)) for o in after["outcome"]] == [Outcome.RUNNING, Outcome.DIVERGED, Outcome.RUNNING]
    equal(after["state"][1], rows["state"][1])
    assert after["energy"][1] == 0.0
    assert np.isfinite(after["energy"]).all()
    assert after["ticks"].tolist() == [20.0, 1.0, 20.0]
    equal(after["state"][0], after["state"][2])


def test_divergence_on_the_way_keeps_the_last_finite_state():
    """Rate feedback too strong for a step of 10 ms tumbles the vehicle; what stays is the state before that tick."""
    wild = dataclasses.replace(HYDRONE, name="custom", rotor_limit_air=1e9)
    rows = row_at(np.array([0.0, 0.0, 5.0, 0.2, 0.1, *np.zeros(7)]))
    gains = dataclasses.replace(wild.air_gains, roll_d=1e6, pitch_d=1e6)
    after, _ = play(Simulation(dataclasses.replace(wild, air_gains=gains), OPEN), rows, np.full((10, 1, 4), 5.0))
    assert after["outcome"][0] == Outcome.DIVERGED
    assert np.isfinite(after["state"]).all()
    assert np.isfinite(after["energy"]).all()


@pytest.mark.parametrize("period", [0.0, -0.5, 0.07, 0.01])
def test_period_must_be_a_multiple_of_the_tick(period):
    with pytest.raises(ValueError, match=r"period must be a positive multiple of 0\.05 s, got"):
        ticks_in(period)
    assert ticks_in(0.5) == 10


def test_two_compiled_versions_serve_everything():
    """An integer or a float32 where a float64 was would silently compile another version."""
    rng = np.random.default_rng(15)
    for lanes in (1, 16):
        for period in (0.5, 1):
            for count in (0, 3):
                rows = random_rows(rng, 20, WORLD)
                references = random_references(rng, 20, WORLD)[None]
                play(Simulation(HYDRONE, WORLD, period, lanes), rows, references, random_spheres(rng, 20, count))
    trajectory(Simulation(HYDRONE, WORLD), row_at([0, 0, 5, *[0] * 9]), [[0, 0, 5, 0]], [[3, 3, 3, 1]])
    assert len(advance_rows.signatures) <= 2
