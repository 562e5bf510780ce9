"""The closed loop against SciPy: 20 s manoeuvres in air, in water and through both crossings, within 2 cm."""

import numpy as np
import pytest

from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from tests.simulation.closed_loop import ClosedLoop

WORLD = World()
PERIODS = np.arange(1, 41)


def circle_in_air():
    return (0.0, 0.0, 5.0), [(3 * np.cos(k / 4) - 3, 3 * np.sin(k / 4), 5 + np.sin(0.4 * k), 0.1 * k) for k in PERIODS]


def weave_in_water():
    there = [(0.25 * k, 1.5 * np.sin(0.15 * k), -3 + 0.8 * np.sin(0.3 * k), 0.0) for k in PERIODS[:20]]
    back = [(5 - 0.2 * (k - 20), 1.5 * np.sin(0.15 * k), -3 + 0.8 * np.sin(0.3 * k), 0.0) for k in PERIODS[20:]]
    return (0.0, 0.0, -3.0), there + back


def water_entry():
    down = [(0.5 * min(k, 4), 0.0, max(2.5 - 0.3 * k, -3.0), 0.2) for k in PERIODS[:24]]
    away = [(2 + 0.3 * (k - 24), 0.1 * (k - 24), -3.0, 0.2) for k in PERIODS[24:]]
    return (0.0, 0.0, 2.5), down + away


def water_exit():
    up = [(0.2 * min(k, 4), 0.0, min(-2.5 + 0.3 * k, 3.0), 0.2) for k in PERIODS[:24]]
    away = [(0.8 + 0.5 * (k - 24), 0.3 * (k - 24), 3.0, 0.2) for k in PERIODS[24:]]
    return (0.0, 0.0, -2.5), up + away


def dive_and_return():
    down = [(1.0, 0.0, max(2.0 - 0.4 * k, -2.0), 0.0) for k in PERIODS[:20]]
    up = [(1.0, 0.0, min(-2.0 + 0.4 * (k - 20), 3.0), 0.0) for k in PERIODS[20:]]
    return (0.0, 0.0, 2.0), down + up


@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)
@pytest.mark.parametrize(
    ("manoeuvre", "crossings"),
    [(circle_in_air, 0), (weave_in_water, 0), (water_entry, 1), (water_exit, 1), (dive_and_return, 2)],
)
def test_positions_within_two_centimetres(vehicle, manoeuvre, crossings, record_property):
    position, references = manoeuvre()
    references = np.array(references)
    references[:, 3] = (references[:, 3] + np.pi) % (2 * np.pi) - np.pi
    start = np.array([*position, *np.zeros(9)])
    loop = ClosedLoop(vehicle, WORLD, 0.5, start, [*position, 0.0])
    exact = np.array([start] + [state.copy() for state in loop.play(references, loop.advance_exact)])
    times, states, _, row = trajectory(Simulation(vehicle, WORLD), row_at(start), references)
    assert times[-1] == pytest.approx(20.0)
    assert row["crossings"][0] == loop.crossings == crossings
    error = np.linalg.norm(states[:, :3] - exact[::5, :3], axis=1)
    record_property("largest position error in m", float(error.max()))
    assert error.max() <= 0.02
    assert np.ptp(states[:, :3], axis=0).max() > 2.0  # it went somewhere
