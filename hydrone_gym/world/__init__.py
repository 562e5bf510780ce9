"""hydrone_gym.world."""
