"""An evaluation in numbers: each policy on each mission, ranked, and how it differs from a baseline on equal worlds."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hydrone_gym.evaluation.bounds import Bound
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.statistics import Estimate, interquartile_mean, mean, paired_success, wilson_interval
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.world.world import World

ALL_MISSIONS = "all missions"
BASELINE = "clrrt"  # policy that the others are compared with unless another is named
LIMITS = World()  # of a rough crossing, the same in every environment
SLOWEST = 8.0  # times the bound: a flight that arrives later scores no less, as in the BARN challenge
Bounds = Mapping[tuple[str, str, int], Bound]  # of worlds, by suite, mission and number


@dataclass(frozen=True, kw_only=True)
class PolicySummary:
    """One policy on the worlds of a mission."""

    policy: str  #: its name
    rank: int  #: from 1, by score; where worlds have no bound, by success, then by time
    worlds: int  #: flights
    success: Estimate  #: share that arrived, with the 95 % Wilson interval
    collisions: int  #: flights that ended so, as in the next four
    rough_crossings: int
    timeouts: int
    out_of_bounds: int
    diverged: int
    time: Estimate | None  #: s, of those that arrived: interquartile mean, 95 % bootstrap interval; None if none did
    length: Estimate | None  #: likewise, m; None for flights in batches too
    energy: Estimate | None  #: likewise, J
    clearance: float | None  #: least distance to an obstacle over all flights, m; None without obstacles
    crossed: int  #: flights that crossed the surface
    rough: Estimate | None  #: share of those with a rough crossing, with the 95 % Wilson interval; None without any
    lateral_speed: Estimate | None  #: of each of those its largest at a crossing, m/s: interquartile mean, interval
    lateral_speed_max: float | None  #: the largest of all, m/s
    tilt: Estimate | None  #: likewise, rad
    tilt_max: float | None
    zone_kept: Estimate | None  #: share of flights in the zone that kept its rule, 95 % Wilson interval; None without
    zone_speed: float | None  #: of each of those its largest lateral speed in the zone, m/s: median
    zone_speed_max: float | None  #: the largest of all
    gap: float | None  #: of its time over the bound, as a share of that: median over the worlds it solved that have one
    gap_kept: float | None  #: likewise over the bound that keeps the rule of the zone
    score: Estimate | None  #: mean over the worlds that have a bound, 95 % bootstrap interval; 0 to 1, see `_score`
    interventions: float | None  #: of the shield, mean a flight; None without a shield
    decision_ms_p50: float  #: median over flights of each flight's percentile, ms
    decision_ms_p99: float


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A policy against the baseline on the worlds that both flew; differences are the policy's less the baseline's."""

    policy: str  #: its name
    worlds: int  #: that both flew
    success: Estimate  #: difference of the success rates with Newcombe's 95 % interval for pairs
    only_policy: int  #: worlds in which it alone arrived
    only_baseline: int
    p_value: float  #: of McNemar's exact test, two-sided
    both: int  #: worlds in which both arrived
    time: Estimate | None  #: interquartile mean over those, s, with 95 % bootstrap interval; None if there are none
    energy: Estimate | None  #: likewise, J


@dataclass(frozen=True, kw_only=True)
class MissionSummary:
    """All policies on one mission of a suite, or on all its missions together."""

    suite: str  #: its name
    mission: str  #: its name, or `ALL_MISSIONS`
    baseline: str  #: policy that the others are compared with
    policies: tuple[PolicySummary, ...]  #: by rank
    comparisons: tuple[Comparison, ...]  #: every other policy with the baseline, by rank


def summarise(
    records: Sequence[Record], baseline: str | None = None, bounds: Bounds | None = None
) -> list[MissionSummary]:
    """Sum up an evaluation, finished or not: for each suite its missions, then all of them together if there are more.

    The `baseline` is `BASELINE` unless given, if it flew, else the first policy; ValueError for one that did not fly.
    `bounds` are those of the worlds, where they have one, see `bounds_of`.
    """
    policies = list(dict.fromkeys(record.policy for record in records))
    if baseline is not None and baseline not in policies:
        raise ValueError(f"baseline must be one of {', '.join(policies)}, got {baseline!r}")
    baseline = baseline or (BASELINE if BASELINE in policies else policies[0])
    summaries = []
    for suite in dict.fromkeys(record.suite for record in records):
        within = [record for record in records if record.suite == suite]
        missions = list(dict.fromkeys(record.mission for record in within))
        groups = [(name, [record for record in within if record.mission == name]) for name in missions]
        if len(missions) > 1:
            groups.append((ALL_MISSIONS, within))
        summaries += [_mission(suite, name, group, baseline, bounds or {}) for name, group in groups]
    return summaries


def scores_of(records: Sequence[Record]) -> list[dict[str, Any]]:
    """Return how a policy's flights of each mission ended: plain data, with means in s and J of those that arrived."""
    scores = []
    for mission in dict.fromkeys(record.mission for record in records):
        flown = [record for record in records if record.mission == mission]
        arrived = [record for record in flown if record.success]
        ends = Counter(record.outcome for record in flown)
        scores.append(
            {
                "mission": mission,
                "episodes": len(flown),
                "outcomes": {kind.name: ends[kind.name] for kind in Outcome if ends[kind.name]},
                "success": len(arrived) / len(flown),
                "interval": wilson_interval(len(arrived), len(flown)),
                "time": float(np.mean([record.time for record in arrived])) if arrived else None,
                "energy": float(np.mean([record.energy for record in arrived])) if arrived else None,
            }
        )
    return scores


def _mission(suite: str, mission: str, records: Sequence[Record], baseline: str, bounds: Bounds) -> MissionSummary:
    flown = {name: [r for r in records if r.policy == name] for name in dict.fromkeys(r.policy for r in records)}
    summed = [_policy(name, those, bounds) for name, those in flown.items()]
    summed.sort(key=_standing)
    compared = {(record.mission, record.world): record for record in flown.get(baseline, [])}
    comparisons = []
    for name in [p.policy for p in summed if p.policy != baseline]:
        pairs = [(r, compared[r.mission, r.world]) for r in flown[name] if (r.mission, r.world) in compared]
        comparisons += [_comparison(name, pairs)] if pairs else []
    ranked = tuple(replace(entry, rank=rank) for rank, entry in enumerate(summed, start=1))
    return MissionSummary(
        suite=suite, mission=mission, baseline=baseline, policies=ranked, comparisons=tuple(comparisons)
    )


def _standing(p: PolicySummary) -> tuple[float, float, float]:
    """What policies are ranked by, the best first."""
    return (-p.score.value if p.score else 0.0, -p.success.value, np.inf if p.time is None else p.time.value)


def _policy(name: str, records: Sequence[Record], bounds: Bounds) -> PolicySummary:
    arrived = [record for record in records if record.success]
    ends = Counter(record.outcome for record in records)

    def there(name: str, among: Sequence[Record] = records) -> list[float]:
        return [getattr(r, name) for r in among if getattr(r, name) is not None]

    told = ("interventions", "lateral_speed", "tilt", "zone_speed")
    interventions, lateral_speed, tilt, zone_speed = map(there, told)
    crossed = [record for record in records if record.crossings]
    return PolicySummary(
        policy=name,
        rank=0,
        worlds=len(records),
        success=_share(len(arrived), len(records)),
        collisions=ends["COLLISION"],
        rough_crossings=ends["ROUGH_TRANSITION"],
        timeouts=ends["TIMEOUT"],
        out_of_bounds=ends["OUT_OF_BOUNDS"],
        diverged=ends["DIVERGED"],
        time=_estimate(there("time", arrived)),
        length=_estimate(there("length", arrived)),
        energy=_estimate(there("energy", arrived)),
        clearance=min(there("clearance"), default=None),
        crossed=len(crossed),
        rough=_share(sum(map(_is_rough, crossed)), len(crossed)) if crossed else None,
        lateral_speed=_estimate(lateral_speed),
        lateral_speed_max=max(lateral_speed, default=None),
        tilt=_estimate(tilt),
        tilt_max=max(tilt, default=None),
        zone_kept=_share(sum(s <= LIMITS.rough_speed for s in zone_speed), len(zone_speed)) if zone_speed else None,
        zone_speed=float(np.median(zone_speed)) if zone_speed else None,
        zone_speed_max=max(zone_speed, default=None),
        gap=_gap(arrived, bounds, "free"),
        gap_kept=_gap(arrived, bounds, "kept"),
        score=_score(records, bounds),
        interventions=float(np.mean(interventions)) if interventions else None,
        decision_ms_p50=float(np.median(there("decision_ms_p50"))),
        decision_ms_p99=float(np.median(there("decision_ms_p99"))),
    )


def _gap(arrived: Sequence[Record], bounds: Bounds, rule: str) -> float | None:
    """Return the median share by which flights were slower than the bound, with the `rule` of the zone kept or free."""
    gaps = [multiple - 1.0 for _, multiple in _bounded(arrived, bounds, rule)]
    return float(np.median(gaps)) if gaps else None


def _score(records: Sequence[Record], bounds: Bounds) -> Estimate | None:
    """Return the mean of success x bound / clip(time, bound, `SLOWEST` x bound), without the rule of the zone."""
    scores = [r.success / min(max(multiple, 1.0), SLOWEST) for r, multiple in _bounded(records, bounds, "free")]
    return mean(scores) if scores else None


def _bounded(records: Sequence[Record], bounds: Bounds, rule: str) -> list[tuple[Record, float]]:
    """Return the flights in worlds that have a bound, each with its time in multiples of that."""
    flights = [(record, getattr(bounds.get(record.key[:3]), rule, None)) for record in records]
    return [(record, record.time / flight.time) for record, flight in flights if flight is not None]


def _is_rough(record: Record) -> bool:
    """Tell whether a flight crossed roughly: also where that is only counted, and flights go on."""
    over = (record.lateral_speed or 0.0) > LIMITS.rough_speed or (record.tilt or 0.0) > LIMITS.rough_tilt
    return over or record.outcome == Outcome.ROUGH_TRANSITION.name


def _share(count: int, of: int) -> Estimate:
    return Estimate(count / of, *wilson_interval(count, of))


def _comparison(name: str, pairs: Sequence[tuple[Record, Record]]) -> Comparison:
    """Compare a policy with the baseline, given the records of both for each world."""
    paired = paired_success([one.success for one, _ in pairs], [other.success for _, other in pairs])
    both = [(one, other) for one, other in pairs if one.success and other.success]
    return Comparison(
        policy=name,
        worlds=len(pairs),
        success=paired.difference,
        only_policy=paired.only_first,
        only_baseline=paired.only_second,
        p_value=paired.p_value,
        both=len(both),
        time=_estimate([one.time - other.time for one, other in both]),
        energy=_estimate([one.energy - other.energy for one, other in both]),
    )


def _estimate(values: Sequence[float]) -> Estimate | None:
    return interquartile_mean(values) if values else None
