"""The report of an evaluation: one HTML page that opens from disk, with tables, figures and links to replays.

The page loads nothing: styles and figures are inside it. It links to the rows, the summary and the replays beside it.
"""

import os
import shlex
import shutil
import string
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from urllib.parse import quote

from hydrone_gym.evaluation.page_figures import SEVERAL, Chart, charts_of
from hydrone_gym.evaluation.plan import Plan, plan_of
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run_folder import ROWS, SUMMARY, TABLES, Stored, read_stored, write_whole
from hydrone_gym.evaluation.shown import REPLAYS, Shown, Writer, shown_flights, write_replays
from hydrone_gym.evaluation.summary import ALL_MISSIONS, MissionSummary
from hydrone_gym.evaluation.tables import tables_of
from hydrone_gym.rendering.comparison import colour

PAGE = "report.html"
_TEMPLATE = Path(__file__).with_name("page.html")
_UNFOLDED = 2  # missions of a suite whose tables are all in sight
_FILES = {
    ROWS: "a row a flight, with everything measured",
    SUMMARY: "the statistics, arguments, versions, commit and machine",
    TABLES: "the tables as Markdown",
}
Written = Mapping[Record, tuple[Path, Record]]


def write_report(
    folder: str | os.PathLike[str],
    *,
    into: str | os.PathLike[str] | None = None,
    plan: Plan | None = None,
    replay: Writer | None = None,
) -> Path:
    """Write the report of an evaluation, finished or not, and return the path of the page.

    Args:
        folder: of the evaluation, with `rows.csv` and `summary.json`.
        into: where to write `report.html`, copies of the rows, summary and tables, and the folder `replays`; made if
            missing; the evaluation's own folder unless given.
        plan: of the evaluation, to fly from; found again from the summary unless given, which works for frozen suites
            and for policies that other processes can import.
        replay: writes the replay of a flight, as `rendering.replay.write_replay` does. Without one the page names the
            worlds and the command that shows them.

    Raises:
        FileNotFoundError: no rows or no summary; a suite that cannot be found again.
        ValueError: rows or summary that are damaged or do not fit each other; policies that cannot be found again.
        OSError: files that cannot be written.
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
    write_whole(target / PAGE, _page(stored, shown, flown, target))
    return target / PAGE


def _page(stored: Stored, shown: Sequence[Shown], flown: Written, folder: Path) -> str:
    """Fill the template."""
    suites = list(stored.arguments["suites"])
    several = f"{len(stored.policies)} policies" if len(stored.policies) > 1 else stored.policies[0]
    worlds = len({record.key[:3] for record in stored.records})
    vehicle = stored.arguments["vehicle"]
    lead = f"{len(stored.records):,} flights in {worlds:,} worlds, the vehicle with its {vehicle} parameters."
    files = [f"<li>{_link(name, name)}: {words}</li>" for name, words in _FILES.items() if (folder / name).exists()]
    versions = stored.document["versions"]
    return string.Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        title=escape(f"{several} on {_listed(suites)}"),
        lead=escape(lead),
        about=_about(stored),
        tables=_lines(_suite_tables(stored, suite) for suite in suites),
        figures=_lines(map(_chart, charts_of(stored.records, stored.summaries))),
        replays=_replays(stored, shown, flown, folder),
        files=f"<ul>\n{_lines(files)}\n</ul>",
        footer=escape(f"Written by hydrone_gym {versions.get('hydrone-gym', '')}, {stored.document['date']}."),
    )


def _about(stored: Stored) -> str:
    """Return what was compared, and with what, as a list of facts."""
    document, arguments = stored.document, stored.arguments
    planned = len(arguments["policies"]) * sum(sum(worlds.values()) for worlds in arguments["worlds"].values())
    finished = "" if document["complete"] else f" of {planned:,}: the evaluation was stopped before its end"
    machine = document["machine"]
    names = (f'<span class="name">{_spot(stored, name)}{escape(name)}</span>' for name in stored.policies)
    facts = {
        "Baseline": arguments["baseline"],
        "Worlds": "\n".join(_worlds(name, worlds) for name, worlds in arguments["worlds"].items()),
        "Flights": f"{len(stored.records):,}{finished}",
        "Vehicle": f"{arguments['vehicle']} parameters",
        "Seed": str(arguments["seed"]),
        "Date": document["date"],
        "Commit": document["commit"] or "none: an installed copy",
        "Machine": ", ".join(f"{value} cores" if key == "cores" else str(value) for key, value in machine.items()),
        "Versions": ", ".join(f"{name} {version}" for name, version in document["versions"].items()),
    }
    shown = {"Policies": " ".join(names)} | {name: escape(text).replace("\n", "<br>") for name, text in facts.items()}
    return "<dl>\n" + _lines(f"<dt>{name}</dt><dd>{words}</dd>" for name, words in shown.items()) + "\n</dl>"


def _worlds(suite: str, missions: Mapping[str, int]) -> str:
    """Say how many worlds of a suite were flown."""
    numbers = sorted(set(missions.values()))
    each = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
    names = f": {_listed(list(missions))}" if len(missions) <= SEVERAL else ""
    return f"{suite}: {len(missions)} mission{'s' * (len(missions) > 1)}, {each} worlds each{names}"


def _suite_tables(stored: Stored, suite: str) -> str:
    """Return the tables of a suite: all missions together, then each, folded where they are many."""
    within = [summary for summary in stored.summaries if summary.suite == suite]
    whole = [_tables(stored, summary) for summary in within if summary.mission == ALL_MISSIONS]
    each = [_tables(stored, summary) for summary in within if summary.mission != ALL_MISSIONS]
    if len(each) > _UNFOLDED:
        each = [_folded(f"Tables of each of the {len(each)} missions", _lines(each))]
    return f"<h3>{escape(suite)}</h3>\n{_lines([*whole, *each])}"


def _tables(stored: Stored, summary: MissionSummary) -> str:
    """Return the tables of a mission."""
    ranked, compared = [p.policy for p in summary.policies], [c.policy for c in summary.comparisons]
    shown = []
    tables = tables_of([summary])
    for table, policies in zip(tables, (ranked, ranked, compared), strict=False):  # as `tables_of` orders them
        rows = [
            f"<tr>{_named(stored, policy, first)}{''.join(f'<td>{_figure(cell)}</td>' for cell in cells)}</tr>"
            for policy, (first, *cells) in zip(policies, table.rows, strict=True)
        ]
        shown.append(_scrolled("", table.title, table.heads, rows))
    return _lines(shown)


def _figure(cell: str) -> str:
    """Return a cell with its interval in small letters."""
    value, bracket, interval = escape(cell).partition(" [")
    return f"{value} <small>[{interval}</small>" if bracket else value


def _scrolled(kind: str, title: str, heads: Iterable[str], rows: Iterable[str]) -> str:
    """Return a table in a box that scrolls where the window is narrow; `kind` and `rows` are HTML."""
    columns = "".join(f'<th scope="col">{escape(name).replace(chr(10), "<br>")}</th>' for name in heads)
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(title)}"><table{kind}>\n'
        f"<caption><span>{escape(title)}</span></caption>\n<thead><tr>{columns}</tr></thead>\n"
        f"<tbody>\n{_lines(rows)}\n</tbody>\n</table></div>"
    )


def _chart(chart: Chart) -> str:
    """Return a chart: heading, caption, panels, and the folded ones."""
    name = chart.heading.lower().replace(" ", "-")
    panels, folded = (f'<div class="panels">\n{_lines(part)}\n</div>' for part in (chart.panels, chart.folded))
    if chart.folded:
        panels += "\n" + _folded(f"Each of {len(chart.folded)} missions", folded)
    caption = f"<figcaption>{escape(chart.caption)}</figcaption>"
    return f'<h3 id="{name}">{escape(chart.heading)}</h3>\n<figure>\n{caption}\n{panels}\n</figure>'


def _replays(stored: Stored, shown: Sequence[Shown], flown: Written, folder: Path) -> str:
    """Return the table of the flights that show each policy, with links or with how to fly them."""
    rows = []
    for entry in shown:
        flights = (entry.best, entry.median, entry.worst)
        cells = "".join(f"<td>{_flight(record, flown.get(record), folder)}</td>" for record in flights)
        rows.append(f"<tr>{_named(stored, entry.policy)}{cells}</tr>")
    chosen = (
        "<p>Best arrived soonest, median is in the middle by time of those that arrived. Worst is the soonest "
        "collision; without one the soonest rough crossing, then any other failure, then the slowest flight. "
        "Worlds count from 0.</p>"
    )
    heads = ("policy", "best", "median", "worst")
    table = _scrolled(' class="words"', "Flights that show each policy", heads, rows)
    return "\n".join([chosen, table, "" if flown else _recipe(shown[0].worst)])


def _flight(record: Record, flown: tuple[Path, Record] | None, folder: Path) -> str:
    """Return a cell: how a flight ended, linked to its replay, and where it was."""
    ending = escape(_ending(record))
    place = f"<br><small>{escape(record.place)}</small>"
    if flown is None:
        return ending + place
    path, again = flown
    differs = "" if record.same_flight(again) else f"<br><small>flown again: {escape(_ending(again))}</small>"
    return _link(path.relative_to(folder).as_posix(), _ending(record)) + place + differs


def _ending(record: Record) -> str:
    how = "arrived" if record.success else record.outcome.lower().replace("_", " ")
    return f"{how} after {record.time:.1f}\u00a0s"


def _recipe(record: Record) -> str:
    """Say how to see a flight, with one as the example."""
    names = {"policy": record.policy, "suite": record.suite, "mission": record.mission, "world": str(record.world)}
    command = shlex.join(["hydrone", "replay", ".", *(f"--{name}={value}" for name, value in names.items())])
    return (
        "<p>In the folder of this page, a command such as the following flies one again and writes a page that plays "
        f'it (it needs <code>pip install "hydrone-gym[replay]"</code>):</p>\n<pre>{escape(command)}</pre>'
    )


def _spot(stored: Stored, policy: str) -> str:
    """Return a spot of the colour that a policy has in the figures."""
    return f'<span class="swatch" style="background:{colour(stored.policies.index(policy))}"></span>'


def _named(stored: Stored, policy: str, text: str = "") -> str:
    """Return the head of a row: the name of a policy, or another text, behind its spot."""
    return f'<th scope="row">{_spot(stored, policy)}{escape(text or policy)}</th>'


def _link(path: str, text: str) -> str:
    return f'<a href="{escape(quote(path))}">{escape(text)}</a>'


def _folded(title: str, content: str) -> str:
    return f"<details>\n<summary>{escape(title)}</summary>\n{content}\n</details>"


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _lines(parts: Iterable[str]) -> str:
    return "\n".join(parts)
