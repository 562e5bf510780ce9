"""The macro edge of a crossing: soon, vertical inside the zone, and what is checked is what is flown."""

import dataclasses

import numpy as np
import pytest

from hydrone_gym import HYDRONE, HYDRONE_AGILE, Outcome, Scenario
from hydrone_gym._jit import kernel
from hydrone_gym._memory import pointer
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.evaluation import fly
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.rollout import Rollout, lane_of, propagate, propagate_watched
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.simulation.storage import VESSEL
from hydrone_gym.world.world import World
from planners import CLRRT
from planners.caution import CALM
from planners.cl_rrt.stopping import safe_speed, stop_distances
from planners.cl_rrt.tree import CROSSING, OPEN
from tests.planners.flights import fly as flown_by
from tests.planners.flights import make

ENDS = {"AirToWater": ((-9.0, -9.0, 8.0), (9.0, 9.0, -3.0)), "WaterToAir": ((9.0, -9.0, -3.0), (-9.0, 9.0, 7.0))}


def empty(mission):
    start, goal = ENDS[mission]
    return Scenario(start=(*start, 0.0), goal=goal, obstacles=np.zeros((0, 4)))


@pytest.mark.parametrize("period", [0.5, 0.2])
@pytest.mark.parametrize("vehicle", ["paper", "hydrone-agile"])
@pytest.mark.parametrize("mission", ENDS)
def test_moves_vertically_inside_the_zone(mission, vehicle, period):
    env = make(mission, vehicle=vehicle, period=period)
    planner, ticks = CLRRT.for_env(env), round(period / TICK)
    for seed in range(3):
        flight = fly(env, planner, seed=seed)
        assert flight.outcome is Outcome.GOAL
        inside = np.flatnonzero(np.abs(flight.trace.states[1:, 2]) <= World().zone)
        inside = inside[: np.flatnonzero(np.append(np.diff(inside), 2) > 1)[0] + 1]  # until it first leaves the zone
        assert len(inside) * TICK > 2.0
        assert np.linalg.norm(flight.trace.states[1 + inside, 6:8], axis=1).max() <= CALM.crossing_speed
        # the reference stays in its column, but in the periods in which the vehicle enters and leaves the zone
        moves = np.linalg.norm(np.diff(flight.trace.references[:, :2], axis=0), axis=1) > 1e-6
        assert not moves[inside[ticks:-ticks]].any()


@pytest.mark.parametrize(
    ("mission", "vehicle", "most"),
    [
        ("AirToWater", "paper", 19.0),  # 20.3 s when the vehicle came to rest at a gate
        ("WaterToAir", "paper", 19.3),  # 19.6 s
        ("AirToWater", "hydrone-agile", 16.2),
        ("WaterToAir", "hydrone-agile", 16.5),
    ],
)
def test_crosses_without_coming_to_rest(mission, vehicle, most):
    env = make(mission, num_obstacles=0, vehicle=vehicle)
    flight = fly(env, CLRRT.for_env(env), scenario=empty(mission))
    assert flight.outcome is Outcome.GOAL
    assert flight.time <= most


@pytest.mark.parametrize("mission", ENDS)
def test_leaves_the_zone_sideways(mission):
    """The first edge that ends beyond the zone already leads on; the stop inside a crossing need not finish it."""
    env = make(mission, num_obstacles=0)
    history, _ = flown_by(env, CLRRT.for_env(env), scenario=empty(mission))
    crossing = [c.memory.nodes[c.memory.root]["kind"] == CROSSING for c in history if c.memory.root >= 0]
    last = max(i for i, inside in enumerate(crossing) if inside)
    column, leaving = history[last].action, history[last + 1]
    assert leaving.memory.nodes[leaving.memory.root]["kind"] == OPEN
    assert np.linalg.norm(leaving.action[:2] - column[:2]) > 0.5
    assert all(history[k].memory.stop == 1 for k, inside in enumerate(crossing) if inside)


@kernel
def _both(memory, row, reference, ends):
    lane, vessel, goal = lane_of(memory), pointer(row[0]), pointer(row[0].goal)
    there = (reference[0], reference[1], reference[2], reference[3])
    first = propagate(lane, vessel, pointer(ends[0]), goal, there)
    second, sway = propagate_watched(lane, vessel, pointer(ends[1]), goal, there, 0.8)
    return first, second, sway


@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_AGILE])
def test_watching_changes_nothing(vehicle):
    simulation, rng = Simulation(vehicle, World()), np.random.default_rng(0)
    obstacles, seen = np.array([[1.0, 0.0, 0.0, 0.3]]), 0.0
    for _ in range(40):
        state = np.zeros(12)
        state[2], state[6:9] = rng.uniform(-1.2, 1.2), rng.uniform(-1.0, 1.0, 3)
        reference, ends = np.array([*rng.uniform(-1.5, 1.5, 3), 0.0]), np.zeros((2, VESSEL))
        row = row_at(state, np.array([9.0, 0.0, 4.0]))
        first, second, sway = _both(Rollout(simulation, obstacles).memory, row, reference, ends)
        assert first == second
        np.testing.assert_array_equal(*ends)
        states = trajectory(simulation, row, reference[None], obstacles)[1][1:]
        lateral = np.linalg.norm(states[np.abs(states[:, 2]) <= 0.8, 6:8], axis=1)
        assert np.hypot(*sway) == pytest.approx(lateral.max() if len(lateral) else 0.0, abs=1e-12)
        seen = max(seen, np.hypot(*sway))
    assert seen > 0.5


def test_the_time_to_stop_follows_from_the_gains():
    """The envelope's stop time lies between two thirds and all of the stop that is measured, for both sets."""
    assert envelope_of(HYDRONE).stop_time == 0.45
    for vehicle in (HYDRONE, HYDRONE_AGILE):
        speeds = np.array([0.5, 1.0, vehicle.air_gains.speed_limit])
        measured = stop_distances(Simulation(vehicle, World()), speeds, air=True) / speeds
        assert (measured > envelope_of(vehicle).stop_time).all()
        assert (measured < 1.5 * envelope_of(vehicle).stop_time).all()
    assert envelope_of(HYDRONE_AGILE).stop_time == 0.31


@pytest.mark.parametrize("sensor_range", [1.8, 2.4])
def test_no_speed_is_lost_to_the_grid(sensor_range):
    simulation = Simulation(HYDRONE_AGILE, World(sensor_range=sensor_range))
    speed = safe_speed(simulation, 1)
    room = sensor_range - HYDRONE.radius - 0.1
    for faster, fits in ((0.0, True), (0.02, False)):
        stop = stop_distances(simulation, np.array([speed + faster]), air=True)[0]
        assert ((speed + faster) * simulation.period + stop <= room) == fits


def test_the_agile_set_is_the_paper_s_but_for_its_gains_in_air():
    assert dataclasses.replace(HYDRONE_AGILE, name="paper", air_gains=HYDRONE.air_gains) == HYDRONE
