"""The tidy record of a flight in an evaluation, one a (policy, world), and its line of CSV."""

import csv
import io
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.flight import Ending
from hydrone_gym.evaluation.statistics import percentiles
from hydrone_gym.simulation.outcome import Outcome

Key = tuple[str, str, int, str]


@dataclass(frozen=True, kw_only=True)
class Record:
    """One flight; None is an empty cell, where there is nothing to tell."""

    suite: str  #: name of the suite, with its version
    mission: str  #: name of the mission in it
    world: int  #: number of the world in the mission, from 0
    obstacles: int  #: spheres in that world
    policy: str  #: what the evaluation calls it
    outcome: str  #: name of an `Outcome`
    success: bool  #: whether that is GOAL
    time: float  #: s
    energy: float  #: of the rotors' shafts, J
    length: float | None  #: of the path, m; None for a flight in a batch
    clearance: float | None  #: least distance of the vehicle's sphere to an obstacle, m; None without obstacles
    crossings: int  #: of the surface
    crossing_time: float | None  #: of the first one, s
    lateral_speed: float | None  #: largest at a crossing, m/s
    tilt: float | None  #: largest at a crossing, rad
    vertical_speed: float | None  #: largest at a crossing, either way, m/s
    interventions: int | None  #: periods in which a shield flew another reference; None without a shield
    episode_return: float  #: sum of rewards
    decisions: int  #: periods flown
    decision_ms_p50: float  #: wall-clock time of a decision, ms; only these three differ from run to run
    decision_ms_p99: float
    decision_ms_max: float

    @property
    def key(self) -> Key:
        """What tells it from every other record: suite, mission, world, policy."""
        return self.suite, self.mission, self.world, self.policy

    @property
    def place(self) -> str:
        """Its world, in words."""
        return f"{self.suite}, {self.mission}, world {self.world}"

    def same_flight(self, other: "Record") -> bool:
        """Tell whether another record differs in nothing but times of decisions."""
        return all(getattr(self, name) == getattr(other, name) for name in COLUMNS if name not in TIMING)


COLUMNS = tuple(field.name for field in fields(Record))
TIMING = tuple(name for name in COLUMNS if name.startswith("decision_ms"))
HEADER = ",".join(COLUMNS)


def record_of(key: Key, flight: Ending) -> Record:
    """Sum up a flight."""
    crossings = flight.transitions
    speeds = ("lateral_speed", "tilt", "vertical_speed")
    largest: dict[str, Any] = {
        name: max((abs(float(crossing[name])) for crossing in crossings), default=None) for name in speeds
    }
    decisions: list[Any] = [value or 0.0 for value in percentiles(flight.decision_ms, (50.0, 99.0, 100.0))]
    suite, mission, world, policy = key
    return Record(
        suite=suite,
        mission=mission,
        world=world,
        policy=policy,
        obstacles=flight.obstacles,
        outcome=flight.outcome.name,
        success=flight.outcome is Outcome.GOAL,
        time=float(flight.time),
        energy=float(flight.energy),
        length=flight.length,
        clearance=float(flight.clearance) if math.isfinite(flight.clearance) else None,
        crossings=len(crossings),
        crossing_time=float(crossings[0]["time"]) if crossings else None,
        **largest,
        interventions=flight.interventions,
        episode_return=flight.episode_return,
        decisions=len(flight.decision_ms),
        **dict(zip(TIMING, decisions, strict=True)),
    )


def to_line(record: Record) -> str:
    """Return the line of CSV, line break included; floats in full, so that reading gives the same record."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerow(_cell(getattr(record, name)) for name in COLUMNS)
    return stream.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return str(int(value)) if isinstance(value, bool) else str(value)  # str of a float restores it bit for bit


def from_line(line: str) -> Record:
    """Read a line of CSV; ValueError names the column and what is wrong there."""
    cells = next(csv.reader([line], strict=True), [])
    if len(cells) != len(COLUMNS):
        raise ValueError(f"there must be {len(COLUMNS)} cells, got {len(cells)}")
    values = {}
    for field, cell in zip(fields(Record), cells, strict=True):
        try:
            values[field.name] = _READERS[field.type](cell)
        except ValueError as error:
            raise ValueError(f"column {field.name}: {error}") from None
    if values["outcome"] not in Outcome.__members__ or values["success"] != (values["outcome"] == Outcome.GOAL.name):
        raise ValueError(f"column outcome: {values['outcome']!r} does not fit success {int(values['success'])}")
    return Record(**values)


def _number(kind: Callable[[str], Any], rule: Callable[[str], bool], words: str) -> Callable[[str], Any]:
    """Return a reader of cells that obey a rule."""

    def read(cell: str) -> Any:
        if not rule(cell):
            raise ValueError(f"must be {words}, got {cell!r}")
        return kind(cell)

    return read


def _finite(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


_WHOLE = _number(int, lambda cell: cell.isascii() and cell.isdigit(), "a whole number")
_FLOAT = _number(float, _finite, "a number")
_READERS: dict[Any, Any] = {
    str: str,
    int: _WHOLE,
    bool: _number("1".__eq__, lambda cell: cell in ("0", "1"), "0 or 1"),
    float: _FLOAT,
    int | None: lambda cell: _WHOLE(cell) if cell else None,
    float | None: lambda cell: _FLOAT(cell) if cell else None,
}


def read_records(path: str | os.PathLike[str]) -> list[Record]:
    """Read the rows that an evaluation wrote.

    A last line without its line break, cut off when the evaluation was killed, is left out.

    Raises:
        ValueError: any other damage, naming file, line and column.
        OSError: a file that cannot be read.
    """
    return parse_records(Path(path).read_bytes(), os.fspath(path))


def parse_records(content: bytes, name: str) -> list[Record]:
    """Turn the bytes of a file of rows into records; `name` is what errors call the file."""
    lines = content.split(b"\n")[:-1]
    if lines and lines[0] != HEADER.encode():
        raise ValueError(f"{name}, line 1: must name the columns {HEADER}")
    records = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            records.append(from_line(line.decode()))
        except (ValueError, csv.Error) as error:
            raise ValueError(f"{name}, line {number}: {error}") from None
    return records
