"""How fast PPO learns inside Stable-Baselines3: the packaged recipe, and what of its time goes into flying."""

import torch
from stable_baselines3.common.callbacks import CallbackList

from agents.algorithms import ALGORITHMS
from agents.recipe import load_recipe
from agents.vec_env import MissionMix
from benchmarks.timing import Contestant

BEFORE = 8  # updates: until then rows crash more than they fly


def contestants() -> list[Contestant]:
    """Transitions a CPU second of whole updates, and of their two halves, all of one model that goes on learning."""
    torch.set_num_threads(1)
    recipe = load_recipe("ppo")
    rows = MissionMix(recipe.missions, recipe.environment)
    model = ALGORITHMS["ppo"].model(recipe.policy, rows, **recipe.arguments(), seed=0, device="cpu")
    update = model.n_steps * rows.num_envs
    model.learn(BEFORE * update)
    callback = CallbackList([])  # rollouts must be given one
    callback.init_callback(model)

    def whole() -> float:
        model.learn(update, reset_num_timesteps=False)
        return update

    def flying() -> float:
        model.collect_rollouts(model.env, callback, model.rollout_buffer, model.n_steps)
        return update

    def learning() -> float:
        model.train()
        return update

    named = {"PPO's recipe": whole, "flying alone": flying, "learning alone": learning}
    return [Contestant(name, run) for name, run in named.items()]
