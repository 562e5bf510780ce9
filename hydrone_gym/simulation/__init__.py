"""hydrone_gym.simulation."""
