"""rl-baselines3-zoo trains with the recipes of the package, as docs/training.md says, and what it saves flies."""

import re
import shlex
import sys
from pathlib import Path

import gymnasium as gym
import pytest
from stable_baselines3 import PPO, SAC

from agents import EgocentricPolicy
from agents.recipe import FOLDER, load_recipe
from hydrone_gym.evaluation import fly
from tests.processes import completed

DOCS = Path(__file__).resolve().parents[2] / "docs" / "training.md"


@pytest.mark.parametrize(("model", "steps"), [(PPO, 2_000), (SAC, 5_500)], ids=["ppo", "sac"])
def test_the_zoo_trains_with_a_recipe(model, steps, tmp_path):
    name = model.__name__.lower()
    (told,) = re.findall(
        r"^python (-m rl_zoo3\.train .*?)^```", DOCS.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    words = shlex.split(told.replace("\\\n", " ").replace("$RECIPES/ppo.yml", str(FOLDER / f"{name}.yml")))
    words[words.index("--algo") + 1] = name
    shorter = ["-n", str(steps), "--eval-freq", "4000", "--eval-episodes", "1", "--device", "cpu", "--num-threads", "1"]
    done = completed([sys.executable, *words, *shorter], 480.0, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    run = tmp_path / "logs" / name / "HydroneGym-Mission-v0_1"
    assert (run / "evaluations.npz").is_file()  # flown between, in the same environment
    learnt = model.load(run / "HydroneGym-Mission-v0.zip", device="cpu")
    settings = load_recipe(name).settings
    assert (learnt.gamma, learnt.batch_size) == (settings["gamma"], settings["batch_size"])
    assert learnt.num_timesteps >= steps
    env = gym.make("HydroneGym/AirToWater-v0")
    assert fly(env, EgocentricPolicy(learnt, env), seed=0).time > 1.0
