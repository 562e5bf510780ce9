"""Weather in pictures: what is drawn is what is flown."""

import gymnasium as gym
import numpy as np
import pytest
from numba import njit

import hydrone_gym
from hydrone_gym import Weather
from hydrone_gym.cli import main
from hydrone_gym.cli.replay import _restored
from hydrone_gym.evaluation import fly
from hydrone_gym.evaluation.flight_figures import attitude_references
from hydrone_gym.evaluation.saved import read_flights, restore
from hydrone_gym.rendering import shapes
from hydrone_gym.rendering.figures import plot_position
from hydrone_gym.rendering.frame import _write
from hydrone_gym.rendering.outdoors import CURRENT_SCALE, WIND_SCALE, barbed
from hydrone_gym.rendering.paths import crossing_points, split_media
from hydrone_gym.rendering.replay import write_replay
from hydrone_gym.rendering.track import moment_of
from hydrone_gym.simulation import conditions
from hydrone_gym.weather import waves
from hydrone_gym.world.scenario import Scenario, save_scenario
from planners import StraightLine
from tests.rendering.replay_pages import read_page

STORM = Weather(wind=4.0, current=0.3, wave_height=0.4, wave_period=2.5, sea="jonswap")


def flown(**options):
    env = gym.make("HydroneGym/AirToWater-v0", weather=STORM, num_obstacles=3, **options)
    return env, fly(env, StraightLine.for_env(env), seed=2)


@njit
def _level(sea, place, time):
    swell = waves.add_wave(waves.calm(), sea.first, place, (0.0, 0.0), time)
    swell = waves.add_wave(swell, sea.second, place, (0.0, 0.0), time)
    swell = waves.add_wave(swell, sea.third, place, (0.0, 0.0), time)
    return waves.add_wave(swell, sea.fourth, place, (0.0, 0.0), time).elevation


def test_elevation_is_that_of_the_kernel():
    env, _ = flown()
    sea = env.unwrapped.truth["conditions"].sea
    places = np.random.default_rng(0).uniform(-10.0, 10.0, (50, 2))
    drawn = waves.elevation(sea, *places.T, 7.3)
    np.testing.assert_allclose(drawn, [_level(sea, (x, y, 0.0), 7.3) for x, y in places], atol=1e-12)
    assert np.ptp(drawn) > 0.1


def test_a_trace_holds_the_flight_and_its_weather():
    env, flight = flown()
    ticks, weather = env.unwrapped.simulation.ticks, flight.trace.weather
    ends = np.minimum(ticks * np.arange(len(flight.states)), len(flight.trace.times) - 1)
    np.testing.assert_array_equal(flight.trace.states[ends], flight.states)
    assert {name: len(values) for name, values in weather.items()} == dict.fromkeys(weather, len(flight.trace.times))
    told = env.unwrapped._core.outdoors.weather()
    np.testing.assert_array_equal(weather["wind"][-1], told["wind"][0])


def test_arrows_point_where_air_and_water_go():
    env, flight = flown()
    world, moment = env.unwrapped.world, moment_of(flight)
    seen, weather = moment.outdoors(world), flight.trace.weather
    np.testing.assert_allclose(np.diff(seen.wind, axis=0)[0], WIND_SCALE * weather["wind"][-1])
    np.testing.assert_allclose(np.diff(seen.current, axis=0)[0], CURRENT_SCALE * weather["water"][-1])
    assert f"wind {np.linalg.norm(weather['wind'][-1]):.1f} m/s" in seen.words
    shaft, *barbs = barbed(seen.wind)
    np.testing.assert_array_equal(shaft, seen.wind)
    assert all(np.array_equal(barb[0], seen.wind[1]) for barb in barbs)
    assert np.abs(seen.waves[..., 2]).max() > 0.05


def test_still_weather_has_nothing_to_draw():
    env = gym.make("HydroneGym/AirToWater-v0", num_obstacles=3)
    flight = fly(env, StraightLine.for_env(env), seed=2)
    assert flight.trace.weather == {}
    assert moment_of(flight).outdoors(env.unwrapped.world) is None


@pytest.mark.parametrize("weather", [STORM, Weather(wind=3.0), Weather(current=0.3), Weather(wave_height=0.3)])
def test_pictures_show_it(weather):
    def picture(weather):
        env = gym.make("HydroneGym/AirToWater-v0", weather=weather, num_obstacles=3, render_mode="rgb_array")
        env.reset(seed=0)
        env.step(env.unwrapped._core.episodes.rows["reference"][0])
        return env.render()

    assert (picture(weather) != picture(hydrone_gym.Weather())).any(axis=2).sum() > 200


def test_a_saved_flight_flies_again_in_its_weather(tmp_path):
    given = ["--policy", "straight-line", "--mission", "random", "--weather", "2", "--out", str(tmp_path)]
    main(["fly", *given, "--no-figures"])
    (saved,) = read_flights(tmp_path / "flight.json")
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=len(saved.scenario.obstacles))
    again = restore(saved, env.unwrapped.simulation)
    np.testing.assert_array_equal(again.states, saved.states)
    assert again.trace.weather["wind"].any()


def test_a_snapshot_keeps_the_path_flown_in_weather():
    env = gym.make("HydroneGym/AirToWater-v0", weather=STORM, num_obstacles=3, render_mode="rgb_array")
    env.reset(seed=4)
    for _ in range(3):
        env.step(np.array([-8.0, -8.0, 6.0, 0.0]))
    snapshot, before = env.unwrapped.get_state(), env.render()
    env.step(np.array([-8.0, -8.0, 6.0, 0.0]))
    env.unwrapped.set_state(snapshot)
    np.testing.assert_array_equal(env.render(), before)


def test_a_path_crosses_the_surface_where_it_is():
    line = np.array([[0.0, 0.0, 2.0], [1.0, 0.0, 0.5], [2.0, 0.0, 0.5], [3.0, 0.0, -1.0]])
    level = np.array([0.0, 0.0, 1.0, 1.0])  # a crest comes
    np.testing.assert_allclose(crossing_points(line, level), [[1.5, 0.0, 0.5]])
    air, water = split_media(line, level)
    assert [part[-1, 0] for part in air] == [1.5]
    assert [part[0, 0] for part in water] == [1.5]
    figure = plot_position(np.arange(4.0), line, line, elevations=level)
    z = figure.axes[2].lines
    assert [list(drawn.get_xdata()) for drawn in z if len(drawn.get_xdata()) == 2] == [[2.0, 2.0]]
    np.testing.assert_array_equal(z[-1].get_ydata(), level)


def test_plumb_lines_end_on_the_moving_surface():
    env, flight = flown()
    trace, level = flight.trace, moment_of(flight).outdoors(env.unwrapped.world).level
    # the kernel looks at it in the middle of the last tick, half a tick of 0.05 s before
    assert abs(level - trace.weather["elevation"][-1]) < 0.05
    (line,) = shapes.plumb(trace.states[-1, :3], 0.01, level)
    assert line[6] == level
    assert line[3] == trace.states[-1, 2]


def test_attitude_references_are_those_of_the_medium_the_controller_notices():
    env, flight = flown()
    trace, simulation = flight.trace, env.unwrapped.simulation
    driven = trace.driven
    assert (driven != (trace.states[:, 2] >= 0.0)).any()  # a crest or a trough
    turned = trace.conditions.copy()
    turned[:, conditions.DRIVEN] = 1.0
    one = attitude_references(simulation, trace)
    other = attitude_references(simulation, trace._replace(conditions=turned))
    np.testing.assert_array_equal(one[driven], other[driven])
    assert not np.array_equal(one[~driven], other[~driven], equal_nan=True)


def test_captions_fit_into_small_pictures():
    wide, narrow = np.zeros((240, 640, 3), np.uint8), np.zeros((240, 320, 3), np.uint8)
    for image in (wide, narrow):
        _write(image, "23.7 s   out of bounds   wind 10.5 m/s, water 0.9 m/s, waves 0.50 m", "#b04a00")
        assert not image[:, -4:].any()  # its right end is rounded off within the picture
        assert image.any()


def test_a_saved_flight_keeps_the_weather_of_its_scenario(tmp_path, capsys):
    scenario = Scenario(start=(-8.0, -8.0, 5.0, 0.0), goal=(-7.0, -8.0, 4.0), obstacles=(), weather=STORM)
    save_scenario(scenario, tmp_path / "storm.json")
    main(["fly", "--scenario", str(tmp_path / "storm.json"), "--out", str(tmp_path), "--no-figures"])
    (saved,) = read_flights(tmp_path / "flight.json")
    assert saved.scenario.weather == STORM
    take = _restored(saved)
    assert len(take.trees) == len(saved.references)
    assert "otherwise" not in capsys.readouterr().err


def test_a_page_moves_surface_and_arrows_with_the_flight(tmp_path):
    env, flight = flown()
    sea, trace = env.unwrapped.truth["conditions"].sea, flight.trace
    write_replay(flight, env.unwrapped.simulation, tmp_path / "storm.html", title="Storm")
    text, timeline = read_page(tmp_path / "storm.html")
    assert "the moving surface" in text
    for tick in (0, 10, len(trace.times) - 1):
        time = trace.times[tick]
        points = timeline.at(time, "/weather/waves", "points").reshape(-1, 3)
        np.testing.assert_allclose(points[:, 2], waves.elevation(sea, *points.T[:2], time), atol=0.02)
        start, end = timeline.at(time, "/weather/wind", "points").reshape(-1, 3)[:2]
        np.testing.assert_allclose(end - start, WIND_SCALE * trace.weather["wind"][tick], atol=0.01)
        foot = timeline.at(time, "/plumb", "points").reshape(-1, 3)[1]
        np.testing.assert_allclose(foot[2], waves.elevation(sea, *trace.states[tick, :2], time), atol=1e-6)
