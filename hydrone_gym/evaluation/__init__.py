"""Flying policies and measuring what they do."""

from hydrone_gym.evaluation.flight import Flight, Trace, fly
from hydrone_gym.evaluation.policies import DEFAULT_POLICIES, known_policies
from hydrone_gym.evaluation.policy import Policy
from hydrone_gym.evaluation.records import Record, read_records
from hydrone_gym.evaluation.run import EvaluationStopped, evaluate
from hydrone_gym.evaluation.statistics import percentiles, wilson_interval
from hydrone_gym.evaluation.suites import Mission, Suite, frozen_suites, load_suite, save_suite

__all__ = [
    "DEFAULT_POLICIES",
    "EvaluationStopped",
    "Flight",
    "Mission",
    "Policy",
    "Record",
    "Suite",
    "Trace",
    "evaluate",
    "fly",
    "frozen_suites",
    "known_policies",
    "load_suite",
    "percentiles",
    "read_records",
    "save_suite",
    "wilson_interval",
]
