"""Tables for people: the same rows as Markdown, on a terminal and on the page of a report.

A figure is followed by its 95 % interval: 20.4 [20.3, 20.5].
"""

from collections.abc import Sequence
from typing import NamedTuple

from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import Comparison, MissionSummary, PolicySummary

_WIDTH = 120  # characters that every table fits in
_COUNTS = ("collisions", "rough\ncrossings", "timeouts", "other")
_OUTCOME = ("policy", "worlds", "success (%)", *_COUNTS, "least clear-\nance (m)", "inter-\nventions")
_MEASURES = ("policy", "time (s)", "length (m)", "energy (J)", "decision\np50 / p99 (ms)")
_DIFFERENCE = ("policy", "success (points)", "only it /\nbaseline", "p", "both\narrive", "time (s)", "energy (J)")


class Table(NamedTuple):
    """What a table says; all but its first column are figures."""

    title: str
    heads: tuple[str, ...]  # of the columns, with line breaks
    rows: tuple[tuple[str, ...], ...]
    policies: tuple[str, ...] = ()  # that the rows tell of


def tables_of(summaries: Sequence[MissionSummary]) -> list[Table]:
    """Return for each mission how flights ended, what those that arrived took, and the differences to the baseline."""
    tables = []
    for s in summaries:
        title, ranked = f"{s.suite}, {s.mission}", tuple(p.policy for p in s.policies)
        outcomes, measures = tuple(map(_outcome, s.policies)), tuple(map(_measures, s.policies))
        tables.append(Table(f"{title}: outcomes", _OUTCOME, outcomes, ranked))
        tables.append(Table(f"{title}: flights that arrived, and decisions of all", _MEASURES, measures, ranked))
        if s.comparisons:
            title += f": differences to {s.baseline} on the same worlds"
            compared = tuple(c.policy for c in s.comparisons)
            tables.append(Table(title, _DIFFERENCE, tuple(map(_difference, s.comparisons)), compared))
    return tables


def _outcome(p: PolicySummary) -> tuple[str, ...]:
    counts = (p.collisions, p.rough_crossings, p.timeouts, p.out_of_bounds + p.diverged)
    shares = (_cell(p.success, 1, 100.0), *map(str, counts), _cell(p.clearance, 2), _cell(p.interventions, 1))
    return (f"{p.rank}. {p.policy}", str(p.worlds), *shares)


def _measures(p: PolicySummary) -> tuple[str, ...]:
    decisions = f"{p.decision_ms_p50:.2f} / {p.decision_ms_p99:.2f}"
    return (p.policy, _cell(p.time, 2), _cell(p.length, 1), _cell(p.energy, 0), decisions)


def _difference(c: Comparison) -> tuple[str, ...]:
    worlds = (f"{c.only_policy} / {c.only_baseline}", f"{c.p_value:.2g}", str(c.both))
    success, time, energy = _cell(c.success, 1, 100.0, "+"), _cell(c.time, 2, 1.0, "+"), _cell(c.energy, 0, 1.0, "+")
    return (c.policy, success, *worlds, time, energy)


def _cell(value: Estimate | float | None, digits: int, scale: float = 1.0, sign: str = "") -> str:
    """Return a value, with its interval if it has one; `sign` "+" shows the sign of positive numbers."""
    if value is None:
        return "-"
    numbers = value if isinstance(value, Estimate) else (value,)
    shown, *ends = [f"{scale * number:{sign}.{digits}f}" for number in numbers if number is not None]
    return f"{shown} [{', '.join(ends)}]" if ends else shown


def markdown(tables: Sequence[Table]) -> str:
    """Return tables as a Markdown text."""
    parts = []
    for title, heads, rows, _ in tables:
        cells = [[cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in (heads, *rows)]
        head, *lines = [f"| {' | '.join(row)} |" for row in cells]
        parts.append("\n".join([f"### {title}\n", head, "|---|" + "---:|" * (len(heads) - 1), *lines]))
    return "\n\n".join(parts) + "\n"


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
    for title, heads, rows, _ in tables:
        shown = Shown(title=title or None, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
        for index, head in enumerate(heads):
            shown.add_column(head, justify="right" if index else "left", no_wrap=whole or not index)
        for row in rows:
            shown.add_row(*map(Text, row))
        console.print(shown)
