"""hydrone_gym.envs."""
