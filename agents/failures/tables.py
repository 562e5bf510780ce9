"""Failures as a CSV file, a line a flight, and as Markdown tables."""

import csv
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from agents.evaluation import Score
from agents.failures.causes import CAUSES, PARTS, Chance, Contact, End, Failure

# Units are part of the names; docs/failures.md says what each column means.
COLUMNS = (
    "mission",
    "seed",
    "outcome",
    "cause",
    *End._fields,
    *Contact._fields,
    *Chance._fields,
    "stayed_s",
    "interventions",
)


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


def failure_tables(failures: Sequence[Failure], scores: Sequence[Score]) -> str:
    """Return Markdown tables: causes and parts of the flight by mission, and the typical numbers of each cause.

    Args:
        failures: of all missions.
        scores: one a mission, in the order of the columns.
    """
    parts = [_counts("cause", CAUSES, lambda failure: failure.cause, failures, scores)]
    if failures:
        parts += [_counts("where", PARTS, lambda failure: failure.end.part, failures, scores), _typical(failures)]
    return "\n\n".join(parts)


def _counts(
    title: str,
    kinds: Sequence[str],
    kind_of: Callable[[Failure], str],
    failures: Sequence[Failure],
    scores: Sequence[Score],
) -> str:
    """Count failures of each kind in each mission, with their share of the mission's failures."""
    missions = [score.mission for score in scores]
    lines = [_row(title, *map(short_name, missions)), _row("---", *["---:"] * len(missions))]
    of_mission = {name: [kind_of(failure) for failure in failures if failure.mission == name] for name in missions}
    for kind in kinds:
        counts = [of_mission[name].count(kind) for name in missions]
        if any(counts):
            lines.append(
                _row(kind, *(_share(n, len(of_mission[name])) for n, name in zip(counts, missions, strict=True)))
            )
    totals = [(len(of_mission[score.mission]), score.episodes) for score in scores]
    lines.append(_row("failures of worlds", *(f"{n} of {m} ({100.0 * n / m:.2f} %)" for n, m in totals)))
    return "\n".join(lines)


def _typical(failures: Sequence[Failure]) -> str:
    """Return the medians of what led to each cause, over all missions."""
    speeds = ("horizontal m/s", "vertical m/s", "closing m/s")
    heads = ("flights", *speeds, "known s", "last chance s", "speed then m/s", "stayed s")
    lines = [_row("medians", *heads), _row("---", *["---:"] * len(heads))]
    for cause in CAUSES:
        those = [failure for failure in failures if failure.cause == cause]
        if not those:
            continue
        contacts = [failure.contact for failure in those if failure.contact is not None]
        chances = [failure.chance for failure in those if failure.chance is not None]
        cells = (
            _median([failure.end.horizontal_speed_m_s for failure in those]),
            _median([failure.end.vertical_speed_m_s for failure in those]),
            _median([contact.closing_speed_m_s for contact in contacts]),
            _median([contact.known_s for contact in contacts if contact.known_s is not None]),
            _median([chance.last_chance_s for chance in chances]),
            _median([chance.last_chance_speed_m_s for chance in chances]),
            _median([failure.stayed_s for failure in those]),
        )
        lines.append(_row(cause, str(len(those)), *cells))
    return "\n".join(lines)


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.2f}" if values else "-"


def _share(count: int, whole: int) -> str:
    return f"{count} ({100.0 * count / whole:.0f} %)" if count else "0"


def short_name(mission: str) -> str:
    """Return an environment id without namespace and version."""
    return mission.removeprefix("HydroneGym/").removesuffix("-v0")


def _row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"
