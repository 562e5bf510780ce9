"""Success against the level of weather, for evaluations that hold two levels or more."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.evaluation.suites import level_of
from hydrone_gym.evaluation.summary import ALL_MISSIONS, MissionSummary, PolicySummary
from hydrone_gym.evaluation.tables import NONE, Table, cell
from hydrone_gym.rendering.comparison import plot_rates, shortened
from hydrone_gym.weather.weather import LEVELS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CAUSES = {
    "collision": "collisions",
    "out of bounds": "out_of_bounds",
    "rough crossing": "rough_crossings",
    "time-out": "timeouts",
    "diverged": "diverged",
}
_NAME = 22  # characters of a policy in an overview
_NOTES = (
    "Share of the flights that arrived, with its 95 % Wilson interval; the worlds are the same at every level.",
    "Level, mean wind (m/s), current (m/s), height of waves (m): "
    + "; ".join(f"{k}: {w.wind:g}, {w.current:g}, {w.wave_height:g}" for k, w in enumerate(LEVELS))
    + ".",
)
_ENDS = ("Numbers of flights that ended so; a policy has no row for what never was its end.",)


def flown_levels(summaries: Sequence[MissionSummary]) -> dict[str, dict[int, MissionSummary]]:
    """Return of each mission that was flown at two levels or more its summary at each; all missions together first."""
    found: dict[str, dict[int, MissionSummary]] = {}
    for summary in summaries:
        level = level_of(summary.suite)
        if level is not None:
            found.setdefault(summary.mission, {})[level] = summary
    several = [(mission, levels) for mission, levels in found.items() if len(levels) > 1]
    return dict(sorted(several, key=lambda entry: entry[0] != ALL_MISSIONS))


def by_policy(levels: dict[int, MissionSummary]) -> dict[str, dict[int, PolicySummary]]:
    """Return what each policy did at each level, the one that arrived most often first."""
    flown: dict[str, dict[int, PolicySummary]] = {}
    for level, summary in levels.items():
        for entry in summary.policies:
            flown.setdefault(entry.policy, {})[level] = entry
    return dict(sorted(flown.items(), key=lambda entry: -sum(p.success.value for p in entry[1].values())))


def level_tables(summaries: Sequence[MissionSummary]) -> list[Table]:
    """Return success and causes of failure, policies by levels, over all missions; none for fewer than two levels."""
    for mission, levels in flown_levels(summaries).items():
        flown, heads = by_policy(levels), tuple(f"level {level}" for level in levels)
        rows = tuple((name, _flights(entries), *_success(entries, levels)) for name, entries in flown.items())
        title = f"{mission}: success (%) by level of weather"
        success = Table(title, ("policy", "flights\na level", *heads), rows, tuple(flown), _NOTES)
        causes = tuple(row for name, entries in flown.items() for row in _failures(name, entries, levels))
        title = f"{mission}: failures by level of weather"
        failures = Table(title, ("policy", "cause", *heads), causes, tuple(row[0] for row in causes), _ENDS)
        return [success, failures] if causes else [success]
    return []


def level_overview(summaries: Sequence[MissionSummary]) -> list[Table]:
    """Return the table of success once more, narrow, without intervals."""
    for mission, levels in flown_levels(summaries).items():
        flown = by_policy(levels)
        rows = tuple(
            (shortened(name, _NAME), *(text.partition(" ")[0] for text in _success(entries, levels)))
            for name, entries in flown.items()
        )
        heads = ("policy", *(f"level {level}" for level in levels))
        return [Table(f"{mission}: success (%) by level", heads, rows, tuple(flown))]
    return []


def plot_levels(policies: Sequence[str], levels: dict[int, MissionSummary], *, title: str) -> "Figure":
    """Draw success of policies against the level of weather; what that is stands below."""
    weathers = [LEVELS[level] for level in levels]
    ticks = [f"{k}\n{w.wind:g}\n{w.current:g}\n{w.wave_height:g}" for k, w in zip(levels, weathers, strict=True)]
    flown = by_policy(levels)
    shares = {policy: rates(flown.get(policy, {}), list(levels)) for policy in policies}
    label = "level, wind (m/s), current (m/s), waves (m)"
    return plot_rates(list(levels), shares, label, ticks=ticks, whole=True, title=title)


def rates(entries: dict[int, PolicySummary], levels: Sequence[int]) -> NDArray[np.float64]:
    """Return success of a policy at K levels with both ends of its interval, (K, 3); NaN where it did not fly."""
    return np.array([entries[level].success if level in entries else (np.nan,) * 3 for level in levels])


def _success(entries: dict[int, PolicySummary], levels: dict[int, MissionSummary]) -> tuple[str, ...]:
    """Return success at each level in percent, its interval in whole ones: six of them fit beside each other."""
    cells = []
    for level in levels:
        share = entries[level].success if level in entries else None
        interval = "" if share is None else cell(share, 0, 100.0).partition(" ")[2]
        cells.append(f"{cell(share and share.value, 1, 100.0)} {interval}".strip())
    return tuple(cells)


def _flights(entries: dict[int, PolicySummary]) -> str:
    counts = sorted({entry.worlds for entry in entries.values()})
    return NONE.join(map(str, counts[:: max(len(counts) - 1, 1)]))


def _failures(name: str, entries: dict[int, PolicySummary], levels: dict[int, MissionSummary]) -> list[tuple[str, ...]]:
    """Return a row a cause, without those that never were."""
    rows = []
    for cause, field in _CAUSES.items():
        counts = [getattr(entries[level], field) if level in entries else None for level in levels]
        if any(counts):
            rows.append((name, cause, *(cell(count, 0) for count in counts)))
    return rows
