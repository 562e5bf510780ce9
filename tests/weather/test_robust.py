"""What the robust law is for: it holds its place and crosses smoothly where the paper's law does not."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.holding import AIR, FACTORS, WATER, circle, hold, offsets
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.weather import Weather
from hydrone_gym.weather.weather import LEVELS, ROTOR_DRAG
from hydrone_gym.world.world import CROSSINGS, World
from tests.weather.outdoors import conditions_for, play_in_weather

NAMED = {factor.name: factor for factor in FACTORS}
FLIGHTS = 64
OPEN = World(lower=(-500.0, -500.0, -5.0), upper=(500.0, 500.0, 20.0), rough_transition="count")


@pytest.mark.parametrize("wind", [3, 5, 8])
def test_wind_does_not_move_it(wind):
    """With rotor drag and lag, which the law does not know, from headings all round."""
    factor = NAMED[f"wind {wind} m/s"]
    assert offsets(hold("robust", factor, AIR, seconds=15.0), AIR)[0, 0] <= 0.05
    assert offsets(hold("paper", factor, AIR, seconds=30.0), AIR)[0, 0] >= {3: 0.2, 5: 0.3, 8: 0.6}[wind]


def test_gusts_hardly_move_it():
    factor = NAMED["gusty wind 5 m/s"]
    assert offsets(hold("robust", factor, AIR), AIR)[0, 0] <= 0.1
    assert offsets(hold("paper", factor, AIR), AIR)[0, 0] >= 0.3


@pytest.mark.parametrize("height", [AIR, WATER])
@pytest.mark.parametrize("error", ["mass -10 %", "mass +10 %", "thrust -10 %", "thrust +10 %"])
def test_it_holds_its_height_with_another_mass_or_thrust(error, height):
    late = hold("robust", NAMED[error], height, seconds=15.0)[100:]
    assert np.abs(late[..., 2] - height).max() <= 0.03
    assert np.hypot(late[..., 0], late[..., 1]).max() <= 0.02


@pytest.mark.parametrize(("current", "radius"), [(0.1, 0.4), (0.2, 0.6), (0.3, 0.8), (0.5, 1.5)])
def test_it_keeps_station_in_a_current(current, radius):
    """Taken by surprise from any heading, it is carried along while it turns; then bow or stern are against it."""
    states = hold("robust", NAMED[f"current {current:g} m/s"], WATER)
    away = np.hypot(states[..., 0], states[..., 1])
    assert away.max() <= radius
    assert away[-200:].max() <= HYDRONE.robust_gains.hold_radius + 0.05
    assert np.abs(states[..., 2] - WATER).max() <= 0.05
    assert np.abs(np.sin(states[-200:, :, 5])).max() <= 0.3


@pytest.mark.parametrize(("radius", "speed", "most"), [(2.0, 1.0, 0.1), (3.0, 2.0, 0.25)])
def test_it_follows_circles_closely(radius, speed, most):
    still = NAMED["nothing"]
    assert circle("robust", still, radius, speed) <= most <= circle("paper", still, radius, speed) / 2.0


def crossings(law, level, start, mode="vertical"):
    """Cross from a height (m) to the opposite one after four seconds there; rows, and which crossed roughly."""
    world, rows = replace(OPEN, **CROSSINGS[mode]), new_rows(FLIGHTS)
    rows["state"][:, 2], rows["state"][:, 5] = start, np.linspace(-3.0, 3.0, FLIGHTS)
    rows["reference"][:, :3], rows["reference"][:, 3] = rows["state"][:, :3], rows["state"][:, 5]
    rows["goal"], rows["clearance"] = np.inf, np.inf
    references = np.zeros((48, FLIGHTS, 4))
    references[:, :, 3] = rows["state"][:, 5]
    references[:8, :, 2], references[8:, :, 2] = start, -start
    simulation = Simulation(HYDRONE, world, lanes=16, law=law, weathered=True)
    rows, _ = play_in_weather(simulation, rows, references, conditions_for(rows, 16, LEVELS[level], seed=5))
    log = rows["crossing_log"]
    real = np.arange(log.shape[1]) < rows["crossings"][:, None]
    fast, tilted = log[..., 2] > world.rough_speed, log[..., 3] < np.cos(world.rough_tilt)
    return rows, (real & (fast | tilted)).any(axis=1)


@pytest.mark.parametrize("mode", ["vertical", "adaptive"])
@pytest.mark.parametrize("start", [2.0, -2.5], ids=["entry", "exit"])
@pytest.mark.parametrize(("level", "most"), [(1, 0), (2, 1), (3, 6)])
def test_it_crosses_smoothly_in_weather(level, most, start, mode):
    rows, rough = crossings("robust", level, start, mode)
    assert rough.sum() <= most
    assert (np.sign(rows["state"][:, 2]) == -np.sign(start)).sum() >= FLIGHTS - 4  # who waits for a lull
    assert rows["crossings"].max() == 1


@pytest.mark.parametrize("start", [2.0, -2.5], ids=["entry", "exit"])
def test_the_papers_law_crosses_roughly_in_weather(start):
    assert crossings("paper", 2, start)[1].sum() >= FLIGHTS / 4


@pytest.mark.parametrize("hull", [0.0, 0.1], ids=["abrupt", "blended"])
def test_rotors_that_turn_early_bring_it_out_of_the_water(hull):
    """At once, whatever the lag and however late it notices; without them some fall back and bob."""
    settings = [(hull, lag, delay) for lag in (0.0, 0.033, 0.1) for delay in (0.0, 0.05, 0.1, 0.2)]
    late = replace(HYDRONE, robust_gains=replace(HYDRONE.robust_gains, pre_spin=0.0))
    assert all(exits_at_once(HYDRONE, *setting) for setting in settings)
    assert hull > 0.0 or not all(exits_at_once(late, *setting) for setting in settings)


def exits_at_once(vehicle, height, lag, delay):
    real = replace(vehicle, height=height, rotor_lag_air=lag, rotor_lag_water=lag, medium_delay=delay)
    rows = new_rows(1)
    rows["state"][:, 2], rows["reference"][:, 2] = -2.0, -2.0
    rows["goal"], rows["clearance"] = np.inf, np.inf
    references = np.tile([0.0, 0.0, 2.0, 0.0], (20, 1, 1))
    simulation = Simulation(vehicle, OPEN, lanes=1, law="robust", weathered=True)
    row = play_in_weather(simulation, rows, references, conditions_for(rows, 1, vehicle=real))[0][0]
    return row["crossings"] == 1 and row["outcome"] == Outcome.RUNNING and row["state"][2] > 1.5


def test_a_scene_turned_about_the_vertical_is_flown_alike():
    """Weather, start and references turned by any angle: to rounding, which switches in water blow up a little."""
    drag, flown = replace(HYDRONE, rotor_drag=ROTOR_DRAG, rotor_lag_air=0.033, height=0.135), []
    for turn in (0.0, 1.0, 2.5):
        weather = Weather(
            wind=4.0, wind_direction=turn, current=0.3, current_direction=turn + 1.0, current_variation=0.0
        )
        matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        rng, rows = np.random.default_rng(4), new_rows(32)
        rows["state"][:, 2] = np.where(np.arange(32) % 2, 3.0, -2.5)
        rows["state"][:, 5] = rng.uniform(-3.0, 3.0, 32)
        references = np.zeros((8, 32, 4))
        references[:] = rng.uniform(-2.0, 2.0, (4, 32, 4)).repeat(2, axis=0)
        references[..., 2] = rows["state"][:, 2] + 0.3 * references[..., 2]
        references[..., :2] = references[..., :2] @ matrix.T
        references[..., 3] += turn
        rows["state"][:, 5] += turn
        rows["reference"][:, 2], rows["reference"][:, 3] = rows["state"][:, 2], rows["state"][:, 5]
        rows["goal"], rows["clearance"] = np.inf, np.inf
        simulation = Simulation(HYDRONE, OPEN, lanes=16, law="robust", weathered=True)
        rows, _ = play_in_weather(simulation, rows, references, conditions_for(rows, 16, weather, vehicle=drag))
        flown.append(np.column_stack([rows["state"][:, :2] @ matrix, rows["state"][:, 2:5], rows["state"][:, 9:]]))
    for other in flown[1:]:
        np.testing.assert_allclose(other, flown[0], atol=1e-3)
