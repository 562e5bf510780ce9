"""HyDrone."""
