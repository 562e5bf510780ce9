"""The folder of an evaluation: what was asked for, the finished rows, which survive whatever ends it, and the results.

| file | content |
|---|---|
| `run.json` | the arguments |
| `rows.csv` | a row a flight |
| `summary.json`, `tables.md`, `tables.tex` | what came of it |
"""

import dataclasses
import itertools
import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hydrone_gym._whole_file import whole
from hydrone_gym.evaluation.plan import Plan
from hydrone_gym.evaluation.provenance import commit, machine, versions
from hydrone_gym.evaluation.records import HEADER, Key, Record, parse_records, read_records, to_line
from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import MissionSummary, summarise
from hydrone_gym.evaluation.tables import Table, latex, markdown, overview, tables_of

RUN, ROWS, SUMMARY, TABLES, LATEX = "run.json", "rows.csv", "summary.json", "tables.md", "tables.tex"
FORMAT = "hydrone_gym evaluation"
VERSION = 1
_PARTS = {"versions", "commit", "machine", "date", "seconds", "rows", "complete", "missions"}
_PARTS |= {"suites", "worlds", "policies", "seed", "vehicle", "baseline"}  # these in the arguments
_MAPPINGS = ("suites", "worlds", "policies", "versions", "machine")


class RunFolder:
    """Rows of an evaluation in a folder, which is made if missing.

    `arguments` are what the rows depend on, as plain data; `overwrite` drops what another evaluation left there.

    Raises ValueError for a folder with other arguments or damaged rows, OSError for what cannot be read or written.
    """

    def __init__(self, folder: Path, arguments: dict[str, Any], *, overwrite: bool = False) -> None:
        """Compare arguments with those of the evaluation that is there, or begin a new one."""
        self.folder, self.rows = folder, folder / ROWS
        folder.mkdir(parents=True, exist_ok=True)
        run = folder / RUN
        if overwrite:
            for name in (RUN, ROWS, SUMMARY, TABLES, LATEX):
                (folder / name).unlink(missing_ok=True)
        if run.exists():
            _compare(run, json.loads(json.dumps(arguments)))
        elif self.rows.exists():
            raise ValueError(f"{folder}: holds {ROWS} without {RUN}: choose another folder, or overwrite it")
        else:
            _write_json(run, {"format": FORMAT, "version": VERSION, "arguments": arguments})

    def finished(self, keys: Sequence[Key]) -> list[Record]:
        """Return the rows that are there, the first of those that `keys` name.

        A last line that was cut off is removed from the file; a file with any other damage is left as it is.
        """
        if not self.rows.exists():
            return []
        content = self.rows.read_bytes()
        records = parse_records(content, os.fspath(self.rows))
        expected = itertools.chain(keys, itertools.repeat("the end of the file"))
        for line, (record, key) in enumerate(zip(records, expected), start=2):
            if record.key != key:
                raise ValueError(f"{self.rows}, line {line}: expected the row of {key}, got {record.key}")
        os.truncate(self.rows, content.rfind(b"\n") + 1)
        return records

    def append(self, records: Sequence[Record]) -> None:
        """Write rows at the end, through to the operating system; OSError when it takes no more."""
        with open(self.rows, "ab", buffering=0) as stream:
            lines = "".join(map(to_line, records)).encode()
            waiting = memoryview((b"" if stream.tell() else f"{HEADER}\n".encode()) + lines)
            while waiting:  # a disk that is nearly full takes a part
                waiting = waiting[stream.write(waiting) :]


def _compare(run: Path, arguments: dict[str, Any]) -> None:
    """Raise ValueError unless the evaluation in a folder had these arguments, naming those that differ."""
    try:
        before = json.loads(run.read_text(encoding="utf-8"))["arguments"]
        differing = sorted(key for key in before | arguments if before.get(key) != arguments.get(key))
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{run}: damaged: {type(error).__name__}: {error}") from None
    if differing:
        changes = "; ".join(f"{key} was {before.get(key)}, is {arguments.get(key)}" for key in differing)
        advice = "choose another folder, or overwrite it"
        raise ValueError(f"{run.parent}: holds an evaluation with other arguments ({changes}): {advice}")


def write_results(
    plan: Plan, records: Sequence[Record], folder: Path, *, baseline: str | None = None, seconds: float | None = None
) -> tuple[dict[str, Any], list[Table]]:
    """Sum up the records of a plan, at least one, write summary and tables, and return the summary and its overview.

    `seconds` is the wall-clock time that this run took, s.
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
        "missions": [dataclasses.asdict(summary, dict_factory=_plain) for summary in summaries],
    }
    tables = tables_of(summaries)
    _write_json(folder / SUMMARY, document)
    write_whole(folder / TABLES, markdown(tables))
    write_whole(folder / LATEX, latex(tables))
    return document, overview(summaries)


def _plain(fields: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make the dict of a dataclass, whose estimates name their parts too."""
    return {name: value._asdict() if isinstance(value, Estimate) else value for name, value in fields}


class Stored(NamedTuple):
    """What an evaluation left."""

    document: Mapping[str, Any]  # the summary as plain data
    summaries: Sequence[MissionSummary]
    records: Sequence[Record]  # the rows, at least one
    arguments: Mapping[str, Any]  # what was asked for
    policies: Sequence[str]  # in the order in which they were given


def read_stored(folder: Path) -> Stored:
    """Read rows and summary of an evaluation, finished or not, and check them against each other.

    Raises FileNotFoundError if one of them is missing, ValueError if one is damaged or they do not fit each other.
    """
    for name in (ROWS, SUMMARY):
        if not (folder / name).is_file():
            raise FileNotFoundError(f"{folder}: there is no {name}: a report needs the folder of an evaluation")
    records, path = read_records(folder / ROWS), folder / SUMMARY
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        _check(document)
        arguments = document["arguments"]
        summed = [(m["suite"], m["mission"], *sorted(p["policy"] for p in m["policies"])) for m in document["missions"]]
        summaries = summarise(records, arguments["baseline"]) if records else []
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{path}: damaged: {type(error).__name__}: {error}") from None
    found = [(m.suite, m.mission, *sorted(p.policy for p in m.policies)) for m in summaries]
    asked = all(r.suite in arguments["suites"] and r.policy in arguments["policies"] for r in records)
    if document["rows"] != len(records) or summed != found or not asked:
        raise ValueError(f"{folder}: {SUMMARY} does not sum up {ROWS}: run the evaluation once more")
    return Stored(document, summaries, records, arguments, list(dict.fromkeys(record.policy for record in records)))


def _check(document: Mapping[str, Any]) -> None:
    """Raise unless a document is a summary and has all its parts."""
    found = (document["format"], document["version"])
    if found != (f"{FORMAT} summary", VERSION):
        raise ValueError(f"must be a {FORMAT} summary of version {VERSION}, got {found[0]!r}, version {found[1]!r}")
    parts = {**document["arguments"], **document}
    if missing := sorted(_PARTS - parts.keys()):
        raise ValueError(f"lacks {', '.join(missing)}")
    for name in _MAPPINGS:
        if not isinstance(parts[name], dict):
            raise ValueError(f"{name} must be a dict, got {type(parts[name]).__name__}")


def _write_json(path: Path, content: dict[str, Any]) -> None:
    write_whole(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def write_whole(path: Path, text: str) -> None:
    """Write a text; the file appears whole or not at all."""
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")
