"""What an evaluation leaves beside its rows: `summary.json` and `tables.md`."""

import dataclasses
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.plan import Plan
from hydrone_gym.evaluation.provenance import commit, machine, versions
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run_folder import FORMAT, SUMMARY, TABLES, VERSION, write_json, write_whole
from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import summarise
from hydrone_gym.evaluation.tables import Table, markdown, tables_of


def write_results(
    plan: Plan, records: Sequence[Record], folder: Path, *, baseline: str | None = None, seconds: float | None = None
) -> tuple[dict[str, Any], list[Table]]:
    """Sum up the records of a plan, write both files, and return what they hold.

    Args:
        plan: what was flown.
        records: the rows, at least one.
        folder: where the rows are.
        baseline: see `summarise`.
        seconds: wall-clock time that this run took, s.

    Raises:
        OSError: files that cannot be written.
        ValueError: a baseline that is not among the policies.
    """
    summaries = summarise(records, baseline)
    document = {
        "format": f"{FORMAT} summary",
        "version": VERSION,
        "arguments": {**plan.arguments(), "baseline": summaries[0].baseline},
        "versions": versions(),
        "commit": commit(),
        "machine": machine(),
        "date": time.strftime("%Y-%m-%d"),
        "seconds": seconds,
        "rows": len(records),
        "complete": len(records) == len(plan.keys()),
        "missions": [_plain(dataclasses.asdict(summary)) for summary in summaries],
    }
    tables = tables_of(summaries)
    write_json(folder / SUMMARY, document)
    write_whole(folder / TABLES, markdown(tables))
    return document, tables


def _plain(value: Any) -> Any:
    """Turn estimates into dicts that name their parts, however deep."""
    if isinstance(value, Estimate):
        return value._asdict()
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, list | tuple) else value
