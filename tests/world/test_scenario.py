"""Scenarios: value semantics, the rules of a world, and the JSON file."""

import copy
import json
import math
import pickle
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hydrone_gym.weather import Spread, Weather
from hydrone_gym.world.scenario import Scenario, load_scenario, save_scenario, validate
from hydrone_gym.world.world import World

RADIUS = 0.45
START = (-9.0, -9.0, 8.0, 0.25)
GOAL = (9.0, 9.0, -3.0)
SPHERES = ((0.0, 0.0, 1.0, 1.5), (1.0, 2.0, -3.0, 0.5))
SQUALL = Weather(
    wind=1.0 / 3.0, wave_direction=-0.1, shear=True, sea="jonswap", spread=Spread(drag=0.1, height=(0.1, 0.2))
)


def scenario(**changes):
    return Scenario(**({"start": START, "goal": GOAL, "obstacles": SPHERES, "name": "two"} | changes))


def test_fields_take_one_form():
    made = Scenario(start=[1, 2, 3, 4], goal=np.array([1.0, 2.0, -3.0]), obstacles=[[1, 2, 3, 4]])
    assert made.start == (1.0, 2.0, 3.0, 4.0)
    assert all(type(value) is float for value in made.start + made.goal)
    assert made.obstacles.dtype == np.float64
    assert made.obstacles.shape == (1, 4)
    assert Scenario(start=START, goal=GOAL, obstacles=[]).obstacles.shape == (0, 4)


def test_media_follow_the_side_of_the_surface():
    assert scenario().media == ("air", "water")
    assert scenario(start=(0, 0, -2, 0), goal=(0, 0, 2)).media == ("water", "air")


def test_obstacles_are_an_own_read_only_array():
    given_array = np.array(SPHERES)
    made = scenario(obstacles=given_array)
    given_array[0, 0] = 99.0
    assert made.obstacles[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.obstacles[0, 0] = 1.0


@pytest.mark.parametrize(
    "changes",
    [
        {"start": (*START[:3], 0.5)},
        {"goal": (9.0, 9.0, -3.5)},
        {"obstacles": SPHERES[:1]},
        {"obstacles": (SPHERES[0], (1.0, 2.0, -3.0, 0.6))},
        {"name": "other"},
        {"weather": SQUALL},
    ],
)
def test_scenarios_are_equal_by_value(changes):
    assert scenario() == scenario()
    assert hash(scenario()) == hash(scenario())
    assert scenario() != scenario(**changes)
    assert scenario() != "a scenario"


@pytest.mark.parametrize("duplicate", [copy.deepcopy, copy.copy, lambda value: pickle.loads(pickle.dumps(value))])
def test_copies_are_equal_and_still_read_only(duplicate):
    again = duplicate(scenario())
    assert again == scenario()
    assert not again.obstacles.flags.writeable


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": (1.0, 2.0, 3.0)}, r"Scenario.start must hold 4 numbers \(x, y, z in m and yaw in rad\), got \(1.0"),
        ({"goal": (1.0, None, 3.0)}, r"Scenario.goal must hold 3 numbers \(x, y, z in m\), got \(1.0, None, 3.0\)"),
        ({"obstacles": np.zeros((2, 3))}, r"Scenario.obstacles must have shape \(M, 4\) \(m\), got \(2, 3\)"),
        ({"obstacles": [[1, 2, 3, 4], [1, 2]]}, r"Scenario.obstacles must hold four numbers \(m\) a row"),
        ({"name": 3}, "Scenario.name must be a string, got 3"),
        ({"weather": 3}, "Scenario.weather must be a Weather or None, got 3"),
    ],
)
def test_wrong_shapes_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        scenario(**changes)


def test_a_sound_scenario_is_valid():
    validate(scenario(), World(), RADIUS)
    validate(scenario(obstacles=[]), World(), RADIUS)
    # A sphere may reach through a wall, and touch everything but the ends.
    validate(scenario(obstacles=[(10.0, 0.0, 0.0, 3.0), (9.0, 0.0, 0.0, 3.0)]), World(), RADIUS)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": (-11.0, 0.0, 5.0, 0.0)}, r"start x must lie inside the box, between -10.0 and 10.0 m, got -11.0 m"),
        ({"start": (0.0, 0.0, 10.0, 0.0)}, r"start z must lie inside the box, between -5.0 and 10.0 m, got 10.0 m"),
        ({"start": (0.0, math.nan, 5.0, 0.0)}, r"start y must lie inside the box, .* got nan m"),
        ({"start": (0.0, 0.0, 0.8, 0.0)}, r"start z must lie outside the transition zone of \+-0.8 m, got 0.8 m"),
        ({"start": (0.0, 0.0, 5.0, math.inf)}, r"start yaw must be finite \(rad\), got inf"),
        ({"goal": (0.0, 12.0, -3.0)}, r"goal y must lie inside the box, between -10.0 and 10.0 m, got 12.0 m"),
        ({"goal": (0.0, 0.0, -0.3)}, r"goal z must lie outside the transition zone of \+-0.8 m, got -0.3 m"),
        ({"obstacles": (SPHERES[0], (0.0, math.nan, 0.0, 1.0))}, r"obstacle 1 must have finite numbers \(m\), got \[0"),
        ({"obstacles": (SPHERES[0], (0.0, 0.0, 0.0, math.inf))}, r"obstacle 1 must have finite numbers \(m\)"),
        ({"obstacles": (SPHERES[0], (0.0, 0.0, 0.0, 0.0))}, r"obstacle 1 must have a positive radius \(m\), got 0.0"),
        (
            {"obstacles": (SPHERES[0], (-9.0, -9.0, 6.0, 1.6))},
            r"start must keep more than the vehicle's radius of 0.45 m to the surface of obstacle 1, "
            r"got a clearance of -0.05 m",
        ),
        ({"obstacles": (SPHERES[0], (9.0, 9.0, -3.0, 1.0))}, r"goal must keep more .* obstacle 1, .* of -1.45 m"),
    ],
)
def test_impossible_scenarios_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        validate(scenario(**changes), World(), RADIUS)


@pytest.mark.parametrize("radius", [0.0, -1.0, math.nan, math.inf])
def test_impossible_vehicle_radius_is_refused(radius):
    with pytest.raises(ValueError, match=rf"vehicle radius must be positive \(m\), got {radius}"):
        validate(scenario(), World(), radius)


def test_clearance_counts_the_vehicles_radius():
    near = scenario(obstacles=[(-9.0, -9.0, 6.0, 1.5)])  # 0.5 m of free space
    validate(near, World(), 0.499)
    with pytest.raises(ValueError, match=r"clearance of 0 m"):
        validate(near, World(), 0.5)


numbers = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    start=st.tuples(*[numbers] * 4),
    goal=st.tuples(*[numbers] * 3),
    obstacles=st.lists(st.tuples(*[numbers] * 4), max_size=5),
    name=st.text(st.characters(codec="utf-8")),
)
def test_json_keeps_every_bit(tmp_path, start, goal, obstacles, name):
    written = Scenario(start=start, goal=goal, obstacles=obstacles, name=name)
    save_scenario(written, tmp_path / "scenario.json")
    read = load_scenario(str(tmp_path / "scenario.json"))
    assert read == written
    # Bytes, because -0.0 equals 0.0.
    assert np.array(read.start + read.goal).tobytes() == np.array(written.start + written.goal).tobytes()
    assert read.obstacles.tobytes() == written.obstacles.tobytes()


def test_file_says_what_it_is(tmp_path):
    save_scenario(scenario(), str(tmp_path / "scenario.json"))
    content = json.loads((tmp_path / "scenario.json").read_text())
    assert content["format"] == "hydrone_gym scenario"
    assert content["version"] == 1
    assert content["start"] == list(START)


def test_weather_is_part_of_the_value():
    made = scenario(weather=SQUALL)
    assert made == scenario(weather=replace(SQUALL)) != scenario(weather=replace(SQUALL, wind=0.5)) != scenario()
    assert len({hash(made), hash(scenario()), hash(scenario(weather=Weather()))}) == 3
    assert repr(SQUALL) in repr(made)
    assert pickle.loads(pickle.dumps(made)) == made


def test_files_carry_weather_only_when_it_is_given(tmp_path):
    """A file with weather is of version 2: a reader of version 1 refuses it, instead of flying in still air."""
    path = tmp_path / "scenario.json"
    save_scenario(scenario(), path)
    assert "weather" not in json.loads(path.read_text())
    assert load_scenario(path).weather is None
    for weather in (SQUALL, Weather()):
        save_scenario(scenario(weather=weather), path)
        assert json.loads(path.read_text())["version"] == 2
        assert repr(load_scenario(path)) == repr(scenario(weather=weather))


def test_files_from_before_there_was_weather_are_read(tmp_path):
    path = tmp_path / "old.json"
    path.write_text(
        '{"format": "hydrone_gym scenario", "version": 1, "start": [-9.0, -9.0, 8.0, 0.25], "goal": [9.0, 9.0, -3.0],'
        ' "obstacles": [[0.0, 0.0, 1.0, 1.5], [1.0, 2.0, -3.0, 0.5]], "name": "two"}'
    )
    assert load_scenario(path) == scenario()


def test_weather_in_a_file_may_leave_out_what_is_as_usual(tmp_path):
    path = tmp_path / "breeze.json"
    save_scenario(scenario(weather=Weather(wind=2.0)), path)
    content = json.loads(path.read_text())
    content["weather"] = {"wind": 2, "spread": {}}
    path.write_text(json.dumps(content))
    assert load_scenario(path) == scenario(weather=Weather(wind=2.0))


def test_unsavable_numbers_are_refused_without_a_file(tmp_path):
    path = tmp_path / "scenario.json"
    with pytest.raises(ValueError, match=r"scenario.json: a scenario with numbers that are not finite cannot be saved"):
        save_scenario(scenario(goal=(0.0, 0.0, math.inf)), path)
    assert not path.exists()


def _without(key):
    return lambda content: content.pop(key)


def _with(**entries):
    return lambda content: content.update(entries)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_without("format"), 'not a scenario file: "format" must be "hydrone_gym scenario"'),
        (_with(format="other"), 'not a scenario file: "format" must be "hydrone_gym scenario"'),
        (_with(version=3), '"version" must be 1 or 2, got 3'),
        (_without("version"), '"version" must be 1 or 2, got None'),
        (_with(version=2), "missing key 'weather'"),
        (_with(weather=asdict(SQUALL)), "unknown key 'weather'"),
        (_with(version=2, weather=None), '"weather" must be an object with a "spread", got None'),
        (_with(version=2, weather={"wind": 1.0}), '"weather" must be an object with a "spread"'),
        (_with(version=2, weather={"gale": 1, "air": 2, "spread": {}}), "weather: unknown key 'air', 'gale'"),
        (_with(version=2, weather={"spread": {"weight": 0.1}}), "weather: unknown key 'weight'"),
        (_with(version=2, weather={"wind": math.nan, "spread": {}}), r"Weather.wind must lie between .*, got nan"),
        (_with(version=2, weather={"wind": 10**400, "spread": {}}), r"Weather.wind must lie between .*, got 1000"),
        (_with(version=2, weather={"spread": {"height": [0.1]}}), r"Spread.height must be \(least, greatest\) .*\(m\)"),
        (_without("goal"), "missing key 'goal'"),
        (_with(wind=1, air=2), "unknown key 'air', 'wind'"),
        (_with(goal=[1, 2]), r"goal must be a list of 3 finite numbers, got \[1, 2\]"),
        (_with(start=[1, 2, 3, True]), r"start must be a list of 4 finite numbers, got \[1, 2, 3, True\]"),
        (_with(start="1234"), "start must be a list of 4 finite numbers, got '1234'"),
        (_with(goal=[1, 2, 10**400]), "goal must be a list of 3 finite numbers"),
        (_with(goal=[1, 2, math.nan]), r"goal must be a list of 3 finite numbers, got \[1, 2, nan\]"),
        (_with(obstacles=[[0, 0, 0, 1], [0, 0, 0]]), r"obstacle 1 must be a list of 4 finite numbers, got \[0, 0, 0\]"),
        (_with(obstacles=None), "obstacles must be a list, got None"),
        (_with(name=None), "Scenario.name must be a string, got None"),
    ],
)
def test_spoilt_files_are_refused_with_their_path(tmp_path, spoil, message):
    path = tmp_path / "spoilt.json"
    save_scenario(scenario(), path)
    content = json.loads(path.read_text())
    spoil(content)
    path.write_text(json.dumps(content))
    with pytest.raises(ValueError, match=rf"spoilt\.json: {message}"):
        load_scenario(path)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.95])
def test_truncated_files_are_refused(tmp_path, share):
    path = tmp_path / "truncated.json"
    save_scenario(scenario(), path)
    text = path.read_text()
    path.write_text(text[: int(share * len(text))])
    with pytest.raises(ValueError, match=r"truncated\.json: not complete JSON: .* line \d+ column \d+"):
        load_scenario(path)


def test_other_content_is_refused(tmp_path):
    path = tmp_path / "other.json"
    for content, message in (
        (b"[]", "not a scenario file"),
        (b"\xff\xfe\x00", "codec can't decode"),
        (b"1e999", "not"),
    ):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=rf"other\.json: .*{message}"):
            load_scenario(path)
    with pytest.raises(FileNotFoundError):
        load_scenario(Path(tmp_path / "absent.json"))
