"""The step responses the documentation shows, held to what they must reach."""

import numpy as np
import pytest

from benchmarks.step_responses import AIR, CROSSINGS, DEPTH, SWIM, VEHICLES, hold, respond, table

EITHER = pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda vehicle: vehicle.name)


def each(steps):
    return pytest.mark.parametrize("step", steps, ids=lambda step: step.name)


@EITHER
@each(AIR)
def test_air(vehicle, step):
    response = respond(vehicle, step)
    assert response.error <= 0.1
    assert response.overshoot <= 0.15
    assert response.settling <= 6.0


@EITHER
@each(DEPTH)
def test_depth(vehicle, step):
    response = respond(vehicle, step)
    assert response.error <= 0.1
    assert response.overshoot <= 0.15


@EITHER
@each(SWIM)
def test_swimming_ends_within_reach(vehicle, step):
    """Sway is not actuated, so the vehicle stops within the hold radius of the reference and stays there."""
    response = respond(vehicle, step)
    assert response.error <= vehicle.water_gains.hold_radius + 0.1
    assert response.overshoot <= 0.15
    assert np.linalg.norm(response.states[-1, 6:9]) <= 0.02


@EITHER
@each(CROSSINGS)
def test_crossings_are_smooth(vehicle, step):
    response = respond(vehicle, step)
    assert response.lateral_speed <= 0.1
    assert response.tilt <= 2.0
    assert response.crossing_time > 0.0


@EITHER
@pytest.mark.parametrize("surge", [1.0, -1.0])
def test_holding_under_water_brakes(vehicle, surge):
    seconds, drift, speed = hold(vehicle, surge, 0.0)
    assert seconds <= 0.5
    assert drift <= 0.1
    assert speed <= 1e-3


@EITHER
def test_holding_under_water_comes_to_rest_sideways(vehicle):
    seconds, drift, speed = hold(vehicle, 0.5, 0.5)
    assert seconds <= 20.0
    assert drift <= 0.6
    assert speed <= 0.02


def test_table_is_markdown():
    lines = [line for line in table().splitlines() if line]
    assert all(line.startswith("| ") or line.startswith("|---") for line in lines)
    assert len({line.split(" | ")[0] for line in lines} & {"| paper", "| physical"}) == 2
