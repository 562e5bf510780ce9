"""`python -m agents.evaluation`: the table of an agent on held-out worlds."""

import json
import shutil

import gymnasium as gym
import pytest

from agents import load_agent
from agents.agent import PRETRAINED
from agents.evaluation import MISSIONS, evaluate, main
from planners import StraightLine
from planners.shield import Shield


def scores(capsys, *options):
    assert main(["--episodes", "6", "--json", *options]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_shipped_agent_and_its_folder_score_the_same(tmp_path, capsys):
    shutil.copytree(PRETRAINED / "ppo", tmp_path / "mine")
    by_name = scores(capsys, "--agent", "ppo")
    assert [score["mission"] for score in by_name] == list(MISSIONS)
    assert by_name == scores(capsys, "--agent", str(tmp_path / "mine"))
    alone = evaluate(load_agent("ppo"), MISSIONS[1], episodes=6)
    assert (by_name[1]["time"], by_name[1]["success"]) == (alone.time, alone.success)


def test_worlds_and_the_shield(capsys):
    worlds = ["--agent", "ppo", "--obstacles", "40", "--radii", "0.8", "1.8"]
    shielded = scores(capsys, *worlds, "--shield")
    assert shielded != scores(capsys, *worlds)
    options = {"num_obstacles": 40, "obstacle_radius": (0.8, 1.8)}
    for mission, score in zip(MISSIONS, shielded, strict=True):
        env = gym.make(mission, **options)
        alone = evaluate(Shield.for_env(load_agent("ppo", env), env), mission, episodes=6, options=options)
        assert (score["time"], score["energy"]) == (alone.time, alone.energy)


def test_a_policy_that_has_learnt_nothing(capsys):
    env = gym.make(MISSIONS[2])
    alone = evaluate(Shield.for_env(StraightLine.for_env(env), env), MISSIONS[2], episodes=6)
    score = scores(capsys, "--agent", "straight-line", "--shield")[2]
    assert (score["time"], score["energy"]) == (alone.time, alone.energy)


def test_the_table(capsys):
    assert main(["--agent", "ppo", "--episodes", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("| mission | worlds | success % | 95 % interval |")
    assert [line.split("|")[1].strip() for line in lines[2:]] == list(MISSIONS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--agent", "nobody"], "no agent 'nobody': shipped are"),
        (["--agent", "ppo", "--episodes", "0"], "episodes must be at least 1, got 0"),
        (["--agent", "ppo", "--obstacles", "-1"], "num_obstacles"),
    ],
)
def test_bad_options(capsys, options, message):
    assert main(options) == 2
    assert message in capsys.readouterr().err
