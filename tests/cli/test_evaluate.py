"""`hydrone evaluate`: files, tables, exit codes, and what happens when it is stopped."""

import csv
import json
import signal
import subprocess
import sys

import joblib
import pytest

from hydrone_gym import cli
from hydrone_gym._folder_lock import held
from hydrone_gym.evaluation import DEFAULT_POLICIES, evaluate, read_records
from tests.evaluation.test_run import timeless
from tests.processes import LIMIT, completed, finish, send, started, wait_until

# A process that a script started in the background ignores Ctrl-C unless it asks for it.
PROGRAM = (
    "import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler);"
    "from hydrone_gym.cli import main; sys.exit(main())"
)
PAPER = ["--suites", "paper-20"]
TWO = [*PAPER, "--policies", "straight-line", "straight-line-shield", "--jobs", "1"]

# What somebody writes who has read docs/evaluation.md and nothing else.
THIRD_PARTY = '''
import numpy as np


class OverTheTop:
    """Climbs first, then flies level above most obstacles, and comes down on the goal."""

    def __init__(self, env):
        self.top = 9.0

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        x, y, z = observation["state"][:3]
        goal, yaw = observation["goal"], observation["reference"][3]
        away = goal[:2] - (x, y)
        distance = np.linalg.norm(away)
        if z < 0.0:
            return np.array([x, y, 3.0, yaw]), None
        if distance < 0.3:
            return np.array([*goal, yaw]), None
        step = away * min(1.0, 0.9 / distance) if z > self.top - 1.0 else np.zeros(2)
        return np.array([x + step[0], y + step[1], self.top, yaw]), None
'''


def remarks(err):
    """Lines on stderr but those that tell of kernels compiled, as in the first run after a change."""
    return [line for line in err.splitlines() if not line.startswith("hydrone: compiling ")]


def run(*options):
    return completed([sys.executable, "-c", PROGRAM, "evaluate", *map(str, options)])


def test_writes_rows_summary_and_tables(tmp_path, capsys):
    assert cli.main(["evaluate", *TWO, "--worlds", "3", "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert remarks(err) == []
    with (tmp_path / "rows.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 2 * 2 * 3
    assert timeless(read_records(tmp_path / "rows.csv")) == timeless(evaluate("paper-20", TWO[3:5], worlds=3))
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["complete"]
    assert summary["rows"] == 12
    assert summary["arguments"]["baseline"] == "straight-line"
    assert summary["arguments"]["worlds"] == {"paper-20-v1": {"air-to-water": 3, "water-to-air": 3}}
    assert {"python", "hydrone-gym", "numpy", "numba"} <= summary["versions"].keys()
    assert summary["machine"]["cores"] >= 1
    arrived = sum(row["success"] == "1" for row in rows if row["policy"] == "straight-line-shield")
    pooled = summary["missions"][-1]
    (shielded,) = [entry for entry in pooled["policies"] if entry["policy"] == "straight-line-shield"]
    assert shielded["success"]["value"] == arrived / 6
    assert pooled["comparisons"][0]["policy"] == "straight-line-shield"
    markdown = (tmp_path / "tables.md").read_text()
    for name in ("straight-line", "straight-line-shield", "air-to-water", "water-to-air", "all missions"):
        assert name in markdown
    assert markdown.count("\n\n- ") == 3 * 6
    *told, rows, summary, tables, latex = out.splitlines()
    names = ("rows.csv", "summary.json", "tables.md", "tables.tex")
    assert [rows, summary, tables, latex] == [str(tmp_path / name) for name in names]
    assert max(map(len, told)) <= 80
    assert told[0].strip() == "paper-20-v1, all missions: in short"
    assert sum(line.startswith("straight-line") for line in told) == 2
    assert "in tables.md" in told[-1]


def test_the_same_command_again_flies_nothing_and_says_the_same(tmp_path, capsys):
    command = ["evaluate", *TWO, "--worlds", "2", "--out", str(tmp_path), "--json"]
    assert cli.main(command) == 0
    first = json.loads(capsys.readouterr().out)
    rows = (tmp_path / "rows.csv").read_bytes()
    assert cli.main(command) == 0
    second = json.loads(capsys.readouterr().out)
    assert (tmp_path / "rows.csv").read_bytes() == rows
    assert second["missions"] == first["missions"]
    assert json.loads((tmp_path / "summary.json").read_text()) == second


def test_a_second_run_elsewhere_gives_the_same_rows(tmp_path):
    for name in ("one", "two"):
        assert cli.main(["evaluate", *TWO, "--worlds", "3", "--out", str(tmp_path / name), "--json"]) == 0
    assert timeless(read_records(tmp_path / "one" / "rows.csv")) == timeless(
        read_records(tmp_path / "two" / "rows.csv")
    )


def test_the_folder_is_named_for_the_suite(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["evaluate", *TWO, "--suites", "density", "missions", "--worlds", "1", "--json"]) == 0
    assert (tmp_path / "evaluations" / "density-v1+missions-v1" / "rows.csv").is_file()


def test_somebody_elses_policy_is_ranked_beside_ours(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "climber.py").write_text(THIRD_PARTY)
    policies = ["straight-line", "clrrt", "over-the-top=climber.py:OverTheTop", "climber:OverTheTop"]
    options = [*PAPER, "--policies", *policies, "--worlds", "10", "--jobs", "2", "--out", "out", "--json"]
    assert cli.main(["evaluate", *options]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["arguments"]["baseline"] == "clrrt"
    assert summary["arguments"]["policies"]["over-the-top"] == f"{tmp_path / 'climber.py'}:OverTheTop"
    ranked = {entry["policy"]: entry for entry in summary["missions"][-1]["policies"]}
    assert ranked.keys() == {"straight-line", "clrrt", "over-the-top", "climber:OverTheTop"}
    assert ranked["clrrt"]["rank"] == 1
    assert ranked["over-the-top"]["worlds"] == 20
    assert 0.0 < ranked["over-the-top"]["success"]["value"] <= 1.0
    assert ranked["over-the-top"]["success"] == ranked["climber:OverTheTop"]["success"]
    assert ranked["over-the-top"]["time"] == ranked["climber:OverTheTop"]["time"]


STOPPED = [*PAPER, "--policies", "straight-line-shield", "clrrt", "--worlds", "14", "--jobs", "2"]


@pytest.fixture(scope="module")
def uninterrupted():
    return evaluate("paper-20", STOPPED[3:5], worlds=14)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_stopped_evaluation_goes_on_to_the_same_rows(how, tmp_path, uninterrupted):
    command = [sys.executable, "-c", PROGRAM, "evaluate", *STOPPED, "--out", str(tmp_path)]
    rows = tmp_path / "rows.csv"
    with started(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        wait_until(lambda: rows.exists() and rows.read_bytes().count(b"\n") >= 15, process)
        send(process, how)  # as a terminal does: workers too
        told = finish(process)[1]
        assert process.returncode == (130 if how is signal.SIGINT else -how), told
    if how is signal.SIGINT:
        assert told == "hydrone: interrupted; finished flights are kept, the same command goes on\n"
    kept = read_records(rows)
    assert 14 <= len(kept) < len(uninterrupted)
    seconds = json.loads((tmp_path / "run.json").read_text())["seconds"]
    assert not (tmp_path / "summary.json").exists()
    done = run(*STOPPED, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    took = f"hydrone: {len(kept)} of {len(uninterrupted)} flights are taken from {rows}\n"
    assert done.stderr == took  # and nothing else where the output is no terminal
    assert read_records(rows)[: len(kept)] == kept
    assert timeless(read_records(rows)) == timeless(uninterrupted)
    assert json.loads((tmp_path / "summary.json").read_text())["seconds"] > seconds > 0.0


def test_a_folder_in_use_gives_2_at_once_and_a_killed_run_leaves_it_free(tmp_path, capsys):
    command = ["evaluate", *STOPPED, "--worlds", "60", "--out", str(tmp_path)]
    with started([sys.executable, "-c", PROGRAM, *command], stderr=subprocess.DEVNULL) as process:
        wait_until((tmp_path / "rows.csv").exists, process)
        assert cli.main(command) == 2
        busy = f"hydrone: error: {tmp_path} is in use by another run (pid {process.pid})\n"
        assert capsys.readouterr() == ("", busy)
        process.kill()  # its workers find out later
        process.wait(LIMIT)
        with held(tmp_path):
            pass
    assert read_records(tmp_path / "rows.csv")


def test_an_edited_policy_is_told_and_flown_anew(tmp_path, capsys):
    file = tmp_path / "climber.py"
    file.write_text(THIRD_PARTY)
    command = ["evaluate", *PAPER, "--policies", "straight-line", f"climber={file}:OverTheTop", "--worlds", "2"]
    command += ["--jobs", "1", "--out", str(tmp_path / "out"), "--json"]
    assert cli.main(command) == 0
    out, err = capsys.readouterr()
    assert remarks(err) == []
    file.write_text(THIRD_PARTY.replace("9.0", "7.0"))
    assert cli.main(command) == 0
    again, err = capsys.readouterr()
    assert remarks(err) == [
        f"hydrone: 4 of 8 flights are taken from {tmp_path / 'out' / 'rows.csv'}",
        "hydrone: flown anew, since the code is not what it was: climber",
    ]
    first, second = ({e["policy"]: e for e in json.loads(text)["missions"][-1]["policies"]} for text in (out, again))
    assert first["straight-line"] == second["straight-line"]
    assert first["climber"]["energy"] != second["climber"]["energy"]


def test_what_may_surprise_is_told(tmp_path, capsys):
    cores = joblib.cpu_count()
    command = ["evaluate", "--policies", "straight-line", "--out", str(tmp_path), "--json"]
    options = ["--suites", "density", "--worlds", "51", "--jobs", str(cores + 1), "--backend", "threading"]
    assert cli.main([*command, *options]) == 0
    assert remarks(capsys.readouterr().err) == [
        "hydrone: suite density-v1 has 50 worlds a mission, all are flown: --worlds is 51",
        f"hydrone: --jobs {cores + 1} is more than the {cores} cores here: flights wait for each other",
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--policies", "clrt"], "no policy 'clrt' (did you mean 'clrrt'?): known are clrrt, clrrt-published"),
        (["--policies", "gone.py:Mine"], "there is no file"),
        (["--suites", "paper-21"], "no suite 'paper-21': frozen are dense-40-v1"),
        (["--baseline", "ppo"], "--baseline must be one of straight-line, straight-line-shield, got 'ppo'"),
        (["--width", "column"], "--width and --no-title are about the figures of a --report"),
        (["--report", "r", "--width", "0.5"], "width must be column, text or from 2 to 20 inches, got 0.5"),
        (["--worlds", "0"], "worlds must be a whole number of at least 1, got 0"),
        (["--seed", "-1"], "seed must be a whole number of at least 0, got -1"),
        (["--jobs", "0"], "jobs must be a whole number of at least 1, at most 1024, got 0"),
        (["--jobs", "100000"], "jobs must be a whole number of at least 1, at most 1024, got 100000"),
        (["--suites", "held-out-obstacles-100000000"], "no suite 'held-out-obstacles-100000000'"),
        (["--backend", "pigeon"], "pigeon"),
    ],
)
def test_bad_input_gives_2_and_one_line(options, message, tmp_path, capsys):
    assert cli.main(["evaluate", *TWO, "--out", str(tmp_path / "new"), *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = err.splitlines()
    assert line.startswith("hydrone: error: ")
    assert message in line
    assert not (tmp_path / "new" / "rows.csv").exists()


def test_damaged_rows_give_2_with_line_and_column(tmp_path, capsys):
    command = ["evaluate", *TWO, "--worlds", "2", "--out", str(tmp_path), "--json"]
    assert cli.main(command) == 0
    rows = tmp_path / "rows.csv"
    damaged = rows.read_bytes().replace(b",GOAL,", b",GO?L,", 1)
    rows.write_bytes(damaged)
    capsys.readouterr()
    assert cli.main(command) == 2
    assert "column outcome: 'GO?L' does not fit success 1" in capsys.readouterr().err
    assert rows.read_bytes() == damaged


def test_a_failing_policy_gives_1_and_names_the_flight(tmp_path, capsys):
    (tmp_path / "leaky.py").write_text(
        "class Leaky:\n  def __init__(self, env):\n    pass\n  predict = None.__init__\n"
    )
    options = [*PAPER, "--policies", "straight-line", f"leaky={tmp_path / 'leaky.py'}:Leaky", "--worlds", "2"]
    assert cli.main(["evaluate", *options, "--jobs", "1", "--out", str(tmp_path / "out")]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "policy 'leaky' failed in suite paper-20-v1, mission air-to-water, world 0: " in line
    assert "2 of 8 flights are finished and kept in" in line
    assert len(read_records(tmp_path / "out" / "rows.csv")) == 2


@pytest.mark.parametrize(("limit", "finished"), [(2500, "12 flights are finished and kept"), (6000, "File too large")])
def test_a_full_disk_gives_1_and_keeps_rows(limit, finished, tmp_path):
    """A limit on the size of files stands in for it: it stops the rows, or the summary after them."""
    limited = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit})); {PROGRAM}"
    command = [sys.executable, "-c", limited, "evaluate", *TWO, "--worlds", "3", "--out", str(tmp_path)]
    done = completed(command)
    assert done.returncode == 1
    assert done.stderr.startswith("hydrone: error: ")
    assert "File too large" in done.stderr
    assert finished in done.stderr
    assert len(done.stderr.splitlines()) == 1
    kept = read_records(tmp_path / "rows.csv")
    assert 5 < len(kept) <= 12
    assert {file.name for file in tmp_path.iterdir()} == {"run.json", "rows.csv"}
    assert run(*TWO, "--worlds", "3", "--out", tmp_path).returncode == 0
    assert read_records(tmp_path / "rows.csv")[: len(kept)] == kept


def test_the_default_policies_are_what_the_help_says(capsys):
    with pytest.raises(SystemExit):
        cli.main(["evaluate", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    for option in ("--suites", "--policies", "--worlds", "--jobs", "--backend", "--out", "--overwrite", "--seed"):
        assert option in shown
    assert all(name in shown for name in DEFAULT_POLICIES)
