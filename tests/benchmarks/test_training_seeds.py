"""Trainings with several seeds: nothing is trained twice, and the tables say what the runs did."""

import csv

import numpy as np
import pytest
import yaml

from agents import load_agent
from agents import recipe as recipes
from agents.run_log import COLUMNS
from benchmarks.training_seeds import DENSE, Arguments, effort, measure, sheets, trained
from hydrone_gym.evaluation import MISSIONS, evaluate_held_out
from planners.shield import Shield

SMALL = {
    recipes.ENV_ID: {
        "n_envs": 32,
        "n_timesteps": 32 * 8 * 2,
        "policy": "MlpPolicy",
        "n_steps": 8,
        "batch_size": 128,
        "n_epochs": 1,
        "policy_kwargs": {"net_arch": [16]},
    }
}


@pytest.fixture
def small_recipes(tmp_path, monkeypatch):
    folder = tmp_path / "recipes"
    folder.mkdir()
    (folder / "ppo.yml").write_text(yaml.safe_dump(SMALL))
    (folder / "ppo-shield.yml").write_text(yaml.safe_dump({**SMALL, "shield": True}))
    weather = {"environment": {"weather": [0, 2]}, "evaluation": {"weather": 2, "controller": "robust"}}
    (folder / "ppo-weather.yml").write_text(yaml.safe_dump({**SMALL, **weather}))
    monkeypatch.setattr(recipes, "FOLDER", folder)


@pytest.mark.usefixtures("small_recipes")
def test_runs_are_trained_once_and_evaluated_as_they_are_meant_to_fly(tmp_path):
    runs = tmp_path / "runs"
    measured = measure(Arguments(recipes=("ppo-shield", "ppo"), seeds=(3,), runs=runs, episodes=6))
    assert sorted(path.name for path in runs.iterdir()) == ["ppo-3", "ppo-shield-3"]
    config = yaml.safe_load((runs / "ppo-shield-3" / "config.yaml").read_text())
    assert config["run"]["start_from"] == str(runs / "ppo-3")
    shielded, alone = measured["runs"]
    assert [(c["worlds"], c["mission"]) for c in alone["flights"]] == [("20 spheres", m) for m in MISSIONS]
    assert [c["worlds"] for c in shielded["flights"]] == ["20 spheres"] * 3 + ["40 larger spheres"] * 3
    agent = f"{runs / 'ppo-shield-3' / 'agent'}+shield"
    _, dense = evaluate_held_out(agent, worlds=6, options=DENSE.options)
    assert [c["outcomes"] for c in shielded["flights"][3:]] == [score["outcomes"] for score in dense]
    written = {path: path.stat().st_mtime_ns for path in runs.rglob("*") if path.is_file()}
    assert trained("ppo-shield", 3, runs) == runs / "ppo-shield-3"
    assert written == {path: path.stat().st_mtime_ns for path in runs.rglob("*") if path.is_file()}


@pytest.mark.usefixtures("small_recipes")
def test_what_learnt_in_weather_flies_in_it_alone_and_shielded(tmp_path):
    (run,) = measure(Arguments(recipes=("ppo-weather",), seeds=(3,), runs=tmp_path, episodes=6))["runs"]
    assert [c["worlds"] for c in run["flights"]] == ["level 2"] * 3 + ["level 2, shield"] * 3
    agent, options = tmp_path / "ppo-weather-3" / "agent", {"weather": 2, "controller": "robust"}
    _, alone = evaluate_held_out(str(agent), worlds=6, options=options)
    _, ready = evaluate_held_out(
        lambda env: Shield.for_env(load_agent(agent, env), env, level=2), worlds=6, options=options
    )
    assert [c["outcomes"] for c in run["flights"]] == [score["outcomes"] for score in [*alone, *ready]]


def test_effort(tmp_path):
    """95 % counts when the mean of five lines has it, not when one has."""
    success = [0.0, 0.99, 0.9, 0.92, 0.97, 0.97, 0.98, 0.98]
    with (tmp_path / "curve.csv").open("w", newline="") as stream:
        writer = csv.DictWriter(stream, COLUMNS)
        writer.writeheader()
        for k, share in enumerate(success, start=1):
            writer.writerow({"steps": 100 * k, "wall_s": 2.0 * k, "cpu_s": k, "success": share})
    took = effort(tmp_path)
    assert (took["steps"], took["wall_s"], took["cpu_s"]) == (800, 16.0, 8.0)
    assert np.mean(success[1:6]) == pytest.approx(0.95)
    assert np.mean(success[:5]) < 0.95
    assert (took["learnt_wall_s"], took["learnt_cpu_s"]) == (12.0, 6.0)


def test_sheets_give_mean_deviation_and_what_was_unsafe():
    def run(seed, goals):
        outcomes = {"GOAL": goals, "COLLISION": 100 - goals - 1, "ROUGH_TRANSITION": 1}
        cell = {"worlds": "20 spheres", "mission": MISSIONS[0], "outcomes": outcomes, "share": goals / 100}
        took = {"steps": 1000, "wall_s": 20.0, "cpu_s": 10.0, "learnt_wall_s": None, "learnt_cpu_s": None}
        return {"recipe": "ppo", "seed": seed, **took, "flights": [cell]}

    success, took = sheets({"episodes": 100, "runs": [run(0, 90), run(1, 92), run(2, 97)]})
    deviation = np.sqrt((3.0**2 + 1.0**2 + 4.0**2) / 2)
    each, summed = "90.00, 92.00, 97.00", f"93.00 ± {deviation:.2f}"
    assert success.rows == [("ppo", "20 spheres", "Mission-v0", each, summed, "18, 0, 3, 0")]
    assert took.rows[1] == ("ppo", "1", "1,000", "100", "10", "20", "–")
