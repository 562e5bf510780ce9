"""Energy as a decision: how fast to swim and where to cross, by what they cost."""

import itertools

import numpy as np
import pytest

from hydrone_gym import HYDRONE, Outcome, Scenario
from hydrone_gym._jit import kernel
from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.time_to_go import CruiseSpeeds
from hydrone_gym.world.world import World
from planners import CLRRT
from planners.cl_rrt.objective import crossing_point
from planners.cl_rrt.swimming import cheapest, steady
from tests.planners.flights import fly, make

FORWARD, DOWN, UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
SIMULATION = Simulation(HYDRONE, World())


@kernel
def _crossing_point(start, goal, rates):
    return crossing_point(start[0], start[1], start[2], goal[0], goal[1], goal[2], rates)


def test_slower_swimming_costs_fewer_joules_a_metre():
    """Down to where the carrot comes within the hold radius: there the law brakes, and going on costs more again."""
    paces = [steady(SIMULATION, FORWARD, lead) for lead in (0.8, 1.0, 1.5, 2.0)]
    assert all(a.speed < b.speed and a.power / a.speed < b.power / b.speed for a, b in itertools.pairwise(paces))
    assert paces[0].power / paces[0].speed == pytest.approx(11.4, abs=0.1)
    full, envelope = paces[-1], envelope_of(HYDRONE)
    assert (full.speed, full.power) == pytest.approx((envelope.surge, envelope.swim_power), rel=2e-3)
    braked = steady(SIMULATION, FORWARD, 0.6)
    assert braked.power / braked.speed > 2.0 * paces[0].power / paces[0].speed


@pytest.mark.parametrize("law", ["paper", "robust"])
def test_the_more_a_second_is_worth_the_faster_it_swims(law):
    simulation = Simulation(HYDRONE, World(), law=law)
    paces = [cheapest(simulation, FORWARD, worth) for worth in (0.0, 20.0, 40.0, 300.0)]
    assert all(a.speed < b.speed for a, b in itertools.pairwise(paces))
    assert paces[-1].speed == pytest.approx(envelope_of(HYDRONE, law).surge, rel=0.02)
    # the robust law swims as slowly as physics makes cheapest, 0.39 m/s at 7.4 J/m; the paper's cannot
    assert paces[0].power / paces[0].speed == pytest.approx({"paper": 11.3, "robust": 7.4}[law], abs=0.2)


def test_rising_costs_less_than_diving():
    """The vehicle floats: its rotors are nearly idle while it rises."""
    down, up = cheapest(SIMULATION, DOWN, 0.0), cheapest(SIMULATION, UP, 0.0)
    assert up.power / up.speed < 0.15 * down.power / down.speed


@pytest.mark.parametrize(("water", "x"), [(0.2, 8.0), (0.05, 15.0)])
def test_crossing_point(water, x):
    """Where swimming is cheaper than flying, as soon as the height is lost; else where there is no more to swim."""
    rates = CruiseSpeeds(air=0.1, climb=0.05, water=water, dive=0.02, zone=0.01)
    start, goal = (0.0, 0.0, 5.1), (20.0, 0.0, -3.1)  # 4 m down to the gate, 2 m beyond the other
    assert _crossing_point(start, goal, rates) == pytest.approx((x, 0.0))
    assert _crossing_point(goal, start, rates) == pytest.approx((x, 0.0))


@pytest.mark.parametrize("worth", [0.0, 30.0])
@pytest.mark.parametrize(
    ("start", "goal", "most"),
    [
        ((-9.0, -9.0, 8.0), (9.0, 9.0, -3.0), 1.3),  # braking before the zone is not allowed for
        ((9.0, -9.0, -3.0), (-9.0, 9.0, 7.0), 1.3),
        ((-8.0, 0.0, -2.5), (8.0, 0.0, -2.5), 1.05),
        ((-8.0, 0.0, 5.0), (8.0, 0.0, 5.0), 1.15),
    ],
)
def test_cost_to_go_bounds_what_a_flight_costs(start, goal, most, worth):
    """From below, but for what the goal's radius saves; and not by much."""
    env = make("Mission", num_obstacles=0)
    planner = CLRRT.for_env(env, objective=worth)
    scenario = Scenario(start=(*start, 0.0), goal=goal, obstacles=np.zeros((0, 4)))
    history, info = fly(env, planner, scenario=scenario)
    flown, least = worth * info["time"] + info["energy"], history[0].memory.nodes["to_go"][0]
    near = 1.0 - 0.6 / np.linalg.norm(np.subtract(goal, start))
    assert near * least < flown < most * least


def test_seconds_weighed_against_joules():
    """No hurry costs fewer joules and more seconds than a hurry, and dives earlier; all arrive smoothly."""
    env, flights = make("AirToWater"), {}
    for objective in ("energy", 20.0, "time"):
        planner = CLRRT.for_env(env, objective=objective)
        infos = [fly(env, planner, seed=seed)[1] for seed in range(3)]
        assert all(info["outcome"] is Outcome.GOAL and info["clearance"] > 0.0 for info in infos)
        crossings = [crossing for info in infos for crossing in info["transitions"]]
        assert all(crossing["lateral_speed"] < 0.1 for crossing in crossings)
        spent = [np.mean([info[name] for info in infos]) for name in ("time", "energy")]
        flights[objective] = (*spent, np.mean([crossing["time"] for crossing in crossings]))
    frugal, weighed, hasty = flights.values()
    assert frugal[0] > weighed[0] > hasty[0]
    assert frugal[1] < weighed[1] < hasty[1]
    assert frugal[1] < 0.8 * hasty[1]
    assert frugal[2] < hasty[2]
    # the curve is nearly straight: its middle is hardly better than its ends
    assert 20.0 * weighed[0] + weighed[1] < 1.02 * min(20.0 * frugal[0] + frugal[1], 20.0 * hasty[0] + hasty[1])


def test_a_weighed_path_costs_what_its_flight_does():
    """The cost of the path sent is what flying it takes: known map, one plan."""
    env = make("AirToWater", num_obstacles=0)
    history, info = fly(env, CLRRT.for_env(env, objective=25.0), seed=0)
    assert 25.0 * info["time"] + info["energy"] <= history[0].memory.report.cost * (1.0 + 1e-12)
