"""The figures of the report page: records into panels of `rendering.comparison`, with captions."""

import html
import math
from base64 import b64encode
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.evaluation.summary import ALL_MISSIONS, MissionSummary
from hydrone_gym.world.world import World

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEVERAL = 4  # missions of a suite that are shown one by one; of more, all together
_LEAST_MS = 1e-3  # a logarithmic axis has no zero
_BOX = (
    "Boxes span the quartiles around the median, whiskers the 5th to the 95th percentile; "
    "dots are single flights beyond."
)


class Group(NamedTuple):
    """Flights that are drawn together: those of a mission, or of all missions of a suite."""

    title: str
    summary: MissionSummary
    records: Sequence[Record]


class Chart(NamedTuple):
    """A heading, a caption, panels, and panels that are folded away."""

    name: str
    heading: str
    caption: str
    panels: Sequence[str]
    folded: Sequence[str] = ()


class Column(NamedTuple):
    """A column of the rows whose distribution is drawn."""

    name: str
    label: str
    scale: float = 1.0
    limit: float | None = None
    limit_label: str = ""


def groups_of(records: Sequence[Record], summaries: Sequence[MissionSummary]) -> list[Group]:
    """Return the flights of each mission summary."""
    return [
        Group(
            title=f"{s.suite}, {s.mission}",
            summary=s,
            records=[r for r in records if r.suite == s.suite and s.mission in (r.mission, ALL_MISSIONS)],
        )
        for s in summaries
    ]


def main_groups(groups: Sequence[Group]) -> list[Group]:
    """Return the groups that a page shows: the missions of a suite that has few, all together of one that has many."""
    chosen = []
    for suite in dict.fromkeys(group.summary.suite for group in groups):
        within = [group for group in groups if group.summary.suite == suite]
        missions = [group for group in within if group.summary.mission != ALL_MISSIONS]
        chosen += missions if len(missions) <= SEVERAL else within[len(missions) :]
    return chosen


def charts_of(records: Sequence[Record], groups: Sequence[Group]) -> list[Chart]:
    """Draw all figures; those for which there is nothing to draw are left out."""
    policies = list(dict.fromkeys(record.policy for record in records))
    rough = World().rough_speed
    costs = (Column("time", "time to the goal (s)"), Column("energy", "energy of the rotors (kJ)", 1e-3))
    distance = Column("clearance", "least distance to an obstacle (m)", limit=0.0, limit_label="contact")
    lateral = Column("lateral_speed", "lateral speed (m/s)", limit=rough, limit_label=f"rough above {rough:g}")
    crossings = (lateral, Column("vertical_speed", "vertical speed (m/s)"))
    charts = [
        _success(policies, groups),
        Chart(
            "time-and-energy",
            "Time and energy",
            f"Over the flights that arrived, n of them. {_BOX} A policy that arrives only in easy worlds looks "
            "quick here; the tables of differences compare equal worlds.",
            _boxes(groups, policies, costs, arrived=True),
        ),
        _density(policies, groups),
        Chart(
            "clearance",
            "Clearance",
            "Least distance between the sphere around the vehicle and an obstacle, over all n flights in "
            f"worlds with obstacles. Below zero they touched. {_BOX}",
            _boxes(groups, policies, (distance,)),
        ),
        Chart(
            "crossings",
            "Speed at the crossing",
            "Largest lateral and vertical speed of a flight at its crossings of the surface, over all n flights "
            f"that crossed. A crossing is rough above {rough:g} m/s laterally. {_BOX}",
            _boxes(groups, policies, crossings),
        ),
        _decisions(policies, records),
    ]
    return [chart for chart in charts if chart.panels]


def _boxes(
    groups: Sequence[Group], policies: Sequence[str], columns: Sequence[Column], *, arrived: bool = False
) -> list[str]:
    """Draw the distributions of columns, a panel a group and column; `arrived` leaves out flights that did not."""
    from hydrone_gym.rendering.comparison import plot_distributions

    panels = []
    for group in main_groups(groups):
        for name, label, scale, limit, limit_label in columns:
            values: dict[str, list[float]] = {policy: [] for policy in policies}
            for record in group.records:
                value = getattr(record, name)
                if value is not None and (record.success or not arrived):
                    values[record.policy].append(scale * value)
            if any(values.values()):
                figure = plot_distributions(values, label, title=group.title, limit=limit, limit_label=limit_label)
                panels.append(_image(figure, f"{label[:1].upper()}{label[1:]}: {group.title}"))
    return panels


def _success(policies: Sequence[str], groups: Sequence[Group]) -> Chart:
    from hydrone_gym.rendering.comparison import plot_success

    def panel(group: Group) -> str:
        rates = {entry.policy: entry.success for entry in group.summary.policies}
        ordered = {policy: rates.get(policy) for policy in policies}
        return _image(plot_success(ordered, title=group.title), f"Success: {group.title}")

    shown = main_groups(groups)
    rest = [group for group in groups if group not in shown and group.summary.mission != ALL_MISSIONS]
    return Chart(
        name="success",
        heading="Success",
        caption="Share of all flights that arrived, with the 95 % Wilson interval.",
        panels=[panel(group) for group in shown],
        folded=[panel(group) for group in rest],
    )


def _density(policies: Sequence[str], groups: Sequence[Group]) -> Chart:
    from hydrone_gym.rendering.comparison import plot_density

    panels = []
    for suite in dict.fromkeys(group.summary.suite for group in groups):
        records = [record for group in groups if group.summary.suite == suite for record in group.records]
        counts = sorted({record.obstacles for record in records})
        if len(counts) > 1:
            rates = {policy: [_rate(records, policy, count) for count in counts] for policy in policies}
            title = f"Success against density: {suite}"
            panels.append(_image(plot_density(counts, rates, title=suite), title))
    return Chart(
        name="density",
        heading="Success against density",
        caption="Share of all flights that arrived, over all missions of a suite, with the 95 % Wilson interval. "
        "Policies stand side by side around their number of obstacles.",
        panels=panels,
    )


def _rate(records: Sequence[Record], policy: str, count: int) -> tuple[float, float, float]:
    """Return success of a policy in worlds of so many obstacles, with its interval; NaN where there are none."""
    ends = [record.success for record in records if record.policy == policy and record.obstacles == count]
    if not ends:
        return (math.nan, math.nan, math.nan)
    return (sum(ends) / len(ends), *wilson_interval(sum(ends), len(ends)))


def _decisions(policies: Sequence[str], records: Sequence[Record]) -> Chart:
    from hydrone_gym.rendering.comparison import plot_decisions

    def middle(policy: str, name: str) -> float:
        return max(float(np.median([getattr(r, name) for r in records if r.policy == policy])), _LEAST_MS)

    times = {policy: (middle(policy, "decision_ms_p50"), middle(policy, "decision_ms_p99")) for policy in policies}
    title = "p50 / p99 in ms"
    return Chart(
        name="decisions",
        heading="Time of a decision",
        caption="Wall-clock time that a policy takes to choose a reference: medians over all flights of each flight's "
        "50th and 99th percentile.",
        panels=[_image(plot_decisions(times, title=title), "Times of decisions")],
    )


def _image(figure: "Figure", words: str) -> str:
    """Return a figure as an image inside HTML; `words` stand for it where it is not seen."""
    from hydrone_gym.rendering.comparison import to_svg

    content = b64encode(to_svg(figure, words).encode()).decode()
    return f'<img src="data:image/svg+xml;base64,{content}" alt="{html.escape(words)}">'
