"""Gaps to the bound, the score, and the rule of the zone, by hand over records made up for it."""

import itertools
import statistics

import numpy as np
import pytest

from hydrone_gym.evaluation.bounds import Bound, BoundFlight
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.evaluation.summary import summarise
from hydrone_gym.evaluation.tables import latex, markdown, tables_of
from tests.evaluation.test_records import ROW
from tests.evaluation.test_summary import record


def test_the_gap_is_the_median_over_solved_worlds_that_have_a_bound():
    def bound(kept, free):
        return Bound(*(seconds and BoundFlight(seconds, 0.0, np.zeros((1, 4))) for seconds in (kept, free)))

    rows = [record("x", k, time=20.0, mission="a") for k in range(4)] + [record("x", 4, "COLLISION", mission="a")]
    rows += [record("y", 0, "TIMEOUT", mission="a")]
    bounds = {(ROW.suite, "a", k): bound(20.0, free) for k, free in enumerate((10.0, 16.0, 8.0))}
    bounds |= {(ROW.suite, "a", 4): bound(1.0, 1.0), (ROW.suite, "b", 3): bound(1.0, 1.0)}  # not solved, not flown
    bounds[ROW.suite, "a", 2] = bound(None, 8.0)
    (summary,) = summarise(rows, bounds=bounds)
    x, y = summary.policies
    assert (x.gap, x.gap_kept) == (1.0, 0.0)  # the middle one of 100, 25 and 150 %; the two worlds with 20 s
    assert (y.gap, y.gap_kept) == (None, None)
    table = next(t for t in tables_of([summary]) if t.title.endswith("gap to the bound, and the rule of the zone"))
    assert table.rows[0][2:4] == ("+100.0", "+0.0")
    assert table.rows[1][2:4] == ("–", "–")
    assert summarise(rows)[0].policies[0].gap is None


def free(seconds):
    return Bound(None, BoundFlight(seconds, 0.0, np.zeros((1, 4))))


@pytest.mark.parametrize(
    ("outcome", "times", "score"),
    [
        ("GOAL", (10.0, 16.0), 1.0),  # at the bound
        ("GOAL", (9.0, 0.0), 1.0),  # faster
        ("GOAL", (20.0, 32.0), 0.5),  # twice as slow
        ("GOAL", (80.0, 128.0), 0.125),
        ("GOAL", (81.0, 1000.0), 0.125),  # slower still: an arrival counts
        ("COLLISION", (10.0, 16.0), 0.0),
        ("TIMEOUT", (120.0, 120.0), 0.0),
    ],
)
def test_the_score_of_flights_by_hand(outcome, times, score):
    rows = [record("x", k, outcome, time) for k, time in enumerate(times)]
    bounds = {(ROW.suite, "m", k): free(seconds) for k, seconds in enumerate((10.0, 16.0))}
    (summary,) = summarise(rows, bounds=bounds)
    assert summary.policies[0].score == (score, score, score)


def test_the_score_is_the_mean_over_the_worlds_that_have_a_bound():
    rows = [record("x", k, time=20.0) for k in range(4)] + [record("x", 4, "COLLISION", 5.0)]
    rows += [record("y", k, "TIMEOUT", 120.0, zone_speed=None) for k in range(2)]  # never in the zone: shown with 0
    bounds = {(ROW.suite, "m", k): free(seconds) for k, seconds in {0: 20.0, 1: 16.0, 2: 10.0, 4: 10.0}.items()}
    bounds[ROW.suite, "m", 3] = Bound(BoundFlight(1.0, 0.0, np.zeros((1, 4))), None)  # only one that keeps the rule
    (summary,) = summarise(rows, bounds=bounds)
    x, y = summary.policies
    assert x.score.value == pytest.approx((1.0 + 0.8 + 0.5 + 0.0) / 4)  # not of the middle half: a failure weighs
    means = sorted(statistics.fmean(four) for four in itertools.product((1.0, 0.8, 0.5, 0.0), repeat=4))
    assert x.score[1:] == pytest.approx((means[6], means[-7]), abs=0.06)  # 95 % of all 256 resamples
    assert y.score == (0.0, 0.0, 0.0)
    table = tables_of([summary])[3]
    assert table.heads[1] == "score"
    assert table.rows[0][1] == f"0.575 [{x.score.low:.3f}, {x.score.high:.3f}]"
    assert table.rows[1][:2] == ("y", "0.000 [0.000, 0.000]")
    assert all(text.count("0.575") == 1 for text in (markdown([table]), latex([table])))
    assert "from 1 (at the bound or sooner) to 0.125 (8 times it or later)" in table.notes[1]
    assert [p.score for p in summarise(rows)[0].policies] == [None, None]


def test_policies_rank_by_score_where_worlds_have_a_bound():
    """Slow and safe beats quick and lost, but not every failure weighs more than being slow."""
    rows = [record("slow", k, time=60.0) for k in range(4)] + [record("lost", k, "COLLISION", 5.0) for k in range(4)]
    rows += [record("quick", k, time=12.0) for k in range(3)] + [record("quick", 3, "TIMEOUT", 120.0)]
    bounds = {(ROW.suite, "m", k): free(10.0) for k in range(4)}
    ranks = {p.policy: p.rank for p in summarise(rows, bounds=bounds)[0].policies}
    assert ranks == {"quick": 1, "slow": 2, "lost": 3}  # 3 x 0.83 of 4, 0.17 each, nothing
    assert {p.policy: p.rank for p in summarise(rows)[0].policies} == {"slow": 1, "quick": 2, "lost": 3}


def test_the_rule_of_the_zone_is_kept_up_to_its_limit():
    speeds = (0.05, 0.2, 0.21, 1.5, None)  # the last was never in the zone
    (summary,) = summarise([record("x", k, zone_speed=speed) for k, speed in enumerate(speeds)])
    (x,) = summary.policies
    assert x.zone_kept == (0.5, *wilson_interval(2, 4))
    assert (x.zone_speed, x.zone_speed_max) == (pytest.approx(0.205), 1.5)
    table = tables_of([summary])[3]
    assert table.rows[0][1:] == ("–", "–", "–", "50.0 [15.0, 85.0]", "0.205", "1.500")
