"""The folder of an evaluation: what was asked for, and the finished rows, which survive whatever ends it."""

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.records import HEADER, Key, Record, parse_records, to_line

RUN, ROWS, SUMMARY, TABLES = "run.json", "rows.csv", "summary.json", "tables.md"
FORMAT = "hydrone_gym evaluation"
VERSION = 1


class RunFolder:
    """Rows of an evaluation on disk.

    Args:
        folder: made if missing.
        arguments: what the rows depend on, as plain data.
        overwrite: drop what another evaluation left there.

    Raises:
        ValueError: the folder holds an evaluation with other arguments, or rows that are damaged.
        OSError: a folder or file that cannot be made, read or written.
    """

    def __init__(self, folder: Path, arguments: dict[str, Any], *, overwrite: bool = False) -> None:
        """Compare arguments with those of the evaluation that is there, or begin a new one."""
        self.folder, self.rows = folder, folder / ROWS
        folder.mkdir(parents=True, exist_ok=True)
        run = folder / RUN
        if overwrite:
            for name in (RUN, ROWS, SUMMARY, TABLES):
                (folder / name).unlink(missing_ok=True)
        if run.exists():
            _compare(run, json.loads(json.dumps(arguments)))
        elif self.rows.exists():
            raise ValueError(f"{folder}: holds {ROWS} without {RUN}: choose another folder, or overwrite it")
        else:
            write_json(run, {"format": FORMAT, "version": VERSION, "arguments": arguments})

    def finished(self, keys: Sequence[Key]) -> list[Record]:
        """Return the rows that are there, the first of those that `keys` name.

        A last line that was cut off is removed from the file; a file with any other damage is left as it is.
        """
        if not self.rows.exists():
            return []
        content = self.rows.read_bytes()
        records = parse_records(content, os.fspath(self.rows))
        for number, record in enumerate(records):
            if number >= len(keys) or record.key != keys[number]:
                wanted = keys[number] if number < len(keys) else "the end of the file"
                raise ValueError(f"{self.rows}, line {number + 2}: expected the row of {wanted}, got {record.key}")
        whole = content.rfind(b"\n") + 1
        if whole < len(content):
            os.truncate(self.rows, whole)
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


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write plain data as JSON; the file appears whole or not at all."""
    write_whole(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def write_whole(path: Path, text: str) -> None:
    """Write a text; the file appears whole or not at all."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        os.replace(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
