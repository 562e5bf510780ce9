"""hydrone_gym.rendering."""
