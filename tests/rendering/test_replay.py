"""Replay pages: whole in one file, and their timeline is the flight."""

import re
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from scipy.spatial.transform import Rotation

import hydrone_gym  # noqa: F401
from hydrone_gym.evaluation import fly
from hydrone_gym.rendering.replay import HOLD, write_replay
from hydrone_gym.simulation.outcome import Outcome
from planners import CLRRT, StraightLine, TreeRecorder
from tests.rendering.replay_pages import read_page

SEED = 12
TITLE = 'Air & water, <seed "12">'


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """A flight of the CL-RRT, its trees, its environment, the page's file, text and timeline."""
    env = gym.make("HydroneGym/AirToWater-v0")
    recorder = TreeRecorder(CLRRT.for_env(env, seed=SEED))
    flight = fly(env, recorder, seed=SEED)
    page = tmp_path_factory.mktemp("pages") / "page.html"
    write_replay(flight, env.unwrapped.simulation, page, title=TITLE, trees=recorder.trees)
    return flight, recorder.trees, env, page, *read_page(page)


def test_a_page_is_one_small_file_that_needs_no_other(shown):
    *_, page, text, _ = shown
    assert page.stat().st_size < 2_000_000
    assert not re.search(r"""(?:src|href|action)\s*=\s*["']?\s*(?:https?:)?//""", text)
    assert not re.search(r"""(?:url|import|fetch)\(\s*["'`]?(?:https?:)?//""", text)
    assert set(re.findall(r"https?://[\w./-]+", text)) <= {"http://www.w3.org/2000/svg"}
    assert "<title>Air &amp; water, &lt;seed &quot;12&quot;&gt;</title>" in text
    assert "goal reached after 18.7 s" in text
    assert TITLE not in text


def test_the_timeline_is_as_long_as_the_flight(shown):
    flight, *_, timeline = shown
    assert timeline.seconds == pytest.approx(flight.time + HOLD, abs=1e-6)
    assert len(timeline.values("/vehicle", "wxyz")) == len(flight.trace.times) - 1  # it starts level, as frames do


def test_vehicle_and_reference_are_where_they_were(shown):
    flight, *_, timeline = shown
    for tick in (1, 57, 300, len(flight.trace.times) - 1):
        time, state = flight.trace.times[tick], flight.trace.states[tick]
        np.testing.assert_allclose(timeline.at(time, "/vehicle", "position"), state[:3], atol=1e-5)
        np.testing.assert_allclose(
            timeline.at(time, "/reference", "position"), flight.trace.references[tick, :3], atol=1e-5
        )
        w, x, y, z = timeline.at(time, "/vehicle", "wxyz")
        turn = Rotation.from_quat([x, y, z, w]).as_euler("ZXY")
        np.testing.assert_allclose(turn, state[[5, 3, 4]], atol=1e-5)


def test_the_path_grows_behind_the_vehicle(shown):
    flight, *_, timeline = shown
    states = flight.trace.states[:, :3]
    for tick in (1, 20, 21, 130, len(states) - 1):
        nodes = {m["name"] for time, m in timeline.messages if str(m.get("name")).startswith("/path/")}
        pieces = []
        for node in nodes:
            known = [points for time, points in timeline.values(node, "points") if time <= tick * 0.05 + 1e-6]
            pieces += [points.reshape(-1, 2, 3) for points in known[-1:]]
        edges = np.concatenate(pieces)
        edges = edges[np.lexsort(edges[:, 0].T)]
        flown = np.stack((states[:tick], states[1 : tick + 1]), axis=1)
        flown = flown[np.lexsort(flown[:, 0].T.astype(np.float32))]
        np.testing.assert_allclose(edges, flown, atol=1e-5)


def test_both_media_and_the_end_are_told(shown):
    flight, *_, timeline = shown
    texts = [text for _, text in timeline.values("/label", "text")]
    crossing = flight.transitions[0]["time"]
    assert timeline.at(1.0, "/label", "text") == "1.0 s, in the air"
    assert timeline.at(crossing, "/label", "text").endswith("crossing")
    assert timeline.at(flight.time - 0.5, "/label", "text").endswith("under water")
    assert texts[-1] == f"{flight.time:.1f} s, goal reached"
    names = {message.get("name") for _, message in timeline.messages}
    assert {"/water/surface", "/box/floor", "/goal/reach", "/start"} <= names


def there(timeline, time, node, count):
    """Which of so many obstacles a node shows at a time."""
    return timeline.at(time, node, "batched_scales")[:count] > 1e-3


def test_obstacles_are_detected_when_the_flight_detected_them(shown):
    flight, _, env, *_, timeline = shown
    spheres = flight.scenario.obstacles
    wet = spheres[:, 2] < 0.0
    observation, _ = env.reset(options={"scenario": flight.scenario})
    seen = []
    for period in range(len(flight.references) + 1):
        known = observation["obstacles"][observation["obstacles"][:, 3] > 0.0]
        seen.append(np.array([(known == sphere).all(axis=1).any() for sphere in spheres]))
        time = min(0.5 * period, flight.time)
        np.testing.assert_array_equal(there(timeline, time, "/obstacles/detected", len(spheres)), seen[-1])
        np.testing.assert_array_equal(
            there(timeline, time, "/obstacles/unknown, under water", wet.sum()), ~seen[-1][wet]
        )
        np.testing.assert_array_equal(
            there(timeline, time, "/obstacles/unknown, in the air", (~wet).sum()), ~seen[-1][~wet]
        )
        if period < len(flight.references):
            observation, *_ = env.step(flight.references[period])
    assert 0 < seen[0].sum() + 3 < seen[-1].sum() < len(spheres)
    scales = timeline.at(flight.time, "/obstacles/detected", "batched_scales")
    np.testing.assert_allclose(scales[seen[-1]], spheres[seen[-1], 3], rtol=1e-6)


def test_trees_are_those_of_their_period(shown):
    flight, trees, *_, timeline = shown
    assert len(trees) == len(flight.references)
    for period in (0, 7, 20, len(trees) - 1):
        tree, parts = trees[period], {}
        for part in ("air", "water", "plan"):
            points = timeline.at(0.5 * period, f"/tree/{part}", "points").reshape(-1, 2, 3)
            visible = timeline.at(0.5 * period, f"/tree/{part}", "visible") if period else True
            parts[part] = points if visible and points.any() else points[:0]
        np.testing.assert_allclose(parts["plan"], tree.edges[tree.path], atol=0.005)
        rest = np.setdiff1d(np.arange(len(tree.edges)), tree.path)
        np.testing.assert_allclose(parts["air"], tree.edges[rest][tree.air[rest]], atol=0.005)
        np.testing.assert_allclose(parts["water"], tree.edges[rest][~tree.air[rest]], atol=0.005)


def test_without_obstacles_and_trees(tmp_path, capsys):
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=0)
    recorder = TreeRecorder(StraightLine.for_env(env))
    flight = fly(env, recorder, seed=3)
    write_replay(flight, env.unwrapped.simulation, tmp_path / "page.html", title="", trees=recorder.trees)
    text, timeline = read_page(tmp_path / "page.html")
    assert flight.outcome is Outcome.GOAL
    assert timeline.seconds == pytest.approx(flight.time + HOLD, abs=1e-6)
    assert not {m.get("name") for _, m in timeline.messages} & {"/tree/air", "/obstacles/detected"}
    assert "tree of the planner" not in text
    assert capsys.readouterr() == ("", "")


def test_a_missing_folder_and_a_missing_extra_are_named(shown, tmp_path, monkeypatch):
    flight, _, env, *_ = shown
    simulation = env.unwrapped.simulation
    with pytest.raises(FileNotFoundError, match=r"folder of the page does not exist: .*nowhere"):
        write_replay(flight, simulation, tmp_path / "nowhere" / "page.html", title="")
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "hydrone-gym\[replay\]"'):
        write_replay(flight, simulation, tmp_path / "page.html", title="")
    assert not list(tmp_path.iterdir())
