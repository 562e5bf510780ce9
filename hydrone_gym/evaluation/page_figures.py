"""The figures of the report page: records into panels of `rendering.comparison`, with captions."""

import math
import re
from base64 import b64encode
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hydrone_gym.evaluation.levels import flown_levels, plot_levels
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.evaluation.summary import ALL_MISSIONS, LIMITS, MissionSummary
from hydrone_gym.rendering.comparison import plot_decisions, plot_distributions, plot_rates, plot_success
from hydrone_gym.rendering.files import save_figure, to_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SEVERAL = 4  # missions that are shown one by one; of more, all together
_LEAST_MS = 1e-3  # a logarithmic axis has no zero
_ROUGH, _TILTED = LIMITS.rough_speed, math.degrees(LIMITS.rough_tilt)
FIGURES = "figures"  # folder beside the page
_BOX = "Boxes span the quartiles around the median, whiskers the 5th to the 95th percentile; dots are flights beyond."
_CAPTIONS = {
    "Success against weather": """Share of all flights that arrived, with the 95 % Wilson interval. The worlds are
the same at every level; policies stand side by side around it.""",
    "Success": "Share of all flights that arrived, with the 95 % Wilson interval.",
    "Success against density": """Share of all flights that arrived, over all missions of a suite, with the 95 % Wilson
interval. Policies stand side by side around their number of obstacles.""",
    "Clearance": f"""Least distance between the sphere around the vehicle and an obstacle, over all n flights in worlds
with obstacles. Below zero they touched. {_BOX}""",
    "Crossings": f"""Largest lateral speed, tilt and vertical speed of a flight at its crossings of the surface, over
all n flights that crossed. A crossing is rough above {_ROUGH:g} m/s laterally or {_TILTED:g}° of tilt. {_BOX}""",
    "Time and energy": f"""Over the flights that arrived, n of them. {_BOX} A policy that arrives only in easy worlds
looks quick here; the tables of differences compare equal worlds.""",
    "Time of a decision": """Wall-clock time that a policy takes to choose a reference: medians over all flights of each
flight's 50th and 99th percentile.""",
}


class Panel(NamedTuple):
    """A figure, words that stand for it where it is not seen, and an address that holds its image."""

    figure: "Figure"
    words: str
    address: str


class Chart(NamedTuple):
    """A heading, a caption, panels, and panels that are folded away."""

    heading: str
    caption: str
    panels: Sequence[Panel]
    folded: Sequence[Panel] = ()


class _Measure(NamedTuple):
    """A column of the records to be drawn as boxes, over all flights or only over those that arrived."""

    column: str
    label: str
    scale: float = 1.0
    arrived: bool = False
    limit: float | None = None
    limit_label: str = ""


_TIMES = (
    _Measure("time", "time to the goal (s)", arrived=True),
    _Measure("energy", "energy of the rotors (kJ)", 1e-3, arrived=True),
)
_CLEARANCE = _Measure("clearance", "least clearance (m)", limit=0.0, limit_label="contact")
_SPEEDS = (
    _Measure("lateral_speed", "lateral speed (m/s)", limit=_ROUGH, limit_label=f"rough above {_ROUGH:g} m/s"),
    _Measure("tilt", "tilt (°)", math.degrees(1.0), limit=_TILTED, limit_label=f"rough above {_TILTED:g}°"),
    _Measure("vertical_speed", "vertical speed (m/s)"),
)


def charts_of(records: Sequence[Record], summaries: Sequence[MissionSummary]) -> list[Chart]:
    """Draw all figures; those for which there is nothing to draw are left out."""
    policies = list(dict.fromkeys(record.policy for record in records))
    shown = each = [s for s in summaries if s.mission != ALL_MISSIONS]
    if len(each) > SEVERAL:
        shown = list({s.suite: s for s in summaries}.values())  # the missions together come after each of them
    rest = [s for s in each if s not in shown]
    panels = {
        "Success against weather": _weather(policies, summaries),
        "Success": [_success(policies, summary) for summary in shown],
        "Success against density": _density(policies, records),
        "Clearance": _boxes(policies, records, shown, _CLEARANCE),
        "Crossings": _boxes(policies, records, shown, *_SPEEDS),
        "Time and energy": _boxes(policies, records, shown, *_TIMES),
        "Time of a decision": [_decisions(policies, records)],
    }
    folded = {"Success": [_success(policies, summary) for summary in rest]}
    return [Chart(name, _CAPTIONS[name], drawn, folded.get(name, ())) for name, drawn in panels.items() if drawn]


def write_figures(charts: Sequence[Chart], folder: Path, *, width: float | None, titled: bool) -> dict[str, list[Path]]:
    """Write every panel as PDF and SVG into a folder, made if missing, and return the files by the panel's words.

    `width` is that of a paper's column in inches, None for the size on the page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for number, panel in enumerate(_panels(charts), start=1):
        name = f"{number:02}-{re.sub('[^a-z0-9.]+', '-', panel.words.lower())[:80].strip('-.')}"
        written[panel.words] = save_figure(
            panel.figure, folder / name, width=width, titled=titled, formats=("pdf", "svg")
        )
    return written


def _panels(charts: Sequence[Chart]) -> Iterator[Panel]:
    for chart in charts:
        yield from (*chart.panels, *chart.folded)


def _success(policies: Sequence[str], summary: MissionSummary) -> Panel:
    rates, title = {entry.policy: entry.success for entry in summary.policies}, f"{summary.suite}, {summary.mission}"
    return _panel(plot_success({policy: rates.get(policy) for policy in policies}, title=title), f"Success: {title}")


def _density(policies: Sequence[str], records: Sequence[Record]) -> list[Panel]:
    panels = []
    for suite in dict.fromkeys(record.suite for record in records):
        flown = [record for record in records if record.suite == suite]
        counts = sorted({record.obstacles for record in flown})
        if len(counts) > 1:
            shares = {policy: [_rate(flown, policy, count) for count in counts] for policy in policies}
            figure = plot_rates(counts, shares, "number of obstacles", title=suite)
            panels.append(_panel(figure, f"Success against density: {suite}"))
    return panels


def _weather(policies: Sequence[str], summaries: Sequence[MissionSummary]) -> list[Panel]:
    return [
        _panel(plot_levels(policies, levels, title=mission), f"Success against weather: {mission}")
        for mission, levels in flown_levels(summaries).items()
    ]


def _rate(records: Sequence[Record], policy: str, count: int) -> tuple[float, float, float]:
    """Return success of a policy in worlds of so many obstacles, with its interval; NaN where there are none."""
    ends = [record.success for record in records if record.policy == policy and record.obstacles == count]
    if not ends:
        return (math.nan, math.nan, math.nan)
    return (sum(ends) / len(ends), *wilson_interval(sum(ends), len(ends)))


def _decisions(policies: Sequence[str], records: Sequence[Record]) -> Panel:
    def middle(policy: str, name: str) -> float:
        return max(float(np.median([getattr(r, name) for r in records if r.policy == policy])), _LEAST_MS)

    times = {policy: (middle(policy, "decision_ms_p50"), middle(policy, "decision_ms_p99")) for policy in policies}
    return _panel(plot_decisions(times, title="p50 / p99 in ms"), "Times of decisions")


def _boxes(
    policies: Sequence[str], records: Sequence[Record], shown: Sequence[MissionSummary], *measures: _Measure
) -> list[Panel]:
    """Draw the distributions of measures, those that the flights of a mission have."""
    panels = []
    for s in shown:
        title, flown = f"{s.suite}, {s.mission}", [r for r in records if r.suite == s.suite]
        for column, label, scale, arrived, limit, limit_label in measures:
            values: dict[str, list[float]] = {policy: [] for policy in policies}
            for record in flown:
                value = getattr(record, column)
                if (
                    s.mission in (record.mission, ALL_MISSIONS)
                    and value is not None
                    and (record.success or not arrived)
                ):
                    values[record.policy].append(scale * value)
            if any(values.values()):
                figure = plot_distributions(values, label, title=title, limit=limit, limit_label=limit_label)
                panels.append(_panel(figure, f"{label[:1].upper()}{label[1:]}: {title}"))
    return panels


def _panel(figure: "Figure", words: str) -> Panel:
    image = to_svg(figure, words).encode()
    return Panel(figure, words, f"data:image/svg+xml;base64,{b64encode(image).decode()}")
