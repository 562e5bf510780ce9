"""Tables of an evaluation, for people: the same cells in Markdown and on a terminal.

A figure is followed by its 95 % interval: 20.4 [20.3, 20.5].
"""

from collections.abc import Sequence
from dataclasses import dataclass

from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import Comparison, MissionSummary, PolicySummary

_WIDTH = 120  # characters that every table fits in


@dataclass(frozen=True, kw_only=True)
class Table:
    """A title, the heads of the columns, with line breaks, and rows of cells; all but the first column are figures."""

    title: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def tables_of(summaries: Sequence[MissionSummary]) -> list[Table]:
    """Return for each mission how flights ended, what those that arrived took, and the differences to the baseline."""
    tables = []
    for summary in summaries:
        title = f"{summary.suite}, {summary.mission}"
        tables += [_outcomes(title, summary), _measures(title, summary)]
        if summary.comparisons:
            tables.append(_differences(title, summary))
    return tables


def _outcomes(title: str, summary: MissionSummary) -> Table:
    def row(p: PolicySummary) -> tuple[str, ...]:
        counts = (p.collisions, p.rough_crossings, p.timeouts, p.out_of_bounds + p.diverged)
        shield = "-" if p.interventions is None else f"{p.interventions:.1f}"
        clearance = "-" if p.clearance is None else f"{p.clearance:.2f}"
        success = _cell(p.success, 100.0, 1)
        return (f"{p.rank}. {p.policy}", str(p.worlds), success, *map(str, counts), clearance, shield)

    counts = ("collisions", "rough\ncrossings", "timeouts", "other")
    heads = ("policy", "worlds", "success (%)", *counts, "least clear-\nance (m)", "inter-\nventions")
    return Table(title=f"{title}: outcomes", heads=heads, rows=tuple(map(row, summary.policies)))


def _measures(title: str, summary: MissionSummary) -> Table:
    def row(p: PolicySummary) -> tuple[str, ...]:
        measures = (_cell(p.time, 1.0, 2), _cell(p.length, 1.0, 1), _cell(p.energy, 1.0, 0))
        return (p.policy, *measures, f"{p.decision_ms_p50:.2f} / {p.decision_ms_p99:.2f}")

    heads = ("policy", "time (s)", "length (m)", "energy (J)", "decision\np50 / p99 (ms)")
    return Table(
        title=f"{title}: flights that arrived, and decisions of all",
        heads=heads,
        rows=tuple(map(row, summary.policies)),
    )


def _differences(title: str, summary: MissionSummary) -> Table:
    def row(c: Comparison) -> tuple[str, ...]:
        worlds = (f"{c.only_policy} / {c.only_baseline}", f"{c.p_value:.2g}", str(c.both))
        success = _cell(c.success, 100.0, 1, "+")
        return (c.policy, success, *worlds, _cell(c.time, 1.0, 2, "+"), _cell(c.energy, 1.0, 0, "+"))

    worlds = ("only it /\nbaseline", "p", "both\narrive")
    heads = ("policy", "success (points)", *worlds, "time (s)", "energy (J)")
    name = f"{title}: differences to {summary.baseline} on the same worlds"
    return Table(title=name, heads=heads, rows=tuple(map(row, summary.comparisons)))


def _cell(estimate: Estimate | None, scale: float, digits: int, sign: str = "") -> str:
    """Return a value and its interval; `sign` "+" shows the sign of positive numbers."""
    if estimate is None:
        return "-"
    value, low, high = estimate
    shown = f"{scale * value:{sign}.{digits}f}"
    if low is None or high is None:
        return shown
    return f"{shown} [{scale * low:{sign}.{digits}f}, {scale * high:{sign}.{digits}f}]"


def markdown(tables: Sequence[Table]) -> str:
    """Return tables as a Markdown text."""
    parts = []
    for table in tables:
        heads = [_escaped(table.heads), "|---|" + "---:|" * (len(table.heads) - 1)]
        parts.append("\n".join([f"### {table.title}", "", *heads, *map(_escaped, table.rows)]))
    return "\n\n".join(parts) + "\n"


def _escaped(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def print_tables(tables: Sequence[Table]) -> None:
    """Print tables on stdout."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table as Shown

    console = Console()
    if not console.is_terminal:
        console = Console(width=_WIDTH)
    whole = console.width >= _WIDTH  # else cells are broken rather than cut
    for table in tables:
        shown = Shown(title=table.title, title_justify="left", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
        shown.add_column(table.heads[0], no_wrap=True)
        for head in table.heads[1:]:
            shown.add_column(head, justify="right", no_wrap=whole)
        for row in table.rows:
            shown.add_row(*map(escape, row))
        console.print(shown)
