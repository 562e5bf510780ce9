"""A rollout is the environment's own flight: alone, many at once, and from inside a kernel."""

import copy
import pickle

import numpy as np
import pytest

from hydrone_gym import _memory
from hydrone_gym.physics.kinematics import State
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.rollout import Flock, Rollout
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.simulation.storage import LANES, ROW, VESSEL, Flown, Pose, Row, new_block
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.world import World
from tests.simulation.batches import play, random_references, random_rows

WORLD = World()


def test_rollout_is_the_period():
    rng = np.random.default_rng(3)
    simulation, spheres = Simulation(HYDRONE, WORLD), np.array([[2.0, 0.0, 4.0, 1.0], [0.0, 3.0, -2.0, 0.8]])
    for row in random_rows(rng, 40, WORLD):
        rows, reference = np.array([row]), random_references(rng, 1, WORLD)
        whole, near = play(simulation, rows, reference[None], spheres[None])
        flown = Rollout(simulation, spheres).fly(rows, reference[0])
        for field in ("state", "integral", "reference"):
            np.testing.assert_array_equal(rows[field], whole[field])
        assert flown.outcome == whole["outcome"][0]
        assert flown.energy == whole["energy"][0]
        assert flown.crossings == whole["crossings"][0]
        assert flown.seconds == pytest.approx(0.05 * whole["ticks"][0])
        if flown.outcome == Outcome.RUNNING:
            assert flown.clearance == near.min() - HYDRONE.radius


def test_rollout_reports_the_worst_of_its_crossings():
    row = row_at(np.array([0.0, 0.0, 0.2, 0.05, 0.0, 0.0, 0.6, 0.0, -1.0, 0.0, 0.0, 0.0]))
    flown = Rollout(Simulation(HYDRONE, World(rough_transition="count")), np.zeros((0, 4))).fly(row, [0, 0, -2, 0])
    assert flown.crossings == 1
    assert 0.3 < flown.lateral_speed < 0.7
    assert 0.99 < flown.cos_tilt < 1.0
    hovering = row_at(np.array([0.0, 0.0, 5.0, *np.zeros(9)]))
    still = Rollout(Simulation(HYDRONE, WORLD), np.zeros((0, 4))).fly(hovering, [0, 0, 5, 0])
    assert (still.crossings, still.lateral_speed, still.cos_tilt) == (0, 0, 1)


def test_flock_is_many_rollouts():
    rng = np.random.default_rng(4)
    one, many = Simulation(HYDRONE, WORLD), Simulation(HYDRONE, WORLD, lanes=LANES)
    row, spheres = random_rows(rng, 1, WORLD), np.array([[1.0, 1.0, 3.0, 0.7]])
    flock, references = Flock(many, row, 21, spheres), random_references(rng, 21, WORLD)
    flock.fly(references)
    for after, reference in zip(flock.rows, references, strict=True):
        alone = row.copy()
        Rollout(one, spheres).fly(alone, reference)
        np.testing.assert_array_equal(alone["state"][0], after["state"])


def test_a_simulation_leaves_its_address_behind():
    """The compiled kernel lies elsewhere in another process."""
    simulation = Simulation(HYDRONE, WORLD)
    row, references = row_at(np.array([0.0, 0.0, 5.0, *np.zeros(9)])), np.array([[1.0, 0.0, 5.0, 0.0]])
    states = trajectory(simulation, row, references)[1]
    assert simulation._engine is not None
    for other in (pickle.loads(pickle.dumps(simulation)), copy.deepcopy(simulation), simulation.twin()):
        assert other._engine is None
        np.testing.assert_array_equal(trajectory(other, row, references)[1], states)


def test_storage_is_declared_once():
    """Rows, vessels and lanes are the numbers of their classes, in order; a field more moves all that follow."""
    flat = [name for name in ROW.names if name != "crossing_log"]
    assert flat == ["state", "integral", "energy", "reference", "goal", "ticks", "clearance", "outcome", "crossings"]
    assert ROW["state"].shape == (len(State._fields),)
    assert ROW["crossing_log"].shape == (8, 5)
    assert _memory.size_of(Row) * 8 == ROW.fields["crossing_log"][1]
    assert VESSEL == _memory.size_of(Flown) + _memory.size_of(Pose) == 21
    assert ROW.fields["reference"][1] == 8 * _memory.size_of(Flown)
    assert new_block(LANES).ctypes.data % 64 == 0


def test_rollouts_of_one_simulation_share_no_lane():
    """Two planners, or two threads, may hold rollouts of the same simulation."""
    simulation = Simulation(HYDRONE, WORLD)
    first, second = Rollout(simulation, np.zeros((0, 4))), Rollout(simulation, np.zeros((0, 4)))
    assert not np.shares_memory(first.memory[0].block, second.memory[0].block)
    assert not np.shares_memory(first.memory[0].block, simulation.engine.block)
