"""Flying policies and measuring what they do."""

from hydrone_gym.evaluation.flight import Flight, Trace, fly
from hydrone_gym.evaluation.policy import Policy
from hydrone_gym.evaluation.statistics import percentiles, wilson_interval

__all__ = ["Flight", "Policy", "Trace", "fly", "percentiles", "wilson_interval"]
