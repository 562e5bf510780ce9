"""hydrone_gym.physics."""
