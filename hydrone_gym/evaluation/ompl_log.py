"""Rows of an evaluation as benchmark logs of OMPL, from which its `ompl_benchmark_statistics.py` makes a database.

The grammar is in OMPL's documentation, https://ompl.kavrakilab.org/benchmark.html. A log is one experiment, so there is
one for each mission. `time` is what a row calls so, the time flown.
"""

import os
import re
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import get_args

import gymnasium as gym

from hydrone_gym.evaluation.plan import Plan, plan_of
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run_folder import Stored, read_stored, write_whole
from hydrone_gym.evaluation.suites import Mission
from hydrone_gym.simulation.outcome import Outcome

FOLDER = "ompl"  # in the folder of an evaluation
_TYPES = {bool: "BOOLEAN", int: "INTEGER", float: "REAL"}
# What OMPL has words for; all other numbers of a row keep the names of their columns.
_NAMES = {"success": "solved", "length": "solution_length", "clearance": "solution_clearance"}


def write_ompl_logs(folder: str | os.PathLike[str], plan: Plan | None = None) -> list[Path]:
    """Write a log of each mission of an evaluation, finished or not, into its folder `ompl`, and return the paths.

    The `plan` is found again from the summary unless given, which works for suites that other processes can load.

    Raises FileNotFoundError for no rows or summary, or a suite that cannot be found again, ValueError for those that
    are damaged or do not fit each other.
    """
    source = Path(folder)
    stored = read_stored(source)
    plan = plan or plan_of(stored.arguments)
    (source / FOLDER).mkdir(exist_ok=True)
    written = []
    for suite in plan.suites:
        for mission in suite.missions:
            rows = [row for row in stored.records if (row.suite, row.mission) == (suite.name, mission.name)]
            name = re.sub(r"[^\w.+=-]+", "-", f"{suite.name}-{mission.name}")
            if rows:
                written.append(source / FOLDER / f"{name}.log")
                write_whole(written[-1], "\n".join((*_preamble(name, mission, rows, stored), *_runs(rows, stored), "")))
    return written


def _preamble(name: str, mission: Mission, rows: Sequence[Record], stored: Stored) -> list[str]:
    """Return the lines about the experiment of this name."""
    document, arguments = stored.document, stored.arguments
    machine, policies = document["machine"], {row.policy for row in rows}
    with gym.make(mission.env_id, disable_env_checker=True, **mission.options) as env:
        limit = env.get_wrapper_attr("options").time_limit
    return [
        f"hydrone_gym version {document['versions']['hydrone-gym']}",
        f"Experiment {name}",
        f"Running on {'-'.join(machine['system'].split())}",
        f"Starting at {document['date']}",
        *("<<<|", f"vehicle = {arguments['vehicle']}", f"commit = {document['commit']}"),
        *(f"{option} = {value}" for option, value in mission.options.items()),
        *("|>>>", "<<<|", f"{machine['processor']}, {machine['cores']} cores", "|>>>"),
        f"{arguments['seed']} is the random seed",
        f"{limit} seconds per run",
        "inf MB per run",
        f"{max(sum(row.policy == policy for row in rows) for policy in policies)} runs per planner",
        f"{document['seconds'] or 0.0} seconds spent to collect the data",  # of all missions
        "1 enum type",
        "|".join(("outcome", *Outcome.__members__)),
        f"{len(policies)} planners",
    ]


def _runs(rows: Sequence[Record], stored: Stored) -> list[str]:
    """Return the lines about the policies of a mission and about their flights."""
    columns = {field.name: (get_args(field.type) or (field.type,))[0] for field in fields(Record)}
    kinds = {name: _TYPES[kind] for name, kind in columns.items() if kind in _TYPES}
    properties = ["outcome ENUM", *(f"{_NAMES.get(name, name)} {kind}" for name, kind in kinds.items())]
    lines = []
    for policy in dict.fromkeys(row.policy for row in rows):
        origin, digest = (stored.arguments[part][policy] for part in ("policies", "digests"))
        flown = [row for row in rows if row.policy == policy]
        lines += [policy, "2 common properties", f"origin = {origin}", f"code = {digest}"]
        lines += [f"{len(properties)} properties for each run", *properties, f"{len(flown)} runs"]
        for row in flown:
            cells = (int(Outcome[row.outcome]), *(getattr(row, name) for name in kinds))
            lines.append("".join(f"{_cell(cell)}; " for cell in cells))
        lines.append(".")
    return lines


def _cell(value: float | None) -> str:
    """Return a number in full, nothing for None."""
    if isinstance(value, bool):
        return str(int(value))
    return "" if value is None else repr(value)
