"""Failures as a CSV file, a line a flight, and as tables."""

import csv
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from agents.failures.causes import CAUSES, PARTS, Chance, Contact, End, Failure
from hydrone_gym.evaluation.tables import Table

# Units are part of the names; docs/failures.md says what each column means.
_FOUND = (*End._fields, *Contact._fields, *Chance._fields)
COLUMNS = ("mission", "seed", "outcome", "cause", *_FOUND, "stayed_s", "interventions")


def write_failures(failures: Sequence[Failure], path: Path) -> None:
    """Write failures to a CSV file with `COLUMNS`; numbers to four decimals, empty cells for what does not apply."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        writer.writerows(_line(failure) for failure in failures)


def _line(failure: Failure) -> list[object]:
    contact = failure.contact or (None,) * len(Contact._fields)
    chance = failure.chance or (None,) * len(Chance._fields)
    flown = (failure.mission, failure.seed, failure.outcome.name, failure.cause)
    cells = (*flown, *failure.end, *contact, *chance, failure.stayed_s, failure.interventions)
    return [round(cell, 4) if isinstance(cell, float) else cell for cell in cells]


def failure_tables(failures: Sequence[Failure], missions: Sequence[str], worlds: int) -> list[Table]:
    """Return tables: causes and parts of the flight by mission, and the typical numbers of each cause.

    `missions` are the environment ids in the order of the columns, `worlds` how many were flown in each.
    """
    tables = [_counts("cause", CAUSES, lambda failure: failure.cause, failures, missions, worlds)]
    if failures:
        tables.append(_counts("where", PARTS, lambda failure: failure.end.part, failures, missions, worlds))
        tables.append(_typical(failures))
    return tables


def _counts(
    title: str,
    kinds: Sequence[str],
    kind_of: Callable[[Failure], str],
    failures: Sequence[Failure],
    missions: Sequence[str],
    worlds: int,
) -> Table:
    """Count failures of each kind in each mission, with their share of the mission's failures."""
    columns = [[kind_of(failure) for failure in failures if failure.mission == mission] for mission in missions]
    rows = [(kind, *(_share(column.count(kind), len(column)) for column in columns)) for kind in kinds]
    rows = [row for row in rows if any(cell != "0" for cell in row[1:])]
    totals = (f"{len(column)} of {worlds} ({100.0 * len(column) / worlds:.2f} %)" for column in columns)
    return Table(title.capitalize(), (title, *map(short_name, missions)), (*rows, ("failures of worlds", *totals)))


def _typical(failures: Sequence[Failure]) -> Table:
    """Return the medians of what led to each cause, over all missions."""
    speeds = ("horizontal\nm/s", "vertical\nm/s", "closing\nm/s")
    heads = ("flights", *speeds, "known\ns", "last\nchance s", "speed\nthen m/s", "stayed\ns")
    rows = []
    for cause in CAUSES:
        those = [failure for failure in failures if failure.cause == cause]
        contacts = [failure.contact for failure in those if failure.contact is not None]
        chances = [failure.chance for failure in those if failure.chance is not None]
        values = (
            [failure.end.horizontal_speed_m_s for failure in those],
            [failure.end.vertical_speed_m_s for failure in those],
            [contact.closing_speed_m_s for contact in contacts],
            [contact.known_s for contact in contacts if contact.known_s is not None],
            [chance.last_chance_s for chance in chances],
            [chance.last_chance_speed_m_s for chance in chances],
            [failure.stayed_s for failure in those],
        )
        if those:
            rows.append((cause, str(len(those)), *map(_median, values)))
    return Table("Medians", ("medians", *heads), tuple(rows))


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.2f}" if values else "-"


def _share(count: int, whole: int) -> str:
    return f"{count} ({100.0 * count / whole:.0f} %)" if count else "0"


def short_name(mission: str) -> str:
    """Return an environment id without namespace and version."""
    return mission.removeprefix("HydroneGym/").removesuffix("-v0")
