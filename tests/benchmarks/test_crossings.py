"""Crossings are measured as the environment flies and judges them, and what was found of them holds."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks import crossing_lag, crossings, crossings_page
from benchmarks.columns import PERIOD, WORLD, Column, fly_column, ready
from benchmarks.timing import ROOT
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.simulation import LANES, Simulation
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.weather import Weather
from hydrone_gym.world.world import CROSSINGS

FLIGHTS = 128


def cell(direction, speed, height=0.0, wind=0.0):
    return crossings.cell("paper", direction, speed, height, wind, FLIGHTS)


def two_metres_a_second(hull):
    """A vehicle that enters the water at 2 m/s and brakes in it as usual."""
    gains = replace(HYDRONE.air_gains, zone_speed_limit=2.0, vertical_speed_limit=2.0)
    return replace(HYDRONE, air_gains=gains, height=hull)


def test_watched_flights_are_those_of_the_simulation():
    """Bit for bit, and what is seen of them agrees with their ticks and with the log of their crossings."""
    vehicle, storm = crossings.limited(2.0), Weather(wind=2.0, wave_height=0.3, wave_period=2.5)
    column = Column(start=2.0, end=-3.0, hold=1.0, limit=7.0, flights=20, stop=False)
    flights = fly_column(vehicle, column, storm)
    rows, path, conditions = ready(vehicle, column, storm)
    simulation = Simulation(vehicle, WORLD, PERIOD, LANES, weathered=True)
    nothing, ticks = np.zeros((len(conditions), 0)), []
    for period in range(16):
        references = np.ascontiguousarray(path[1 if period >= 2 else 0])
        for tick in range(simulation.ticks):
            simulation.advance(rows, references, nothing, nothing, 0, tick, tick + 1, weather=conditions)
            ticks.append(rows["state"].copy())
    states, times = np.array(ticks), TICK * np.arange(1, len(ticks) + 1) - 1.0
    np.testing.assert_array_equal(flights.states, rows["state"])
    np.testing.assert_array_equal(flights.crossings, rows["crossings"])
    assert flights.crossings.min() == 1.0
    np.testing.assert_array_equal(flights.lateral, rows["crossing_log"][:, 0, 2])
    np.testing.assert_allclose(np.cos(flights.surface_tilt), rows["crossing_log"][:, 0, 3], rtol=1e-12)
    for k in range(len(rows)):
        inside, beyond = np.abs(states[:, k, 2]) <= WORLD.zone, states[:, k, 2] < -WORLD.zone
        assert 0.0 <= times[inside].min() - flights.began[k] < TICK
        assert 0.0 <= times[beyond].min() - flights.through[k] < TICK
        mean = np.linalg.norm(np.diff(states[:, k, 6:9], axis=0), axis=1)[inside[1:] & inside[:-1]] / TICK
        assert mean.max() <= flights.acceleration[k] < 5.0 * mean.max()  # five physics steps a tick


def test_a_cell_gives_the_same_numbers_twice():
    assert cell("entry", 1.0, 0.3, 5.0) == cell("entry", 1.0, 0.3, 5.0)


@pytest.mark.parametrize("direction", crossings.STARTS)
def test_still_air_and_flat_water_are_crossed_smoothly(direction):
    found = cell(direction, 0.5)
    assert found["smooth"][0] == found["aggressive"][0] == 1.0
    assert found["seconds"][0] == pytest.approx(2.0 * WORLD.zone / 0.5, abs=0.25)


@pytest.mark.parametrize("direction", crossings.STARTS)
def test_higher_waves_are_not_crossed_smoothly_more_often(direction):
    rates = [cell(direction, 1.0, height)["smooth"] for height in crossings.HEIGHTS]
    for (_, low, _), (_, _, high) in zip(rates[1:], rates[:-1], strict=True):
        assert low <= high
    assert rates[-1][2] < rates[0][1]


def test_a_hull_softens_the_entry():
    column = Column(start=2.0, end=-4.0, hold=5.0, limit=6.0, flights=64)
    abrupt, blended = (fly_column(two_metres_a_second(hull), column).acceleration for hull in (0.0, 0.135))
    assert np.median(abrupt) == pytest.approx(60.0, rel=0.05)
    assert np.median(blended) == pytest.approx(24.0, rel=0.05)


def test_limits_are_those_of_the_world_and_of_an_aggressive_crossing():
    assert CROSSINGS["aggressive"]["rough_speed"] == crossings.AGGRESSIVE.lateral
    assert CROSSINGS["aggressive"]["rough_tilt"] == np.radians(crossings.AGGRESSIVE.tilt)
    base = fly_column(HYDRONE, Column(start=2.0, end=-2.0, limit=8.0, flights=16))
    good = {"through": np.full(16, 4.0), "lateral": np.full(16, 0.2), "surface_tilt": np.full(16, np.radians(5.0))}
    good |= {"tilt": np.full(16, np.radians(15.0)), "acceleration": np.full(16, 25.0), "outcome": np.zeros(16)}
    assert crossings.smooth(base._replace(**good)).all()
    assert crossings.aggressive(base._replace(**good)).all()
    for name, value, smooth, aggressive in (
        ("lateral", 0.21, False, True),
        ("lateral", 1.01, False, False),
        ("surface_tilt", np.radians(5.1), False, True),
        ("tilt", np.radians(15.1), True, False),
        ("acceleration", 25.1, True, False),
        ("through", np.inf, False, False),
        ("outcome", 3.0, False, False),
    ):
        found = base._replace(**{**good, name: np.full(16, value)})
        assert crossings.smooth(found).all() == smooth, name
        assert crossings.aggressive(found).all() == aggressive, name


def came_through(name, direction):
    """Whether flights come through an abrupt surface, by lag and delay: all of them at once, or none, bobbing."""
    found = {}
    for lag, delay in product(crossing_lag.LAGS, crossing_lag.DELAYS):
        flown = crossing_lag.setting(name, direction, 0.0, lag, delay, 16)
        assert flown["through"] == flown["at_once"] == (16 if flown["crossings"] == 1.0 else 0)
        found[lag, delay] = flown["through"] == 16
    return found


def test_late_notice_and_lag_keep_the_vehicle_at_an_abrupt_surface():
    found = came_through("paper", "exit")
    assert {place for place, through in found.items() if through} == {(0.0, 0.0), (0.0, 0.05), (0.033, 0.0)}
    assert all(came_through("paper", "entry").values())


@pytest.mark.parametrize("name", ["paper-pre-spin", "robust"])
def test_rotors_that_turn_before_they_are_out_of_the_water_bring_it_through(name):
    assert all(came_through(name, "exit").values())


def test_the_fastest_cell_has_enough_flights_and_none_faster_has():
    cells = {}
    for speed, share in ((0.5, 1.0), (1.0, 0.99), (2.0, 0.989)):
        cells["entry", 0.0, 0.1, speed] = {"speed": speed, "smooth": [share, 0.0, 1.0]}
    assert crossings_page.fastest(cells, ("entry", 0.0, 0.1), "smooth")["speed"] == 1.0
    assert crossings_page.fastest(cells, ("exit", 0.0, 0.1), "smooth") is None


def test_the_page_is_what_was_measured():
    assert crossings_page.section() in (ROOT / "docs" / "crossings.md").read_text(encoding="utf-8")
