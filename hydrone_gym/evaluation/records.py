"""The tidy record of a flight in an evaluation, one a (policy, world), and its line of CSV."""

import csv
import io
import math
import os
import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, get_args

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
    zone_speed: float | None  #: largest lateral one within the transition zone, m/s; None in a batch, or if never there
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
# What a cell of a type must look like: a pattern, and the rule in words.
_RULES: dict[Any, tuple[str, str]] = {
    int: (r"[0-9]+", "a whole number"),
    bool: (r"[01]", "0 or 1"),
    float: (r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?", "a number"),
}


def record_of(key: Key, flight: Ending) -> Record:
    """Sum up a flight."""
    suite, mission, world, policy = key
    crossings = flight.transitions
    largest: dict[str, Any] = {
        name: max((abs(float(crossing[name])) for crossing in crossings), default=None)
        for name in ("lateral_speed", "tilt", "vertical_speed")
    }
    p50, p99, longest = (value or 0.0 for value in percentiles(flight.decision_ms, (50.0, 99.0, 100.0)))
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
        zone_speed=flight.zone_speed,
        interventions=flight.interventions,
        episode_return=flight.episode_return,
        decisions=len(flight.decision_ms),
        decision_ms_p50=p50,
        decision_ms_p99=p99,
        decision_ms_max=longest,
    )


def to_line(record: Record) -> str:
    """Return the line of CSV, line break included; floats in full, so that reading gives the same record."""
    stream, cells = io.StringIO(), (getattr(record, name) for name in COLUMNS)
    csv.writer(stream, lineterminator="\n").writerow(int(cell) if isinstance(cell, bool) else cell for cell in cells)
    return stream.getvalue()


def from_line(line: str) -> Record:
    """Read a line of CSV; ValueError names the column and what is wrong there."""
    cells = next(csv.reader([line], strict=True), [])
    if len(cells) != len(COLUMNS):
        raise ValueError(f"there must be {len(COLUMNS)} cells, got {len(cells)}")
    values = {field.name: _value(field.name, field.type, cell) for field, cell in zip(fields(Record), cells)}
    if values["outcome"] not in Outcome.__members__ or values["success"] != (values["outcome"] == Outcome.GOAL.name):
        raise ValueError(f"column outcome: {values['outcome']!r} does not fit success {int(values['success'])}")
    return Record(**values)


def _value(column: str, kind: Any, cell: str) -> Any:
    """Return what a cell holds, given the type of its column; None for an empty one where the type allows it."""
    if kind is str:
        return cell
    kind, *empty = get_args(kind) or (kind,)
    if empty and not cell:
        return None
    pattern, rule = _RULES[kind]
    number = float(cell) if re.fullmatch(pattern, cell) else math.inf
    if not math.isfinite(number):
        raise ValueError(f"column {column}: must be {rule}, got {cell!r}")
    return number if kind is float else kind(int(cell))


def read_records(path: str | os.PathLike[str]) -> list[Record]:
    """Read the rows that an evaluation wrote, without a last line that was cut off when it was killed.

    Raises ValueError for any other damage, naming file, line and column, and OSError for a file that cannot be read.
    """
    return parse_records(Path(path).read_bytes(), os.fspath(path))


def parse_records(content: bytes, name: str) -> list[Record]:
    """Turn the bytes of a file of rows into records; `name` is what errors call the file."""
    lines = content.split(b"\n")[:-1]
    if lines and lines[0] != HEADER.encode():
        raise ValueError(
            f"{name}, line 1: must name the columns {HEADER}; what an earlier version flew, fly again (--overwrite)"
        )
    records = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            records.append(from_line(line.decode()))
        except (ValueError, csv.Error) as error:
            raise ValueError(f"{name}, line {number}: {error}") from None
    return records
