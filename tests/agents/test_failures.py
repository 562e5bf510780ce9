"""`hydrone failures`: the report holds exactly the failures of the evaluation, and what worlds are like."""

import csv
import json

import gymnasium as gym
import numpy as np
import pytest
from PIL import Image

from agents.failures.report import find_failures
from agents.failures.tables import COLUMNS
from agents.failures.worlds import MEDIA, features_of
from hydrone_gym.cli import main
from hydrone_gym.evaluation import HELD_OUT, MISSIONS, Suite, fly
from hydrone_gym.evaluation.plan import make_plan
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.world.bodies import gaps_along
from planners import StraightLine

EPISODES = 12
FIGURES = ("failures-where.png", "failures-how.png", "failures-worlds.png")


def report(folder, capsys, *options):
    """Run the command; return what it printed and the lines of its CSV file."""
    assert (
        main(["failures", "--agent", "straight-line", "--episodes", str(EPISODES), "--out", str(folder), *options]) == 0
    )
    with (folder / "failures.csv").open(newline="", encoding="utf-8") as stream:
        return capsys.readouterr().out, list(csv.DictReader(stream))


def table(text, title):
    """Cells of a Markdown table by row, found by the title of its first column."""
    lines = text[text.index(f"| {title} |") :].split("\n\n")[0].splitlines()
    return {cells[0]: cells[1:] for cells in ([c.strip() for c in line.strip("|").split("|")] for line in lines[2:])}


def inked(path):
    with Image.open(path) as picture:
        return (np.asarray(picture.convert("L")) < 250).mean()


@pytest.fixture(scope="module")
def flown():
    """The straight line in the same worlds, one flight at a time: mission -> [(seed, flight)]."""
    flights = {}
    for mission in MISSIONS:
        env = gym.make(mission)
        policy = StraightLine.for_env(env)
        flights[mission] = [(seed, fly(env, policy, seed=seed)) for seed in range(HELD_OUT, HELD_OUT + EPISODES)]
    return flights


def test_the_report_holds_the_failures_of_the_evaluation(tmp_path, capsys, flown):
    printed, lines = report(tmp_path / "new" / "folder", capsys)
    text = (tmp_path / "new" / "folder" / "failures.md").read_text(encoding="utf-8")
    assert "|--" not in printed  # tables for people, not their Markdown
    assert "failures of worlds" in printed
    assert "horizontal m/s" in text
    failed = [(m, str(seed), f) for m in MISSIONS for seed, f in flown[m] if f.outcome is not Outcome.GOAL]
    assert len(failed) > 5
    assert [(line["mission"], line["seed"]) for line in lines] == [(mission, seed) for mission, seed, _ in failed]
    for line, (_, _, flight) in zip(lines, failed, strict=True):
        last = flight.trace.states[-1]
        assert line["outcome"] == flight.outcome.name
        assert float(line["time_s"]) == pytest.approx(flight.time)
        assert [float(line[key]) for key in ("x_m", "y_m", "z_m")] == pytest.approx(last[:3], abs=1e-4)
        assert float(line["horizontal_speed_m_s"]) == pytest.approx(np.hypot(*last[6:8]), abs=1e-4)
        touched = flight.scenario.obstacles[int(line["sphere"])]
        assert np.linalg.norm(touched[:3] - last[:3]) - touched[3] == pytest.approx(0.45, abs=0.11)  # a tick at 2 m/s
        assert tuple(touched) in set(map(tuple, flight.detected))
    assert list(lines[0]) == list(COLUMNS)
    assert {line["interventions"] for line in lines} == {""}
    causes, parts = table(text, "cause"), table(text, "where")
    for column, mission in enumerate(MISSIONS):
        count = sum(name == mission for name, _, _ in failed)
        assert causes["failures of worlds"][column] == f"{count} of {EPISODES} ({100 * count / EPISODES:.2f} %)"
        for rows in (causes, parts):
            counted = [int(cells[column].split()[0]) for name, cells in rows.items() if name != "failures of worlds"]
            assert sum(counted) == count
    for name in FIGURES:
        assert inked(tmp_path / "new" / "folder" / name) > 0.01


def test_no_failures(tmp_path, capsys):
    _, lines = report(tmp_path, capsys, "--obstacles", "0")
    text = (tmp_path / "failures.md").read_text(encoding="utf-8")
    assert lines == []
    assert (tmp_path / "failures.csv").read_text(encoding="utf-8").splitlines() == [",".join(COLUMNS)]
    assert table(text, "cause") == {"failures of worlds": [f"0 of {EPISODES} (0.00 %)"] * 3}
    assert "| where |" not in text
    for name in FIGURES:
        assert inked(tmp_path / name) > 0.005


def test_the_shield_leaves_no_contact(tmp_path, capsys):
    _, lines = report(tmp_path, capsys, "--shield", "--obstacles", "40", "--radii", "0.8", "1.8")
    assert {line["outcome"] for line in lines} <= {"TIMEOUT"}
    for line in lines:
        assert line["cause"].startswith("time-out: ")
        assert 0.0 < float(line["stayed_s"]) <= 120.0
        assert 0 <= int(line["interventions"]) <= 240


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--agent", "nobody"], "hydrone: error: no policy 'nobody': known are"),
        (["--agent", "ppo", "--episodes", "0"], "worlds must be a whole number of at least 1, got 0"),
        (["--agent", "ppo", "--obstacles", "100000000"], "--obstacles must be at most 1000, got 100000000"),
    ],
)
def test_bad_options(tmp_path, capsys, options, message):
    assert main(["failures", *options, "--out", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err


def test_json(tmp_path, capsys, flown):
    text, _ = report(tmp_path, capsys, "--json")
    document = json.loads(text)
    failed = [(m, seed, f.outcome.name) for m in MISSIONS for seed, f in flown[m] if f.outcome is not Outcome.GOAL]
    assert [(f["mission"], f["seed"], f["outcome"]) for f in document["failures"]] == failed
    assert [(score["mission"], score["episodes"]) for score in document["scores"]] == [(m, EPISODES) for m in MISSIONS]


class Crowd(StraightLine):
    """Stays where it is unless it flies alone."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        if np.ndim(observation["state"]) == 1:
            return super().predict(observation, state, episode_start, deterministic)
        return observation["reference"].astype(np.float32), tuple(observation["state"])


def test_a_policy_that_is_another_one_in_a_batch():
    suite = Suite.held_out(2, {"time_limit": 20.0, "num_obstacles": 0})
    with pytest.raises(ValueError, match=r"world 10000000: TIMEOUT in the batch but GOAL alone"):
        find_failures(make_plan(suite, {"crowd": Crowd.for_env}))


def test_a_policy_that_raises_gives_1(tmp_path, capsys):
    (tmp_path / "leaky.py").write_text(
        "class Leaky:\n  def __init__(self, env):\n    pass\n  predict = None.__init__\n"
    )
    options = ["--agent", f"{tmp_path / 'leaky.py'}:Leaky", "--episodes", "1", "--out", str(tmp_path)]
    assert main(["failures", *options]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "failed in suite held-out, mission HydroneGym/Mission-v0, world 0: ValueError" in line
    assert "predict must return (action, state), got NoneType" in line


@pytest.mark.parametrize("mission", MISSIONS)
def test_features_of_worlds(mission):
    """Against a search of 2001 points of the line, sphere by sphere."""
    scenarios = Suite.drawn(mission, range(HELD_OUT, HELD_OUT + 40)).missions[0].scenarios
    features = features_of(scenarios, reach=1.25)
    for number, scenario in enumerate(scenarios):
        start, goal = np.array(scenario.start[:3]), np.array(scenario.goal)
        points = start + np.linspace(0.0, 1.0, 2001)[:, None] * (goal - start)
        gaps = np.array([np.linalg.norm(points - x[:3], axis=1).min() - x[3] for x in scenario.obstacles])
        assert gaps_along(start, goal, scenario.obstacles) == pytest.approx(gaps, abs=1e-3)
        assert features.beside_line[number] == (gaps <= 1.0).sum()
        assert MEDIA[features.media[number]] == f"{scenario.media[0]} to {scenario.media[1]}"
        low = min(start, goal, key=lambda end: end[2])
        beside = 0
        for x, y, z, r in scenario.obstacles.tolist():
            in_way = z + r >= -1.25 and z - r <= 1.25  # the zone and the vehicle's radius
            beside += in_way and np.hypot(x - low[0], y - low[1]) - r <= 3.0
        crosses = scenario.media[0] != scenario.media[1]
        assert features.beside_column[number] == (beside if crosses else -1)
    assert gaps_along(np.ones(3), np.ones(3), np.array([[1.0, 1.0, 4.0, 1.0]])) == pytest.approx([2.0])
