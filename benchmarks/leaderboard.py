"""The leaderboard: policies on the frozen suites whose worlds have a bound, ranked by score, in docs/leaderboard.md.

    hydrone evaluate --suites weather --worlds 50 --policies mine=mine.py:Mine --out runs/mine
    python -m benchmarks.leaderboard runs/mine      # enters what an evaluation holds, anew where it is there already
    python -m benchmarks.leaderboard                # only writes the page
    python -m benchmarks.leaderboard --difficulty evaluations/paper-20-v1    # first measures how hard the worlds are

Entries are in results/leaderboard.json, difficulties in results/difficulty.json.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.tables import Sheet, put_into
from benchmarks.timing import RESULTS, ROOT
from hydrone_gym.evaluation.bounds import bounds_of
from hydrone_gym.evaluation.run_folder import read_stored
from hydrone_gym.evaluation.statistics import Estimate
from hydrone_gym.evaluation.suites import level_of
from hydrone_gym.evaluation.summary import PolicySummary, summarise
from hydrone_gym.evaluation.tables import cell

PAGE = ROOT / "docs" / "leaderboard.md"
WORLDS = ("paper-20-v1", "weather-0-v1")  # the suites that have worlds of their own, every level of weather the same
PLANNERS = ("straight-line", "straight-line-shield", "potential-field", "clrrt")  # whose scores say how hard a world is
QUARTERS = 4
COLUMNS = (
    *("policy", "score [95 %]", "easiest to hardest quarter", "at the goal %", "collisions", "rough crossings"),
    *("other", "time s"),
)
_SHOWN = ("score", "success", "collisions", "rough_crossings", "others", "time")


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to enter."""

    folders: Annotated[tuple[Path, ...], tyro.conf.Positional] = ()
    """Folders of `hydrone evaluate`, all worlds flown that have a bound, with the paper's vehicle."""
    difficulty: tuple[Path, ...] = ()
    """Folders of `hydrone evaluate` with the planners in still air, to measure how hard the worlds are."""
    results: Path = RESULTS
    """Folder of leaderboard.json and difficulty.json."""
    page: Path = PAGE
    """The page whose tables are written."""


def difficulties(folder: Path) -> dict[str, dict[str, list[float]]]:
    """Return of each mission's worlds in a folder that have a bound what the planners' mean score lacks to 1."""
    stored = read_stored(folder)
    bounds, found = bounds_of(stored.arguments), dict[str, dict[str, list[float]]]()
    if (stored.arguments["controller"] or "paper") != "paper" or not set(PLANNERS) <= set(stored.policies):
        raise ValueError(f"{folder}: difficulty is measured by {', '.join(PLANNERS)} under the paper's law")
    for suite in set(stored.arguments["suites"]) & set(WORLDS):
        found[suite] = {}
        for key in sorted({r.key[:3] for r in stored.records if r.suite == suite} & bounds.keys()):
            flown = [r for r in stored.records if r.key[:3] == key and r.policy in PLANNERS]
            scores = [p.score.value for p in summarise(flown, bounds=bounds)[0].policies if p.score]
            found[suite].setdefault(key[1], []).append(1.0 - float(np.mean(scores)))
    return found


def quarters_of(worlds: dict[str, list[float]]) -> dict[tuple[str, int], int]:
    """Return of each mission and world in which quarter it is, by difficulty within its mission; 0 is the easiest."""
    parts = {mission: np.array_split(np.argsort(hard, kind="stable"), QUARTERS) for mission, hard in worlds.items()}
    return {(m, int(k)): quarter for m, each in parts.items() for quarter, part in enumerate(each) for k in part}


def entries(folder: Path, hard: dict[str, dict[str, list[float]]]) -> dict[str, dict[str, dict[str, Any]]]:
    """Return what a folder says of every suite and policy; ValueError unless it flew all worlds that have a bound."""
    stored = read_stored(folder)
    if stored.arguments["vehicle"] != "paper":
        raise ValueError(f"{folder}: the vehicle must be paper, is {stored.arguments['vehicle']}")
    if not stored.document["complete"]:
        raise ValueError(f"{folder}: the evaluation was stopped before its end: the same command finishes it")
    bounds, found = bounds_of(stored.arguments), dict[str, dict[str, dict[str, Any]]]()
    for suite in stored.arguments["suites"]:
        records = [record for record in stored.records if record.suite == suite]
        still = "weather-0-v1" if level_of(suite) is not None else suite
        wanted = {key for key in bounds if key[0] == suite}
        if not wanted or {record.key[:3] for record in records} != wanted:
            flown = len({record.key[:3] for record in records})
            raise ValueError(f"{folder}: of {suite} must fly the {len(wanted)} worlds that have a bound, flew {flown}")
        if still not in hard:
            raise ValueError(f"{folder}: how hard the worlds of {still} are must be measured first, by --difficulty")
        quarter = quarters_of(hard[still])
        parts = [[r for r in records if quarter[r.mission, r.world] == part] for part in range(QUARTERS)]
        scores = [{p.policy: p.score.value for p in summarise(part, bounds=bounds)[-1].policies} for part in parts]
        about = {"version": stored.document["versions"]["hydrone-gym"], "date": stored.document["date"]}
        found[suite] = {
            p.policy: {**_plain(p), "quarters": [score[p.policy] for score in scores], **about}
            for p in summarise(records, bounds=bounds)[-1].policies
        }
    return found


def _plain(p: PolicySummary) -> dict[str, Any]:
    others = p.timeouts + p.out_of_bounds + p.diverged
    return {name: others if name == "others" else getattr(p, name) for name in _SHOWN}


def sheets(boards: dict[str, dict[str, dict[str, Any]]]) -> list[Sheet]:
    """Return a table of each suite and law, the best score first."""
    made = []
    for name in sorted(boards):
        suite, law = name.split(", ")
        level, ranked = level_of(suite), sorted(boards[name].items(), key=lambda e: (-e[1]["score"][0], e[0]))
        air = "still air" if not level else f"weather of level {level}"
        rows = [_row(rank, policy, entry) for rank, (policy, entry) in enumerate(ranked, start=1)]
        made.append(Sheet(f"{suite}: {air}, {law} law", COLUMNS, rows))
    return made


def _row(rank: int, policy: str, entry: dict[str, Any]) -> tuple[str, ...]:
    score, success, time = (entry[name] and Estimate(*entry[name]) for name in ("score", "success", "time"))
    counts = tuple(str(entry[name]) for name in ("collisions", "rough_crossings", "others"))
    parts = " ".join(f"{part:.2f}" for part in entry["quarters"])
    return (
        f"{rank}. `{policy}`",
        cell(score, 3),
        parts,
        cell(success, 1, 100.0),
        *counts,
        cell(time and time.value, 1),
    )


def section(boards: dict[str, dict[str, dict[str, Any]]]) -> str:
    """Return the tables in Markdown, and when they were flown."""
    dates = sorted({entry["date"][:10] for board in boards.values() for entry in board.values()})
    told = f"`python -m benchmarks.leaderboard`; flown on {', '.join(dates)}.\n"
    return "\n".join([*(sheet.markdown() for sheet in sheets(boards)), told])


def _read(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def _write(path: Path, content: dict[str, Any]) -> None:
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def main(arguments: Sequence[str] | None = None) -> int:
    a = tyro.cli(Arguments, args=arguments, description=__doc__)
    try:
        hard = _read(a.results / "difficulty.json")
        for folder in a.difficulty:
            hard.update(difficulties(folder))
        _write(a.results / "difficulty.json", hard)
        boards = _read(a.results / "leaderboard.json")
        for folder in a.folders:
            law = read_stored(folder).arguments["controller"] or "paper"
            for suite, board in entries(folder, hard).items():
                boards.setdefault(f"{suite}, {law}", {}).update(board)
        _write(a.results / "leaderboard.json", boards)
        put_into(a.page, section(boards))
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
