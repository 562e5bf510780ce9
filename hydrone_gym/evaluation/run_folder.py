"""The folder of an evaluation: what was asked for, the finished rows, which survive whatever ends it, and the results.

| file | content |
|---|---|
| `run.json` | the arguments, and the seconds so far |
| `rows.csv` | a row a flight |
| `summary.json`, `tables.md`, `tables.tex` | what came of it |
"""

import dataclasses
import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hydrone_gym._whole_file import whole
from hydrone_gym.evaluation.bounds import bounds_of
from hydrone_gym.evaluation.levels import level_overview, level_tables
from hydrone_gym.evaluation.plan import Plan
from hydrone_gym.evaluation.provenance import made_with
from hydrone_gym.evaluation.records import HEADER, Key, Record, parse_records, read_records, to_line
from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.summary import MissionSummary, summarise
from hydrone_gym.evaluation.tables import Table, latex, markdown, overview, tables_of

RUN, ROWS, SUMMARY, TABLES, LATEX = "run.json", "rows.csv", "summary.json", "tables.md", "tables.tex"
FORMAT = "hydrone_gym evaluation"
VERSION = 1
_PARTS = {"versions", "commit", "machine", "date", "seconds", "rows", "complete", "missions"}
_PARTS |= {"suites", "worlds", "policies", "seed", "vehicle", "controller", "baseline"}  # these in the arguments
_MAPPINGS = ("suites", "worlds", "policies", "versions", "machine")


class RunFolder:
    """Rows of an evaluation in a folder, which is made if missing; whoever writes into it holds it with `held`.

    `overwrite` drops what another evaluation left there.

    Raises ValueError for a folder with flights that the plan does not ask for or that differ in more than the code of
    policies, or with damaged rows, OSError for what cannot be read or written.
    """

    def __init__(self, folder: Path, plan: Plan, *, overwrite: bool = False) -> None:
        """Compare the plan with the evaluation that is there, and read its rows; nothing is written yet."""
        self.folder, self.rows = folder, folder / ROWS
        self.changed: list[str] = []  #: policies whose code is not what it was, so that their rows do not count
        self.records: list[Record] = []  #: the other rows, in the order of the file
        self._arguments, self._before, self._began = plan.arguments(), 0.0, time.perf_counter()
        folder.mkdir(parents=True, exist_ok=True)
        if overwrite:
            for name in (RUN, ROWS, SUMMARY, TABLES, LATEX):
                (folder / name).unlink(missing_ok=True)
        if (folder / RUN).exists():
            self._compare(plan)
        elif self.rows.exists():
            raise ValueError(f"{folder}: holds {ROWS} without {RUN}: choose another folder, or overwrite it")
        if self.rows.exists():
            records = parse_records(self.rows.read_bytes(), os.fspath(self.rows))
            _check_keys(records, set(plan.keys()), self.rows)
            self.records = [record for record in records if record.policy not in self.changed]
        self.seconds = self._before  #: wall-clock time of all runs until their last finished flights, s

    def _compare(self, plan: Plan) -> None:
        """Find out what an evaluation in the folder has in common with a plan; ValueError if that is not enough."""
        run = self.folder / RUN
        try:
            document = json.loads(run.read_text(encoding="utf-8"))
            before, self._before = document["arguments"], float(document["seconds"])
            differing = plan.changes(before)
            digests = self._arguments["digests"]
            self.changed = [label for label, old in before["digests"].items() if digests.get(label) != old]
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise ValueError(f"{run}: damaged: {type(error).__name__}: {error}") from None
        if differing:
            advice = "ask for all that it holds, or choose another folder, or overwrite it"
            raise ValueError(
                f"{self.folder}: holds an evaluation with other arguments ({'; '.join(differing)}): {advice}"
            )

    def begin(self) -> None:
        """Make the folder ready for more rows: without those that do not count, a line cut off, and old results."""
        for name in (SUMMARY, TABLES, LATEX):
            (self.folder / name).unlink(missing_ok=True)
        self.arrange(self.records)
        self._write_run()

    def append(self, records: Sequence[Record]) -> None:
        """Write rows at the end, through to the operating system; OSError when it takes no more."""
        with open(self.rows, "ab", buffering=0) as stream:
            lines = "".join(map(to_line, records)).encode()
            waiting = memoryview((b"" if stream.tell() else f"{HEADER}\n".encode()) + lines)
            while waiting:  # a disk that is nearly full takes a part
                waiting = waiting[stream.write(waiting) :]
        self._write_run()

    def arrange(self, records: Sequence[Record]) -> None:
        """See to it that the file holds these rows in this order and nothing else."""
        text = "".join((f"{HEADER}\n", *map(to_line, records)))
        if self.rows.exists() and self.rows.read_bytes() != text.encode():
            write_whole(self.rows, text)

    def _write_run(self) -> None:
        self.seconds = self._before + time.perf_counter() - self._began
        head = {"format": FORMAT, "version": VERSION}
        _write_json(self.folder / RUN, {**head, "arguments": self._arguments, "seconds": self.seconds})


def _check_keys(records: Sequence[Record], asked: set[Key], rows: Path) -> None:
    """Raise ValueError for a row that is not asked for, or that is there twice."""
    for line, record in enumerate(records, start=2):
        if record.key not in asked:
            raise ValueError(f"{rows}, line {line}: there must be no row, or no second one, of {record.key}")
        asked.remove(record.key)


def write_results(
    plan: Plan, records: Sequence[Record], folder: Path, *, baseline: str | None = None, seconds: float | None = None
) -> tuple[dict[str, Any], list[Table]]:
    """Sum up the records of a plan, at least one, write summary and tables, and return the summary and its overview.

    `seconds` is the wall-clock time that all runs took, s.
    """
    arguments = plan.arguments()
    summaries = summarise(records, baseline, bounds_of(arguments))
    document = {
        "format": f"{FORMAT} summary",
        "version": VERSION,
        "arguments": {**arguments, "baseline": summaries[0].baseline},
        **made_with(),
        "seconds": seconds,
        "rows": len(records),
        "complete": len(records) == len(plan.keys()),
        "missions": [dataclasses.asdict(summary, dict_factory=_plain) for summary in summaries],
    }
    tables = [*level_tables(summaries), *tables_of(summaries)]
    _write_json(folder / SUMMARY, document)
    write_whole(folder / TABLES, markdown(tables))
    write_whole(folder / LATEX, latex(tables))
    return document, [*overview(summaries), *level_overview(summaries)]


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
        summaries = summarise(records, arguments["baseline"], bounds_of(arguments)) if records else []
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
