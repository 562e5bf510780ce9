"""`hydrone evaluate` and `hydrone fly` given what users get wrong: one line each, and what was finished is kept."""

import json
import sys

import pytest

from hydrone_gym import cli
from hydrone_gym.evaluation import read_records
from tests.cli.test_evaluate import remarks
from tests.processes import completed

POLICY = """
import sys, time
import numpy as np

class P:
    def __init__(self, env):
        {make}

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        there = observation["reference"]
        {predict}
"""
RULE = "policy P: predict must return (action, state)"
FINITE = f"{RULE}, the action finite numbers (m, m, m, rad) of shape (4,), got"
# What predict does, and what is said of it.
ANSWERS = {
    "action-only": ("return there", f"{RULE}, got ndarray"),
    "list": ("return [there, state]", f"{RULE}, got list of length 2"),
    "nothing": ("pass", f"{RULE}, got NoneType"),
    "three": ("return there, state, 1", f"{RULE}, got tuple of length 3"),
    "shape": ("return there[:3], state", f"{FINITE} shape (3,)"),
    "batch": ("return there[None], state", f"{FINITE} shape (1, 4)"),
    "text": ("return ['1', '2', '3', '4'], state", f"{FINITE} list of dtype <U1"),
    "ragged": ("return [1.0, [2.0]], state", f"{FINITE} list of dtype object"),
    "bool": ("return there > 0, state", f"{FINITE} ndarray of dtype bool"),
    "complex": ("return there * 1j, state", f"{FINITE} ndarray of dtype complex128"),
    "none": ("return None, state", f"{FINITE} NoneType of dtype object"),
    "nan": ("return [np.nan, 0.0, 0.0, 0.0], state", f"{FINITE} [nan 0. 0. 0.]"),
    "infinite": ("return np.full(4, np.inf), state", f"{FINITE} [inf inf inf inf]"),
}
RAISED = {
    "raises": ("raise KeyError('sails')", "KeyError: 'sails'"),
    "exits": ("sys.exit(3)", "SystemExit: 3"),
    "divides": ("1 // 0", "ZeroDivisionError"),
}
SOUND = "return there, state"


@pytest.fixture
def written(tmp_path):
    def write(predict=SOUND, make="pass"):
        (tmp_path / "p.py").write_text(POLICY.format(make=make, predict=predict))
        return f"mine={tmp_path / 'p.py'}:P"

    return write


def told(capsys):
    """The one line on stderr, nothing on stdout."""
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = remarks(err)
    assert line.startswith("hydrone: error: ")
    return line


@pytest.mark.parametrize("how", [*ANSWERS, *RAISED])
def test_a_policy_that_fails_in_flight_gives_1_and_its_rule(how, written, tmp_path, capsys):
    predict, message = {**ANSWERS, **RAISED}[how]
    options = ["--policies", "straight-line", written(predict), "--worlds", "1", "--jobs", "1"]
    assert cli.main(["evaluate", *options, "--out", str(tmp_path / "out")]) == 1
    line = told(capsys)
    assert "policy 'mine' failed in suite paper-20-v1, mission air-to-water, world 0: " in line
    assert message in line
    assert [record.policy for record in read_records(tmp_path / "out" / "rows.csv")] == ["straight-line"]


@pytest.mark.parametrize("how", ANSWERS)
def test_fly_says_the_same(how, written, tmp_path, capsys):
    predict, message = ANSWERS[how]
    policy = written(predict).removeprefix("mine=")
    options = ["--mission", "air-to-water", "--out", str(tmp_path / "out"), "--no-figures"]
    assert cli.main(["fly", "--policy", policy, *options]) == 2
    assert message in told(capsys)


@pytest.mark.parametrize("how", RAISED)
@pytest.mark.parametrize(
    "text", ["class P:\n  def __init__(self, env):\n    {}", "import sys\n{}"], ids=["made", "read"]
)
def test_a_policy_that_cannot_be_made_gives_2(text, how, tmp_path, capsys):
    (tmp_path / "p.py").write_text("import sys\n" + text.format(RAISED[how][0]))
    options = ["--policies", f"mine={tmp_path / 'p.py'}:P", "--worlds", "1", "--jobs", "1"]
    assert cli.main(["evaluate", *options, "--out", str(tmp_path / "out")]) == 2
    assert RAISED[how][1].partition(":")[0] in told(capsys)
    assert not (tmp_path / "out" / "rows.csv").exists()


def test_a_batch_is_told_its_shape_and_its_bad_row(written, tmp_path, capsys):
    predict = "there = there * 1.0; there[-1] = np.nan; return there, state"
    options = ["--suites", "held-out", "--policies", written(predict), "--worlds", "2", "--jobs", "1"]
    assert cli.main(["evaluate", *options, "--out", str(tmp_path / "out")]) == 1
    assert "(m, m, m, rad) of shape (2, 4), got [nan nan nan nan]" in told(capsys)


def test_a_policy_that_prints_and_spoils_what_it_is_given_changes_nothing(written, tmp_path):
    """Also in a worker process, whose output is that of the command."""
    spoil = (
        "print('ahoy'); moved = there.copy(); [part.fill(np.nan) for part in observation.values()]; observation.clear()"
    )
    options = ["--suites", "paper-20", "--worlds", "1", "--json", "--out", str(tmp_path)]
    assert cli.main(["evaluate", "--policies", written(), "--jobs", "1", *options]) == 0
    before = read_records(tmp_path / "rows.csv")
    command = [
        "evaluate",
        "--policies",
        written(f"{spoil}; return moved, state", "print('made')"),
        "--jobs",
        "2",
        *options,
    ]
    program = "import sys; from hydrone_gym.cli import main; sys.exit(main())"
    done = completed([sys.executable, "-c", program, *command])
    assert json.loads(done.stdout)["rows"] == 2
    assert "ahoy" in done.stderr
    assert "made" in done.stderr
    after = read_records(tmp_path / "rows.csv")
    assert after != before
    assert all(a.same_flight(b) for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--worlds", "-3"], "worlds must be a whole number of at least 1, got -3"),
        (["--jobs", "-1"], "jobs must be a whole number of at least 1"),
        (["--policies", ""], "no policy ''"),
        (["--policies", "x="], "no policy 'x='"),
        (["--policies", ":"], "no policy ':'"),
        (["--policies", "straight-line", "straight-line"], "policies must have different names"),
        (["--policies", "straight-line+sails"], "no policy 'straight-line+sails'"),
        (["--policies", "{tmp}/bytes.py:P"], "cannot be imported: SyntaxError"),
        (["--policies", "{tmp}/folder.py:P"], "there is no file"),
        (["--policies", "{tmp}/folder.py"], "not a trained agent"),
        (["--policies", "{tmp}/file.txt:P"], "cannot be imported"),
        (["--policies", "{tmp}/file.txt"], "no policy"),
        (["--policies", "{tmp}/p.py:Q"], "has no attribute 'Q'"),
        (["--policies", "a\nb={tmp}/p.py:P"], "there is no file a b="),
        (["--suites", ""], "no suite ''"),
        (["--suites", "{tmp}/file.txt"], "not a suite file"),
        (["--suites", "{tmp}/folder.py"], "no scenario files"),
        (["--suites", "paper-20", "paper-20"], "suites must have different names"),
        (["--suites", "held-out-obstacles-999"], "no solvable scenario"),
        (["--suites", "held-out-radii-3.0-2.0"], "obstacle_radius"),
        (["--suites", "held-out-radii-8.0-9.0"], "obstacle_radius must be less than"),
        (["--baseline", ""], "--baseline must be one of"),
        (["--backend", ""], "backend"),
        (["--out", "{tmp}/file.txt"], "file.txt"),
        (["--out", "{tmp}/file.txt/below"], "file.txt"),
        (["--report", "{tmp}/file.txt"], "file.txt"),
    ],
)
def test_bad_input_gives_2_one_line_and_no_rows(options, message, written, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written()
    (tmp_path / "bytes.py").write_bytes(b"\x00\xff\x80def")
    (tmp_path / "file.txt").write_text("ahoy")
    (tmp_path / "folder.py").mkdir()
    options = [option.format(tmp=tmp_path) for option in options]
    sound = ["--policies", "straight-line", "--worlds", "1", "--jobs", "1", "--out", str(tmp_path / "new")]
    assert cli.main(["evaluate", *sound, *options]) == 2
    assert message in told(capsys)
    assert not list(tmp_path.rglob("rows.csv"))
