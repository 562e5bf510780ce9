"""hydrone_gym.control."""
