"""The report of an evaluation: one HTML page that opens from disk, with tables, figures and links to replays.

The page loads nothing: styles and figures are inside it. It links to the rows, the summary and the replays beside it.
"""

import os
import shlex
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2

from hydrone_gym.evaluation.levels import level_tables
from hydrone_gym.evaluation.page_figures import FIGURES, SEVERAL, charts_of, write_figures
from hydrone_gym.evaluation.plan import Plan, plan_of
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run_folder import LATEX, ROWS, SUMMARY, TABLES, Stored, read_stored, write_whole
from hydrone_gym.evaluation.shown import REPLAYS, Shown, Writer, shown_flights, write_replays
from hydrone_gym.evaluation.suites import in_short, level_of
from hydrone_gym.evaluation.summary import ALL_MISSIONS
from hydrone_gym.evaluation.tables import Table, tables_of
from hydrone_gym.rendering.comparison import colour

PAGE = "report.html"
_TEMPLATE = Path(__file__).with_name("page.html")
_UNFOLDED = 2  # missions of a suite whose tables are all in sight
_FILES = {
    ROWS: "a row a flight, with everything measured",
    SUMMARY: "the statistics, arguments, versions, commit and machine",
    TABLES: "the tables as Markdown",
    LATEX: "the tables as LaTeX, for a text that uses the package booktabs",
}
Written = Mapping[Record, tuple[Path, Record]]


def write_report(
    folder: str | os.PathLike[str],
    *,
    into: str | os.PathLike[str] | None = None,
    plan: Plan | None = None,
    replay: Writer | None = None,
    width: float | None = None,
    titled: bool = True,
) -> Path:
    """Write the report of an evaluation, finished or not, and return the path of the page.

    Args:
        folder: of the evaluation, with `rows.csv` and `summary.json`.
        into: where to write `report.html`, copies of the rows, summary and tables, and the folders `figures` and
            `replays`; made if missing; the evaluation's own folder unless given.
        plan: of the evaluation, to fly from; found again from the summary unless given, which works for frozen suites
            and for policies that other processes can import.
        replay: writes the replay of a flight, as `rendering.replay.write_replay` does. Without one the page names the
            worlds and the command that shows them.
        width: of the files in `figures`, inches, their text then of 8 points; as large as on the page unless given.
        titled: whether they have titles.

    Raises FileNotFoundError for no rows or summary, or a suite that cannot be found again, ValueError for those that
    are damaged or do not fit each other, or policies that cannot be found again.
    """
    source = Path(folder)
    target = source if into is None else Path(into)
    stored = read_stored(source)
    shown = shown_flights(stored.records)
    target.mkdir(parents=True, exist_ok=True)
    if target.resolve() != source.resolve():
        for name in _FILES:
            if (source / name).exists():
                shutil.copyfile(source / name, target / name)
    flown: Written = {}
    if replay is not None:
        flown = write_replays(shown, plan or plan_of(stored.arguments), target / REPLAYS, replay)
    charts = charts_of(stored.records, stored.summaries)
    drawn = write_figures(charts, target / FIGURES, width=width, titled=titled)
    files = {
        words: [(path.suffix[1:].upper(), f"{FIGURES}/{path.name}") for path in paths] for words, paths in drawn.items()
    }
    options: dict[str, Any] = {"autoescape": True, "trim_blocks": True, "undefined": jinja2.StrictUndefined}
    template = jinja2.Environment(**options).from_string(_TEMPLATE.read_text(encoding="utf-8"))
    write_whole(target / PAGE, template.render(_content(stored, shown, flown, target), charts=charts, drawn=files))
    return target / PAGE


def _content(stored: Stored, shown: Sequence[Shown], flown: Written, folder: Path) -> dict[str, Any]:
    """Return what the template is filled with."""
    document, suites, policies = stored.document, list(stored.arguments["suites"]), stored.policies
    levels = level_tables(stored.summaries)
    tables = [("Levels of weather", levels, list[Table](), "")] if levels else []
    tables += [(suite, *_tables(stored, suite, bool(levels))) for suite in suites]
    several = f"{len(policies)} policies" if len(policies) > 1 else policies[0]
    flights, worlds = len(stored.records), len({record.key[:3] for record in stored.records})
    vehicle = f"the vehicle with its {stored.arguments['vehicle']} parameters"
    return {
        "title": f"{several} on {_listed(in_short(suites))}",
        "lead": f"{flights:,} flights in {worlds:,} worlds, {vehicle}.",
        "colours": {policy: colour(index) for index, policy in enumerate(policies)},
        "facts": _facts(stored),
        "suites": tables,
        "shown": [(policy, [_flight(record, flown, folder) for record in records]) for policy, *records in shown],
        "command": "" if flown else _command(shown[0].worst),
        "files": {name: words for name, words in _FILES.items() if (folder / name).exists()},
        "footer": f"Written by hydrone_gym {document['versions'].get('hydrone-gym', '')}, {document['date']}.",
    }


def _facts(stored: Stored) -> dict[str, str]:
    """Say what was compared, and with what."""
    document, arguments = stored.document, stored.arguments
    planned = len(arguments["policies"]) * sum(sum(worlds.values()) for worlds in arguments["worlds"].values())
    finished = "" if document["complete"] else f" of {planned:,}: the evaluation was stopped before its end"
    machine = document["machine"]
    return {
        "Baseline": arguments["baseline"],
        "Worlds": "\n".join(_worlds(name, worlds) for name, worlds in arguments["worlds"].items()),
        "Flights": f"{len(stored.records):,}{finished}",
        "Vehicle": f"{arguments['vehicle']} parameters",
        "Control law": arguments["controller"] or "that of the suite",
        "Seed": str(arguments["seed"]),
        "Date": document["date"],
        "Commit": document["commit"] or "unknown",
        "Machine": ", ".join(f"{value} cores" if key == "cores" else str(value) for key, value in machine.items()),
        "Versions": ", ".join(f"{name} {version}" for name, version in document["versions"].items()),
    }


def _worlds(suite: str, missions: Mapping[str, int]) -> str:
    """Say how many worlds of a suite were flown."""
    numbers = sorted(set(missions.values()))
    each = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
    names = f": {_listed(list(missions))}" if len(missions) <= SEVERAL else ""
    return f"{suite}: {len(missions)} mission{'s' * (len(missions) > 1)}, {each} worlds each{names}"


def _tables(stored: Stored, suite: str, levels: bool) -> tuple[list[Table], list[Table], str]:
    """Return the tables of a suite that are in sight, those that are folded away, and what to call these.

    Where there are tables of several `levels`, those of a level are folded.
    """
    within = [summary for summary in stored.summaries if summary.suite == suite]
    each = [summary for summary in within if summary.mission != ALL_MISSIONS]
    first = [summary for summary in within if summary.mission == ALL_MISSIONS]
    if levels and level_of(suite) is not None:
        return [], tables_of([*first, *each]), "Tables of this level"
    if len(each) > _UNFOLDED:
        return tables_of(first), tables_of(each), f"Tables of each of the {len(each)} missions"
    return tables_of([*first, *each]), [], ""


def _flight(record: Record, flown: Written, folder: Path) -> dict[str, str]:
    """Say how a flight ended, where it was, and what its replay is and shows instead."""
    path, again = flown.get(record, (None, record))
    link = "" if path is None else quote(path.relative_to(folder).as_posix())
    otherwise = "" if record.same_flight(again) else _ending(again)
    return {"ending": _ending(record), "place": record.place, "link": link, "again": otherwise}


def _ending(record: Record) -> str:
    how = "arrived" if record.success else record.outcome.lower().replace("_", " ")
    return f"{how} after {record.time:.1f}\u00a0s"


def _command(record: Record) -> str:
    """Return the command that shows a flight."""
    names = {"policy": record.policy, "suite": record.suite, "mission": record.mission, "world": str(record.world)}
    return shlex.join(["hydrone", "replay", ".", *(f"--{name}={value}" for name, value in names.items())])


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
