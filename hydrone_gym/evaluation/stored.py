"""An evaluation read back from its folder: rows and summary, checked against each other."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.records import Record, read_records
from hydrone_gym.evaluation.run_folder import FORMAT, ROWS, SUMMARY, VERSION
from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import Comparison, MissionSummary, PolicySummary
from hydrone_gym.evaluation.tables import Table, tables_of

_FACTS = {"arguments", "versions", "commit", "machine", "date", "seconds", "rows", "complete", "missions"}
_MAPPINGS = ("suites", "worlds", "policies", "versions", "machine")
_ARGUMENTS = {"suites", "worlds", "policies", "seed", "vehicle", "baseline"}


@dataclass(frozen=True, kw_only=True)
class Stored:
    """What an evaluation left.

    Attributes:
        document: the summary as plain data.
        summaries: its missions.
        tables: those of each summary.
        records: the rows, at least one.
    """

    document: Mapping[str, Any]
    summaries: Sequence[MissionSummary]
    tables: Sequence[Sequence[Table]]
    records: Sequence[Record]

    @property
    def arguments(self) -> Mapping[str, Any]:
        """What was asked for."""
        arguments: Mapping[str, Any] = self.document["arguments"]
        return arguments

    @property
    def policies(self) -> list[str]:
        """The policies in the order in which they were given."""
        return list(dict.fromkeys(record.policy for record in self.records))


def read_stored(folder: Path) -> Stored:
    """Read rows and summary of an evaluation, finished or not.

    Raises:
        FileNotFoundError: one of them is missing.
        ValueError: one of them is damaged, or they do not fit each other.
    """
    for name in (ROWS, SUMMARY):
        if not (folder / name).is_file():
            raise FileNotFoundError(f"{folder}: there is no {name}: a report needs the folder of an evaluation")
    records, path = read_records(folder / ROWS), folder / SUMMARY
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        _check(document)
        summaries = [_summary(entry) for entry in document["missions"]]
        tables = [tables_of([summary]) for summary in summaries]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: damaged: {type(error).__name__}: {error}") from None
    stored = Stored(document=document, summaries=summaries, tables=tables, records=records)
    if document["rows"] != len(records) or not _fits(stored):
        raise ValueError(f"{folder}: {SUMMARY} does not sum up {ROWS}: run the evaluation once more")
    return stored


def _fits(stored: Stored) -> bool:
    """Tell whether summary, arguments and rows name the same suites and policies."""
    summed = {(summary.suite, entry.policy) for summary in stored.summaries for entry in summary.policies}
    known = {(suite, policy) for suite in stored.arguments["suites"] for policy in stored.arguments["policies"]}
    return summed == {(record.suite, record.policy) for record in stored.records} and summed <= known


def _check(document: Mapping[str, Any]) -> None:
    """Raise unless a document is a summary and has all its parts."""
    found = (document["format"], document["version"])
    if found != (f"{FORMAT} summary", VERSION):
        raise ValueError(f"must be a {FORMAT} summary of version {VERSION}, got {found[0]!r}, version {found[1]!r}")
    parts = {**document["arguments"], **document}
    missing = sorted((_FACTS | _ARGUMENTS) - parts.keys())
    if missing:
        raise ValueError(f"lacks {', '.join(missing)}")
    for name in _MAPPINGS:
        if not isinstance(parts[name], dict):
            raise ValueError(f"{name} must be a dict, got {type(parts[name]).__name__}")


def _summary(entry: Mapping[str, Any]) -> MissionSummary:
    """Turn one mission of a document back into what it was written from."""

    def read(values: Mapping[str, Any]) -> dict[str, Any]:
        return {name: Estimate(**value) if isinstance(value, dict) else value for name, value in values.items()}

    policies = tuple(PolicySummary(**read(values)) for values in entry["policies"])
    comparisons = tuple(Comparison(**read(values)) for values in entry["comparisons"])
    return MissionSummary(**{**entry, "policies": policies, "comparisons": comparisons})
