"""Flying policies and measuring what they do."""

from hydrone_gym.evaluation.flight import Ending, Flight, Trace, fly, fly_worlds
from hydrone_gym.evaluation.policies import DEFAULT_POLICIES, Policy, known_policies
from hydrone_gym.evaluation.provenance import made_with
from hydrone_gym.evaluation.records import Record, read_records
from hydrone_gym.evaluation.run import EvaluationStopped, evaluate, evaluate_held_out
from hydrone_gym.evaluation.statistics import percentiles, wilson_interval
from hydrone_gym.evaluation.suites import (
    HELD_OUT,
    MISSIONS,
    Mission,
    Suite,
    frozen_suites,
    load_suite,
    load_suites,
    save_suite,
)

__all__ = [
    "DEFAULT_POLICIES",
    "HELD_OUT",
    "MISSIONS",
    "Ending",
    "EvaluationStopped",
    "Flight",
    "Mission",
    "Policy",
    "Record",
    "Suite",
    "Trace",
    "evaluate",
    "evaluate_held_out",
    "fly",
    "fly_worlds",
    "frozen_suites",
    "known_policies",
    "load_suite",
    "load_suites",
    "made_with",
    "percentiles",
    "read_records",
    "save_suite",
    "wilson_interval",
]
