"""Tables for people: the same rows as Markdown, as LaTeX, on a terminal and on the page of a report.

A figure is followed by its 95 % interval: 20.4 [20.3, 20.5].
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import LIMITS, SLOWEST, Comparison, MissionSummary, PolicySummary
from hydrone_gym.rendering.comparison import shortened

_WIDTH = 120  # characters that every table fits in; an overview fits in 80
_NAME = 20  # characters of a policy in an overview
NONE = "–"
_MIDDLE = "interquartile mean (of the middle half) with its 95 % bootstrap interval"


class Table(NamedTuple):
    """What a table says; all but its first column are figures."""

    title: str
    heads: tuple[str, ...]  # of the columns, with line breaks
    rows: tuple[tuple[str, ...], ...]
    policies: tuple[str, ...] = ()  # that the rows tell of
    notes: tuple[str, ...] = ()  # lines beneath it that explain the columns


def tables_of(summaries: Sequence[MissionSummary]) -> list[Table]:
    """Return tables of each mission.

    They say how flights ended, crossed and decided, what arriving took, how much more that is than the bound and the
    score, whether the rule of the zone was kept, and all less the baseline.
    """
    tables = []
    for s in summaries:
        crossed = tuple(p for p in s.policies if p.crossed)
        told: tuple[tuple[_Kind, tuple[Any, ...]], ...] = (
            (_OUTCOMES, s.policies),
            (_CROSSINGS, crossed),
            (_ARRIVED, s.policies),
            (_BOUND, tuple(p for p in s.policies if p.score is not None or p.zone_kept is not None)),
            (_DECISIONS, s.policies),
            (_DIFFERENCES, s.comparisons),
        )
        tables += [_table(f"{s.suite}, {s.mission}", s.baseline, *one) for one in told if one[1]]
    return tables


def overview(summaries: Sequence[MissionSummary]) -> list[Table]:
    """Return one narrow table a suite, over all its missions."""
    last = {s.suite: s for s in summaries}.values()  # the missions together come after each of them
    return [_table(f"{s.suite}, {s.mission}", s.baseline, _OVERVIEW, s.policies) for s in last]


class _Kind(NamedTuple):
    """What a table tells of its policies: title, heads, the cells of one of them, notes."""

    title: str
    heads: tuple[str, ...]
    cells: Callable[[Any], tuple[str, ...]]
    notes: tuple[str, ...]


def _table(where: str, baseline: str, kind: _Kind, entries: Sequence[PolicySummary | Comparison]) -> Table:
    title, names = kind.title.format(baseline=baseline), tuple(entry.policy for entry in entries)
    return Table(f"{where}: {title}", kind.heads, tuple(map(kind.cells, entries)), names, kind.notes)


def _outcome(p: PolicySummary) -> tuple[str, ...]:
    counts = map(str, (p.collisions, p.rough_crossings, p.timeouts, p.out_of_bounds + p.diverged))
    others = cell(p.clearance, 2), cell(p.interventions, 1)
    return (f"{p.rank}. {p.policy}", str(p.worlds), cell(p.success, 1, 100.0), *counts, *others)


def _crossing(p: PolicySummary) -> tuple[str, ...]:
    speeds = cell(p.lateral_speed, 3), cell(p.lateral_speed_max, 3)
    tilts = cell(p.tilt, 2, math.degrees(1.0)), cell(p.tilt_max, 2, math.degrees(1.0))
    return (p.policy, str(p.crossed), cell(p.rough, 1, 100.0), *speeds, *tilts)


def _measures(p: PolicySummary) -> tuple[str, ...]:
    return (p.policy, cell(p.time, 2), cell(p.length, 1), cell(p.energy, 0))


def _bounded(p: PolicySummary) -> tuple[str, ...]:
    gaps = cell(p.gap, 1, 100.0, "+"), cell(p.gap_kept, 1, 100.0, "+")
    zone = cell(p.zone_kept, 1, 100.0), cell(p.zone_speed, 3), cell(p.zone_speed_max, 3)
    return (p.policy, cell(p.score, 3), *gaps, *zone)


def _decision(p: PolicySummary) -> tuple[str, ...]:
    return (p.policy, cell(p.decision_ms_p50, 2), cell(p.decision_ms_p99, 2))


def _difference(c: Comparison) -> tuple[str, ...]:
    worlds = (f"{c.only_policy} / {c.only_baseline}", f"{c.p_value:.2g}", str(c.both))
    success, time, energy = cell(c.success, 1, 100.0, "+"), cell(c.time, 2, 1.0, "+"), cell(c.energy, 0, 1.0, "+")
    return (c.policy, success, *worlds, time, energy)


def _brief(p: PolicySummary) -> tuple[str, ...]:
    others = p.timeouts + p.out_of_bounds + p.diverged
    counts = str(p.collisions), f"{p.rough_crossings}/{others}"
    time = None if p.time is None else p.time.value
    kept = None if p.zone_kept is None else p.zone_kept.value
    success = f"{cell(p.success.value, 1, 100.0)} {cell(p.success, 0, 100.0).partition(' ')[2]}"
    rest = cell(time, 1), cell(kept, 0, 100.0), cell(p.decision_ms_p99, 1)
    return (shortened(p.policy, _NAME), cell(p.score and p.score.value, 3), success, *counts, *rest)


def cell(value: Estimate | float | None, digits: int, scale: float = 1.0, sign: str = "") -> str:
    """Return a value, with its interval if it has one; `sign` "+" shows the sign of positive numbers."""
    if value is None:
        return NONE
    numbers = value if isinstance(value, Estimate) else (value,)
    written = (f"{scale * number:{sign}z.{digits}f}" for number in numbers if number is not None)
    shown, *ends = [number.replace("-", "−") for number in written]
    return f"{shown} [{', '.join(ends)}]" if ends else shown


_OUTCOMES = _Kind(
    "outcomes",
    (
        *("policy", "worlds", "success (%)", "collisions", "rough\ncrossings", "time-\nouts", "other"),
        *("least clear-\nance (m)", "inter-\nventions"),
    ),
    _outcome,
    (
        "Success: share of the flights that arrived, with its 95 % Wilson interval.",
        "Other: flights that left the box or diverged.",
        "Least clearance: of all flights, between the vehicle's sphere and an obstacle; below zero they overlap.",
        f"Interventions: periods in which the shield flew another reference, mean a flight; {NONE} without a shield.",
    ),
)
_CROSSINGS = _Kind(
    "flights that crossed the surface",
    ("policy", "flights", "rough (%)", "lateral speed (m/s)", "largest\n(m/s)", "tilt (°)", "largest\n(°)"),
    _crossing,
    (
        f"Rough: share of these flights that crossed faster than {LIMITS.rough_speed:g} m/s sideways or tilted by more "
        f"than {math.degrees(LIMITS.rough_tilt):g}°, with its 95 % Wilson interval.",
        f"Lateral speed, tilt: each flight's largest at a crossing; {_MIDDLE}. Largest: of all flights.",
    ),
)
_ARRIVED = _Kind(
    "flights that arrived",
    ("policy", "time (s)", "length (m)", "energy (J)"),
    _measures,
    (f"Time, length, energy: {_MIDDLE}.",),
)
_BOUND = _Kind(
    "gap to the bound, and the rule of the zone",
    (
        *("policy", "score", "over the\nbound (%)", "over the bound\nwith rule (%)", "keeps the rule (%)"),
        *("lateral speed\nin the zone (m/s)", "largest\n(m/s)"),
    ),
    _bounded,
    (
        "Bound: time of the fastest flight that a search found in the world, known in full; no proof that none is "
        f"faster. Over it: median over the worlds that have a bound and were solved; {NONE} where none has.",
        f"Score: 0 for a flight that did not arrive, else the bound over its time, from 1 (at the bound or sooner) to "
        f"{1.0 / SLOWEST:g} ({SLOWEST:g} times it or later); mean over the worlds that have a bound, with its 95 % "
        f"bootstrap interval; {NONE} where none has.",
        f"Rule of the zone: within ±{LIMITS.zone:g} m of the surface move vertically only. Kept: at most "
        f"{LIMITS.rough_speed:g} m/s sideways all through it; share of these flights, with its 95 % Wilson interval.",
        "Lateral speed in the zone: each flight's largest, median over these flights. Largest: of all flights.",
    ),
)
_DECISIONS = _Kind(
    "decisions of all flights",
    ("policy", "p50 (ms)", "p99 (ms)"),
    _decision,
    ("p50, p99: of the wall-clock time of a decision, each flight's percentile; median over all flights.",),
)
_DIFFERENCES = _Kind(
    "differences to {baseline} on the same worlds",
    ("policy", "success (points)", "only it /\nbaseline", "p", "both\narrive", "time (s)", "energy (J)"),
    _difference,
    (
        "Success: the policy's less the baseline's in percentage points, with Newcombe's 95 % interval for pairs.",
        "Only it / baseline: worlds in which only the policy arrived / only the baseline. p: McNemar's exact test.",
        f"Time, energy: the policy's less the baseline's where both arrived; {_MIDDLE}.",
        "An interval that holds zero leaves open which of the two is better.",
    ),
)
_OVERVIEW = _Kind(
    "in short",
    (
        *("policy", "score", "success (%)\n[95 %]", "colli-\nsions", "rough/\nother"),
        *("time\n(s)", "rule\n(%)", "p99\n(ms)"),
    ),
    _brief,
    (),
)


def markdown(tables: Sequence[Table]) -> str:
    """Return tables as a Markdown text."""
    parts = []
    for title, heads, rows, _, notes in tables:
        cells = [[cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in (heads, *rows)]
        head, *lines = [f"| {' | '.join(row)} |" for row in cells]
        parts.append("\n".join([f"### {title}\n", head, "|---|" + "---:|" * (len(heads) - 1), *lines]))
        parts += ["\n".join(f"- {note}" for note in notes)] if notes else []
    return "\n\n".join(parts) + "\n"


_SIGNS: dict[str, Any] = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "−": "$-$",
    "–": "--",
}
_SIGNS |= {"°": r"$^\circ$", "<": "$<$", ">": "$>$", "|": "$|$"} | {sign: f"\\{sign}" for sign in "&%$#_{}"}
_ESCAPES = str.maketrans(_SIGNS)
_LATEX = r"""\begin{table}
\centering\footnotesize\setlength{\tabcolsep}{4pt}
\caption{%s. %s}
\begin{tabular}{%s}
\toprule
%s \\
\midrule
%s \\
\bottomrule
\end{tabular}
\end{table}
"""


def latex(tables: Sequence[Table]) -> str:
    """Return tables as LaTeX, a floating `table` each with its notes in the caption; it needs the package booktabs."""

    def escaped(text: str) -> str:
        return text.translate(_ESCAPES)

    def row(cells: Sequence[str]) -> str:
        return " & ".join(rf"\shortstack[r]{{{cell}}}".replace("\n", r"\\") if "\n" in cell else cell for cell in cells)

    parts = ["% \\usepackage{booktabs}\n"]
    for title, heads, rows, _, notes in tables:
        head, *lines = [row(list(map(escaped, cells))) for cells in (heads, *rows)]
        columns, body = "l" + "r" * (len(heads) - 1), " \\\\\n".join(lines)
        parts.append(_LATEX % (escaped(title), escaped(" ".join(notes)), columns, head, body))
    return "\n".join(parts)


def print_tables(tables: Sequence[Table]) -> None:
    """Print tables on stdout."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table as Shown
    from rich.text import Text

    console = Console()
    if not console.is_terminal:
        console = Console(width=_WIDTH)
    whole = console.width >= _WIDTH  # else cells are broken rather than cut
    look: dict[str, Any] = {"title_justify": "left", "box": SIMPLE_HEAD, "pad_edge": False, "collapse_padding": True}
    for title, heads, rows, *_ in tables:
        shown = Shown(title=title or None, show_edge=False, **look)
        for index, head in enumerate(heads):
            shown.add_column(head, justify="right" if index else "left", no_wrap=whole or not index)
        for row in rows:
            shown.add_row(*map(Text, row))
        console.print(shown)
