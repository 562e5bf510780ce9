"""PPO of Ray RLlib on random missions, with the egocentric interface.

    pip install "hydrone-gym[rllib]"
    python examples/rllib_ppo.py --iterations 20

RLlib pins an older Gymnasium than Stable-Baselines3 users may have: give it a virtual environment of its own.
"""

import argparse
import math

import gymnasium as gym
import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.tune.registry import register_env


def make_env(config: dict) -> gym.Env:
    """Make one environment; RLlib calls this in every process that flies."""
    import hydrone_gym  # noqa: F401  (registers the ids there)

    return gym.make("HydroneGym/Mission-v0", interface="egocentric", **config)


def settings(*, steps: int, runners: int) -> PPOConfig:
    """Return the settings of `docs/training.md`'s PPO that fit fewer environments.

    Args:
        steps: transitions an iteration.
        runners: processes that fly beside the one that learns; 0: that one flies too.
    """
    return (
        PPOConfig()
        .environment("hydrone", env_config={"num_obstacles": 20})
        .env_runners(num_env_runners=runners, num_envs_per_env_runner=16)
        .rl_module(model_config={"fcnet_hiddens": [128, 128], "fcnet_activation": "tanh", "vf_share_layers": False})
        .training(
            lr=5e-4, gamma=0.99, lambda_=0.95, clip_param=0.2, train_batch_size=steps, minibatch_size=512, num_epochs=10
        )
        .debugging(seed=0)
    )


def main() -> None:
    """Train and print a line an iteration."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--iterations", type=int, default=20)
    parser.add_argument("--steps", type=int, default=8192, help="transitions an iteration")
    parser.add_argument("--runners", type=int, default=0, help="processes that fly beside the one that learns")
    given = parser.parse_args()
    register_env("hydrone", make_env)
    ray.init(num_cpus=given.runners + 1, include_dashboard=False, log_to_driver=False)
    algorithm = settings(steps=given.steps, runners=given.runners).build_algo()
    for iteration in range(1, given.iterations + 1):
        result = algorithm.train()
        flown = result["env_runners"]
        steps, mean = int(flown["num_env_steps_sampled_lifetime"]), flown.get("episode_return_mean", math.nan)
        updates = int(result["learners"]["default_policy"]["num_module_steps_trained_lifetime"])
        print(f"iteration {iteration}: steps {steps}, learnt from {updates}, mean return {mean:.2f}", flush=True)
    algorithm.stop()
    ray.shutdown()
    print("closed", flush=True)


if __name__ == "__main__":
    main()
