"""Flights at levels of weather, and success against the level."""

import io
import re
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from tqdm import tqdm

from hydrone_gym import Weather
from hydrone_gym.evaluation import HELD_OUT, Suite, evaluate, fly, load_suite, wilson_interval
from hydrone_gym.evaluation.levels import flown_levels, level_overview, level_tables
from hydrone_gym.evaluation.page_figures import charts_of
from hydrone_gym.evaluation.plan import make_plan, plan_of
from hydrone_gym.evaluation.run import carry_out
from hydrone_gym.evaluation.shown import fly_record
from hydrone_gym.evaluation.summary import summarise
from hydrone_gym.simulation.simulation import trajectory
from planners import StraightLine
from tests.evaluation.test_records import ROW
from tests.evaluation.test_run import timeless

ENDS = {0: ("GOAL", "GOAL", "GOAL"), 3: ("GOAL", "COLLISION", "OUT_OF_BOUNDS"), 5: ("TIMEOUT", "DIVERGED", "GOAL")}


def rows(levels=ENDS, policies=("line", "other")):
    """Three flights a mission, policy and level; "other" always ends as the first of the level."""
    return [
        replace(ROW, suite=f"weather-{k}-v1", mission=m, world=w, policy=p, outcome=o, success=o == "GOAL")
        for k in levels
        for m in ("air-to-water", "random")
        for p in policies
        for w, o in enumerate(ENDS[k] if p == "line" else ENDS[k][:1] * 3)
    ]


def test_the_name_of_all_levels_is_six_suites():
    plan = make_plan("weather", "straight-line", worlds=2)
    assert [suite.name for suite in plan.suites] == [f"weather-{level}-v1" for level in range(6)]
    assert len(plan.keys()) == 6 * 3 * 2
    assert plan_of(plan.arguments()).keys() == plan.keys()
    with pytest.raises(ValueError, match="suites must have different names"):
        make_plan(["weather", "weather-3"], "straight-line")


def test_a_row_is_the_flight_in_the_weather_of_its_number(tmp_path):
    records = evaluate(["weather-0", "weather-3"], "straight-line", worlds=2, out=tmp_path)
    for suite, level in (("weather-0-v1", 0), ("weather-3-v1", 3)):
        for mission in load_suite(suite).first(2).missions:
            env = gym.make(mission.env_id, num_obstacles=20, weather=level)
            for world, scenario in enumerate(mission.scenarios):
                flight = fly(env, StraightLine.for_env(env), seed=HELD_OUT + world, scenario=scenario)
                (row,) = [r for r in records if r.key[:3] == (suite, mission.name, world)]
                assert (row.outcome, row.time, row.energy) == (flight.outcome.name, flight.time, flight.energy)
                assert row.length == flight.length > 0.0
    still, windy = records[: len(records) // 2], records[len(records) // 2 :]
    assert all(one.energy != other.energy for one, other in zip(still, windy, strict=True))
    plan = make_plan(["weather-0", "weather-3"], "straight-line", worlds=2)
    assert fly_record(records[-1], plan)[0].energy == records[-1].energy
    again = evaluate(["weather-0", "weather-3"], "straight-line", worlds=3)
    assert timeless(r for r in again if r.world < 2) == timeless(records)


def test_worlds_in_a_batch_have_the_weather_of_single_flights():
    suite = load_suite("weather-4").first(3)
    alone = evaluate(suite, "straight-line")
    together = evaluate(replace(suite, batch=True), "straight-line")
    assert timeless(together) == timeless(replace(record, length=None, zone_speed=None) for record in alone)


def test_weather_of_ones_own_is_evaluated(tmp_path):
    options = {"weather": Weather(wind=4.0), "num_obstacles": 2}
    suite = Suite.drawn("HydroneGym/AirToWater-v0", [3], options, name="windy")
    (record,) = evaluate(suite, "straight-line", out=tmp_path)
    assert timeless(evaluate(suite, "straight-line", out=tmp_path)) == timeless([record])
    other = replace(suite, missions=(replace(suite.missions[0], options={**options, "weather": Weather(wind=3.0)}),))
    with pytest.raises(ValueError, match="holds an evaluation with other arguments"):
        evaluate(other, "straight-line", out=tmp_path)


def test_a_trace_in_weather_passes_through_the_states():
    env = gym.make("HydroneGym/WaterToAir-v0", weather=4)
    flight = fly(env, StraightLine.for_env(env), seed=2)
    whole = flight.states[:-1]
    np.testing.assert_array_equal(flight.trace.states[: 10 * len(whole) : 10], whole)
    np.testing.assert_array_equal(flight.trace.states[-1], flight.states[-1])
    env.reset(seed=2)
    simulation, began = env.get_wrapper_attr("simulation"), env.unwrapped.get_state()
    for _ in range(2):  # what it began in is not changed
        flown = flight.references, began.scenario.obstacles, began.conditions
        again = trajectory(simulation, began.episodes.rows, *flown)[1]
        np.testing.assert_array_equal(again, flight.trace.states)
    with pytest.raises(ValueError, match="conditions must be given where the simulation has weather"):
        trajectory(simulation, began.episodes.rows, flight.references)


def test_tables_count_success_and_failures():
    success, failures = level_tables(summarise(rows()))
    assert success.heads == ("policy", "flights\na level", "level 0", "level 3", "level 5")
    low, high = (f"{100.0 * end:.0f}" for end in wilson_interval(2, 6))
    third = f"33.3 [{low}, {high}]"
    assert success.rows[0] == ("other", "6", "100.0 [61, 100]", "100.0 [61, 100]", "0.0 [0, 39]")
    assert success.rows[1] == ("line", "6", "100.0 [61, 100]", third, third)
    assert success.title == "all missions: success (%) by level of weather"
    assert "3: 3, 0.3, 0.2; 4: 5, 0.4, 0.3" in success.notes[1]
    assert failures.rows == (
        ("other", "time-out", "0", "0", "6"),
        ("line", "collision", "0", "2", "0"),
        ("line", "out of bounds", "0", "2", "0"),
        ("line", "time-out", "0", "0", "2"),
        ("line", "diverged", "0", "0", "2"),
    )
    (narrow,) = level_overview(summarise(rows()))
    assert narrow.rows[1] == ("line", "100.0", "33.3", "33.3")


def test_levels_are_compared_only_where_there_are_two():
    for levels in ((3,), ()):
        records = rows(levels) or [replace(ROW, suite="paper-20-v1")]
        summaries = summarise(records)
        assert not flown_levels(summaries)
        assert level_tables(summaries) == level_overview(summaries) == []
        assert "Success against weather" not in [chart.heading for chart in charts_of(records, summaries)]


def test_an_unfinished_level_leaves_gaps():
    cut = [r for r in rows() if r.suite != "weather-5-v1" or (r.policy, r.mission) == ("line", "air-to-water")]
    levels = flown_levels(summarise(cut))
    assert {mission: list(flown) for mission, flown in levels.items()} == {
        "all missions": [0, 3],
        "air-to-water": [0, 3, 5],
        "random": [0, 3],
    }
    cut = [r for r in rows() if r.suite != "weather-5-v1" or r.policy == "line"]
    assert level_tables(summarise(cut))[0].rows[0] == ("other", "6", "100.0 [61, 100]", "100.0 [61, 100]", "–")


def test_the_figure_has_a_line_a_policy_and_names_the_weather():
    records = rows()
    chart = charts_of(records, summarise(records))[0]
    assert chart.heading == "Success against weather"
    assert [panel.words for panel in chart.panels] == [
        f"Success against weather: {mission}" for mission in ("all missions", "air-to-water", "random")
    ]
    (axes,) = chart.panels[0].figure.axes
    assert [bar.get_label() for bar in axes.containers] == ["line", "other"]
    np.testing.assert_allclose(axes.containers[0].lines[0].get_ydata(), [100.0, 100.0 / 3.0, 100.0 / 3.0])
    assert [tick.get_text() for tick in axes.get_xticklabels()] == ["0\n0\n0\n0", "3\n3\n0.3\n0.2", "5\n8\n0.5\n0.5"]


def test_the_bar_names_the_level_that_is_flown(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    shown = Terminal()
    monkeypatch.setattr(
        "hydrone_gym.evaluation.run.tqdm", lambda **options: tqdm(file=shown, mininterval=0.0, **options)
    )
    carry_out(make_plan(["weather-0", "weather-2"], "straight-line", worlds=1), progress=True)
    assert list(dict.fromkeys(re.findall(r"weather-\d-v1", shown.getvalue()))) == ["weather-0-v1", "weather-2-v1"]
