"""The step responses the documentation shows, held to what they must reach."""

import dataclasses

import numpy as np
import pytest

from benchmarks.step_responses import AIR, CROSSINGS, DEPTH, SWIM, VEHICLES, hold, respond, table
from hydrone_gym.control.laws import LAWS, envelope_of

EITHER = pytest.mark.parametrize("vehicle", VEHICLES, ids=lambda vehicle: vehicle.name)
LAW = pytest.mark.parametrize("law", LAWS)
STOPS_SHORT = AIR[0]  # its reference runs at 2 m/s and stops dead after a metre


def each(steps):
    return pytest.mark.parametrize("step", steps, ids=lambda step: step.name)


@LAW
@EITHER
@each(AIR)
def test_air(vehicle, step, law):
    response = respond(vehicle, step, law)
    assert response.error <= 0.1
    assert response.settling <= 6.0
    assert response.overshoot <= (0.45 if law == "robust" and step is STOPS_SHORT else 0.15)


@EITHER
def test_robust_law_overshoots_a_reference_by_what_it_takes_to_stop(vehicle):
    """It follows closely, so it is as fast as the reference when that stops dead: v^2 / (2 braking), and some lag."""
    for speed in (1.0, 2.0):
        way = speed**2 / (2.0 * vehicle.robust_gains.braking)
        step = dataclasses.replace(STOPS_SHORT, move=(0.5 * speed, 0, 0))
        assert respond(vehicle, step, "robust").overshoot * 0.5 * speed <= way + 0.1
    assert respond(vehicle, AIR[1], "robust").overshoot <= 1e-3


@EITHER
@each(AIR)
def test_robust_law_settles_no_later(vehicle, step):
    assert respond(vehicle, step, "robust").settling <= respond(vehicle, step).settling + 0.3


@LAW
@EITHER
@each(DEPTH)
def test_depth(vehicle, step, law):
    response = respond(vehicle, step, law)
    assert response.error <= 0.1
    assert response.overshoot <= 0.15


@LAW
@EITHER
@each(SWIM)
def test_swimming_ends_within_reach(vehicle, step, law):
    """Sway is not actuated, so the vehicle stops within the hold radius of the reference and stays there."""
    response = respond(vehicle, step, law)
    assert response.error <= envelope_of(vehicle, law).hold_radius + 0.1
    assert response.overshoot <= 0.2
    assert np.linalg.norm(response.states[-1, 6:9]) <= 0.02


@LAW
@EITHER
@each(CROSSINGS)
def test_crossings_are_smooth(vehicle, step, law):
    response = respond(vehicle, step, law)
    assert response.lateral_speed <= 0.1
    assert response.tilt <= 2.0
    assert response.crossing_time > 0.0


@LAW
@EITHER
@pytest.mark.parametrize("surge", [1.0, -1.0])
def test_holding_under_water_brakes(vehicle, surge, law):
    seconds, drift, speed = hold(vehicle, surge, 0.0, law)
    assert seconds <= {"paper": 0.5, "robust": 1.0}[law]
    assert drift <= {"paper": 0.1, "robust": 0.2}[law]
    assert speed <= 1e-3


@LAW
@EITHER
def test_holding_under_water_comes_to_rest_sideways(vehicle, law):
    seconds, drift, speed = hold(vehicle, 0.5, 0.5, law)
    assert seconds <= 20.0
    assert drift <= 0.6
    assert speed <= 0.02


def test_table_is_markdown():
    lines = [line for line in table().splitlines() if line]
    assert all(line.startswith("| ") or line.startswith("|---") for line in lines)
    assert len({line.split(" | ")[0] for line in lines} & {"| paper", "| physical"}) == 2


def test_laws_stand_side_by_side():
    """One column a law for every measure, those of the paper's law as they are alone."""
    alone, both = table().splitlines(), table(tuple(LAWS)).splitlines()
    assert len(alone) == len(both)
    for one, two in zip(alone, both, strict=True):
        cells = one.split(" | ")[2:]
        assert one == "" or one.startswith("|---") or len(two.split(" | ")) == 2 + len(LAWS) * len(cells)
        if one.startswith("| paper") or one.startswith("| physical"):
            assert [cell.strip(" |") for cell in two.split(" | ")[2 :: len(LAWS)]] == [
                cell.strip(" |") for cell in cells
            ]
