"""hydrone_gym.evaluation."""
