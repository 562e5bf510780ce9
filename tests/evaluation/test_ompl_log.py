"""Logs are read back by the grammar that OMPL documents, and hold the rows.

logfile: preamble, planners; see "The benchmark logfile format" in https://ompl.kavrakilab.org/benchmark.html.
"""

import re

import pytest

from hydrone_gym import cli
from hydrone_gym.evaluation import read_records
from hydrone_gym.evaluation.ompl_log import write_ompl_logs
from hydrone_gym.evaluation.plan import make_plan
from hydrone_gym.evaluation.records import COLUMNS
from hydrone_gym.evaluation.run_folder import write_results

FEW = ["--suites", "paper-20", "--worlds", "3", "--jobs", "1"]
OPTIONS = [*FEW, "--policies", "straight-line", "shielded=straight-line-shield"]
FLOAT, INT = r"(inf|\d+(?:\.\d*)?(?:e[-+]?\d+)?)", r"(\d+)"
OTHERWISE = {"solved": "success", "solution_length": "length", "solution_clearance": "clearance"}


class Log:
    """A log, line by line: `told` of the preamble, `enums`, and of each planner its settings, columns and runs."""

    def __init__(self, path):
        self.lines = path.read_text(encoding="utf-8").split("\n")
        assert self.lines.pop() == ""  # the last line ends too
        self.told = {}
        for name, pattern in (
            ("version", r"(\S+ version \S+)"),
            ("name", r"Experiment (\S+)"),
            ("host", r"Running on (\S+)"),
            ("date", r"Starting at (.+)"),
        ):
            self.told[name] = self.take(pattern)
        self.told["setup"], self.told["cpu"] = self.text(), self.text()
        for name, pattern in (
            ("seed", INT + " is the random seed"),
            ("limit", FLOAT + " seconds per run"),
            ("memory", FLOAT + " MB per run"),
            ("runs", INT + " runs per planner"),
            ("seconds", FLOAT + " seconds spent to collect the data"),
        ):
            self.told[name] = float(self.take(pattern))
        enums = [self.lines.pop(0).split("|") for _ in range(int(self.take(INT + " enum type")))]
        self.enums = {name: values for name, *values in enums}
        self.planners = dict(self.planner() for _ in range(int(self.take(INT + " planners"))))
        assert self.lines == []

    def take(self, pattern):
        line = self.lines.pop(0)
        match = re.fullmatch(pattern, line)
        assert match, f"{line!r} is not {pattern}"
        return match[1]

    def text(self):
        self.take(r"(<<<\|)")
        end = self.lines.index("|>>>")
        text, self.lines = self.lines[:end], self.lines[end + 1 :]
        return text

    def planner(self):
        name = self.take(r"(.+)")
        count = int(self.take(INT + " common properties"))
        settings = dict(self.lines.pop(0).split(" = ", 1) for _ in range(count))
        count = int(self.take(INT + " properties for each run"))
        columns = [self.take(r"(\S+ (?:BOOLEAN|INTEGER|REAL|ENUM))").split() for _ in range(count)]
        runs = []
        for _ in range(int(self.take(INT + " runs"))):
            *cells, end = self.lines.pop(0).split("; ")
            assert end == ""
            runs.append({name: self.value(kind, cell) for (name, kind), cell in zip(columns, cells, strict=True)})
        assert self.lines.pop(0) == "."
        return name, (settings, runs)

    def value(self, kind, cell):
        if not cell:
            return None
        assert kind == "REAL" or cell.isdecimal()
        assert kind != "BOOLEAN" or cell in "01"
        return float(cell) if kind == "REAL" else int(cell)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of an evaluation, with logs."""
    folder = tmp_path_factory.mktemp("evaluated")
    assert cli.main(["evaluate", *OPTIONS, "--out", str(folder), "--export", "ompl-log"]) == 0
    return folder


def test_logs_hold_every_number_of_every_row(folder):
    rows = read_records(folder / "rows.csv")
    logs = [Log(folder / "ompl" / f"paper-20-v1-{mission}.log") for mission in ("air-to-water", "water-to-air")]
    assert {path.suffix for path in (folder / "ompl").iterdir()} == {".log"}
    found = []
    for log in logs:
        assert log.told["runs"] == 3
        for policy, (settings, runs) in log.planners.items():
            assert settings["origin"].startswith("planners")
            for run in runs:
                outcome = log.enums["outcome"][run.pop("outcome")]
                numbers = {OTHERWISE.get(name, name): value for name, value in run.items()}
                found.append({**numbers, "outcome": outcome, "policy": policy, "mission": log.told["name"][12:]})
    expected = [{name: getattr(row, name) for name in COLUMNS if name != "suite"} for row in rows]
    order = ["mission", "policy", "world"]
    assert sorted(found, key=lambda r: [r[k] for k in order]) == sorted(expected, key=lambda r: [r[k] for k in order])
    assert {row["policy"] for row in found} == {"straight-line", "shielded"}


def test_the_preamble_says_how_it_was_flown(folder):
    log = Log(folder / "ompl" / "paper-20-v1-air-to-water.log")
    assert log.told["version"].startswith("hydrone_gym version ")
    assert log.told["name"] == "paper-20-v1-air-to-water"
    assert (log.told["limit"], log.told["memory"], log.told["seed"]) == (120.0, float("inf"), 0)
    assert log.told["seconds"] > 0.0
    assert "num_obstacles = 20" in log.told["setup"]
    assert log.enums["outcome"][:3] == ["RUNNING", "GOAL", "COLLISION"]


def test_a_finished_folder_is_exported_without_flying(folder, capsys):
    log = folder / "ompl" / "paper-20-v1-water-to-air.log"
    before = log.read_text()
    log.unlink()
    assert cli.main(["evaluate", *OPTIONS, "--out", str(folder), "--export", "ompl-log"]) == 0
    out, err = capsys.readouterr()
    assert "12 of 12 flights are taken" in err
    assert out.splitlines()[-1] == str(log)
    assert log.read_text() == before
    log.unlink()
    assert write_ompl_logs(folder)[1] == log
    assert log.read_text() == before


def test_an_evaluation_that_is_not_finished_has_the_logs_of_what_was_flown(folder, tmp_path):
    plan = make_plan("paper-20", {"straight-line": "straight-line", "shielded": "straight-line-shield"}, worlds=3)
    rows = [row for row in read_records(folder / "rows.csv") if row.mission == "air-to-water"][:4]
    (tmp_path / "rows.csv").write_text("\n".join((folder / "rows.csv").read_text().split("\n")[:5]) + "\n")
    write_results(plan, rows, tmp_path)
    (path,) = write_ompl_logs(tmp_path)
    log = Log(path)
    assert {policy: len(runs) for policy, (_, runs) in log.planners.items()} == {"straight-line": 3, "shielded": 1}
    assert (log.told["runs"], log.told["seconds"]) == (3, 0.0)


def test_a_folder_without_an_evaluation_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"there is no rows\.csv"):
        write_ompl_logs(tmp_path)
