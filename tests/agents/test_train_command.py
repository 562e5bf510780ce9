"""`hydrone train` from the command line, and the plain Stable-Baselines3 example of docs/training.md."""

import ast
import functools
import json
import re
from pathlib import Path

import gymnasium as gym
import pytest
import yaml

from agents import load_agent
from hydrone_gym.cli import main
from hydrone_gym.evaluation import evaluate_held_out
from tests.agents.test_training import RECIPES, SMALL

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def recipe(tmp_path):
    path = tmp_path / "small.yml"
    path.write_text(yaml.safe_dump(SMALL))
    return path


def test_train_then_shield_then_resume(tmp_path, recipe, capsys):
    first, second = tmp_path / "first", tmp_path / "second"
    options = ["--recipe", str(recipe), "--evaluation-episodes", "4", "--json"]
    assert main(["train", "ppo", "--out", str(first), *options]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["folder"] == str(first)
    assert [score["episodes"] for score in document["scores"]] == [4, 4, 4]
    assert load_agent(first / "agent").file.algorithm == "PPO"

    recipe.write_text(yaml.safe_dump({**SMALL, "shield": True}))
    assert main(["train", "ppo-shield", "--start-from", str(first), "--out", str(second), *options]) == 0
    failures = [name for score in json.loads(capsys.readouterr().out)["scores"] for name in score["outcomes"]]
    assert not {"COLLISION", "OUT_OF_BOUNDS", "ROUGH_TRANSITION"} & set(failures)

    assert main(["train", "--resume", str(second)]) == 0
    printed = capsys.readouterr()
    assert "HydroneGym/AirToWater-v0" in printed.out


@pytest.mark.parametrize("algorithm", ["sac", "td3", "tqc"])
def test_train_off_policy(tmp_path, capsys, algorithm):
    recipe = tmp_path / "off_policy.yml"
    recipe.write_text(yaml.safe_dump(RECIPES[algorithm]))
    out = tmp_path / "run"
    options = ["--recipe", str(recipe), "--evaluation-episodes", "2", "--num-threads", "1", "--json"]
    assert main(["train", algorithm, "--out", str(out), *options]) == 0
    assert len(json.loads(capsys.readouterr().out)["scores"]) == 3
    agent = load_agent(out / "agent").file
    assert (agent.algorithm, agent.network.output) == (algorithm.upper(), "tanh")
    assert [path.name for path in (out / "checkpoints").iterdir()] == ["step_0000002304"]


def test_bad_options(tmp_path, capsys):
    assert main(["train", "ppo-shield"]) == 2
    assert "--start-from" in capsys.readouterr().err
    assert main(["train", "--resume", str(tmp_path)]) == 2
    assert "no training run" in capsys.readouterr().err
    assert main(["train", "--resume", str(tmp_path), "--seed", "3"]) == 2
    assert "--resume excludes seed:" in capsys.readouterr().err
    assert main(["train", "--resume", str(tmp_path), "--obstacles", "3", "--steps", "4"]) == 2
    assert "--resume excludes steps, obstacles:" in capsys.readouterr().err
    assert main(["train", "--obstacles", "100000000", "--out", str(tmp_path)]) == 2
    assert "--obstacles must be at most 1000" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["a: !!python/object/apply:os.system ['true']", "a: [", "a: b: c"])
def test_a_recipe_that_is_no_yaml_is_told_in_one_line(tmp_path, capsys, text):
    path = tmp_path / "bad.yml"
    path.write_text(text)
    assert main(["train", "--recipe", str(path), "--out", str(tmp_path / "run")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"hydrone: error: {path}: no YAML: ")

    assert not (tmp_path / "run").exists()

    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "config.yaml").write_text(text)
    assert main(["train", "--resume", str(tmp_path / "run")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"hydrone: error: {tmp_path / 'run' / 'config.yaml'}: no YAML: ")


def test_bad_seed(tmp_path, capsys):
    assert main(["train", "--out", str(tmp_path), "--seed", "-1"]) == 2
    assert "seed must lie between" in capsys.readouterr().err


def test_the_example_of_the_docs(tmp_path, monkeypatch, capsys):
    """The first Python block trains with plain Stable-Baselines3; here with fewer steps."""
    text = (ROOT / "docs" / "training.md").read_text(encoding="utf-8")
    block = re.findall(r"```python\n(.*?)```", text, re.DOTALL)[0]
    assert sum(bool(line) for line in block.splitlines()) <= 10
    short = block.replace("1_000_000", "512").replace("num_envs=256", "num_envs=16").replace("n_steps=64", "n_steps=16")
    assert short != block
    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as few:
        few.setattr("hydrone_gym.evaluation.evaluate_held_out", functools.partial(evaluate_held_out, worlds=20))
        exec(compile(short, "docs/training.md", "exec"), {})
    scores = ast.literal_eval(capsys.readouterr().out)
    assert [score["episodes"] for score in scores] == [20, 20, 20]
    assert all(0.0 <= score["success"] <= 1.0 for score in scores)


def test_models_of_the_docs_fly(tmp_path, monkeypatch, capsys):
    """The blocks about models of one's own, as the file that they say they are."""
    text = (ROOT / "docs" / "training.md").read_text(encoding="utf-8")
    section = text[text.index("## Flying a model of your own") : text.index("## Results")]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text("\n\n".join(re.findall(r"```python\n(.*?)```", section, re.DOTALL)))
    policies = ["mine.py:policy", "safe=mine.py:policy+shield", "mine.py:recurrent"]
    assert main(["evaluate", "--policies", *policies, "--worlds", "1", "--jobs", "1", "--json"]) == 0
    ranked = json.loads(capsys.readouterr().out)["missions"][0]["policies"]
    assert {entry["policy"] for entry in ranked} == {"mine.py:policy", "safe", "mine.py:recurrent"}
    env = gym.make("HydroneGym/AirToWater-v0", time_limit=3.0)
    names = {"gym": gym, "env": env}
    block = text[text.index("## Flying an agent") : text.index("## Flying a model")]
    exec(compile(re.findall(r"```python\n(.*?)```", block, re.DOTALL)[0], "docs/training.md", "exec"), names)
    assert callable(names["policy"].predict)
