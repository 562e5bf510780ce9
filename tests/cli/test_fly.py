"""The command line: what it prints, what it writes, and how it ends."""

import json
import math
import os
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym import cli
from hydrone_gym.evaluation import fly
from hydrone_gym.world.scenario import Scenario, load_scenario, save_scenario
from planners import CLRRT
from tests.processes import finish, started

EMPTY = ["fly", "--policy", "straight-line", "--obstacles", "0", "--no-figures"]


def reject(constant):
    raise AssertionError(f"{constant} is not JSON")


def test_flies_both_experiments_by_default(tmp_path, capsys):
    assert cli.main([*EMPTY, "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "air-to-water" in out
    assert "water-to-air" in out
    for label in ("outcome", "crossing at", "lateral speed", "tilt", "clearance", "length", "energy", "p50", "p99"):
        assert label in out
    assert out.count("GOAL") == 2
    assert out.strip().splitlines()[-1] == str(tmp_path / "flight.json")
    assert max(map(len, out.replace(str(tmp_path), "").splitlines())) <= 80


def test_draws_every_figure_and_agrees_with_fly(tmp_path, capsys):
    assert cli.main(["fly", "--mission", "air-to-water", "--seed", "4", "--json", "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    document = json.loads(text, parse_constant=reject)
    assert json.loads((tmp_path / "flight.json").read_text()) == document
    (record,) = document["flights"]
    env = gym.make("HydroneGym/AirToWater-v0")
    flight = fly(env, CLRRT.for_env(env, seed=4), seed=4)
    assert record["time"] == flight.time
    np.testing.assert_array_equal(record["states"], flight.states)
    assert record["scenario"]["obstacles"] == flight.scenario.obstacles.tolist()
    names = {f"air-to-water-clrrt-seed-4-{kind}.{suffix}" for kind in FIGURES for suffix in ("png", "pdf")}
    assert {file.name for file in tmp_path.iterdir()} == {"flight.json", *names}
    assert sorted(record["figures"]) == sorted(str(tmp_path / name) for name in names)
    assert all((tmp_path / name).stat().st_size > 5000 for name in names)


def test_figures_for_a_column_without_titles(tmp_path):
    options = [
        "fly",
        "--mission",
        "air-to-water",
        "--policy",
        "straight-line",
        "--obstacles",
        "0",
        "--out",
        str(tmp_path),
    ]
    assert cli.main([*options, "--width", "column", "--no-title"]) == 0
    for name in ("path", "position", "attitude"):
        content = (tmp_path / f"air-to-water-straight-line-seed-0-{name}.pdf").read_bytes()
        assert b"MediaBox [ 0 0 252 " in content  # 3.5 inches


def test_a_width_out_of_range_is_refused(tmp_path, capsys):
    assert cli.main([*EMPTY, "--width", "30", "--out", str(tmp_path)]) == 2
    assert "width must be column, text or from 2 to 20 inches, got 30" in capsys.readouterr().err


FIGURES = ("path", "position", "attitude", "tree")


def test_json_of_an_empty_world_is_finite(tmp_path, capsys):
    assert cli.main([*EMPTY, "--json", "--out", str(tmp_path)]) == 0
    document = json.loads(capsys.readouterr().out, parse_constant=reject)
    assert [record["clearance"] for record in document["flights"]] == [None, None]
    assert document["policy"] == "straight-line"
    assert all(math.isfinite(record["planning_ms"]["p99"]) for record in document["flights"])


def test_policies_are_those_of_an_evaluation(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drifting.py").write_text("from planners import StraightLine\nDrift = StraightLine.for_env\n")
    times = []
    for policy in ("straight-line", "drifting.py:Drift", "drift=drifting:Drift", "ppo-shield"):
        options = ["fly", "--policy", policy, "--obstacles", "0", "--mission", "air-to-water", "--no-figures", "--json"]
        assert cli.main(options) == 0
        times.append(json.loads(capsys.readouterr().out)["flights"][0]["time"])
    assert times[0] == times[1] == times[2] != times[3]


@pytest.fixture
def scenario_file(tmp_path):
    """A straight line to this goal ends at the sphere; the planner flies round it."""
    scenario = Scenario(start=(-8.0, 0.0, 5.0, 0.0), goal=(8.0, 0.0, 5.0), obstacles=[(0.0, 0.0, 5.0, 1.0)])
    path = tmp_path / "ball.json"
    save_scenario(scenario, path)
    return path


def test_a_mission_that_fails_gives_1(scenario_file, tmp_path, capsys):
    options = ["fly", "--scenario", str(scenario_file), "--no-figures", "--out", str(tmp_path / "out")]
    assert cli.main([*options, "--policy", "straight-line"]) == 1
    out = capsys.readouterr().out
    assert "COLLISION" in out
    assert "ball" in out
    options[-1] += "-80"
    assert cli.main([*options, "--iterations", "80"]) == 0
    assert "GOAL" in capsys.readouterr().out
    options[-1] += "-ms"
    assert cli.main([*options, "--time-budget", "0.02", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)["flights"][0]
    assert record["planning_ms"]["p50"] > 15.0
    assert record["scenario"]["obstacles"] == load_scenario(scenario_file).obstacles.tolist()


def test_vehicle_seed_and_obstacles_reach_the_environment(tmp_path, capsys):
    records = []
    for number, options in enumerate((["--seed", "1"], ["--seed", "2"], ["--seed", "1", "--vehicle", "physical"])):
        mission = ["--mission", "water-to-air", "--obstacles", "7", "--out", str(tmp_path / str(number))]
        cli.main(["fly", *mission, "--json", "--no-figures", *options])
        records.append(json.loads(capsys.readouterr().out)["flights"][0])
    assert all(len(record["scenario"]["obstacles"]) == 7 for record in records)
    assert records[0]["scenario"] != records[1]["scenario"]
    assert records[0]["scenario"] == records[2]["scenario"]
    assert records[0]["states"] != records[2]["states"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--seed", "-1"], "--seed must not be negative, got -1"),
        (["--iterations", "5", "--time-budget", "0.1"], "--iterations and --time-budget exclude each other"),
        (["--policy", "straight-line", "--iterations", "5"], "are options of --policy clrrt"),
        (["--policy", "clrt"], "no policy 'clrt' (did you mean 'clrrt'?): known are clrrt,"),
        (["--iterations", "0"], "iterations must be a whole number of at least 1, got 0"),
        (["--time-budget", "-1"], "time_budget must be positive (s), got -1.0"),
        (["--obstacles", "100000000"], "--obstacles must be at most 1000, got 100000000"),
        (["--obstacles", "-2"], "num_obstacles must be a whole number, not negative, got -2"),
        (["--scenario", "no-such-file.json"], "no-such-file.json"),
        (["--scenario", "x.json", "--mission", "air-to-water"], "--scenario excludes --mission and --obstacles"),
    ],
)
def test_bad_input_gives_2_and_one_line(options, message, tmp_path, capsys):
    assert cli.main(["fly", "--out", str(tmp_path / "new"), *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = [line for line in err.splitlines() if not line.startswith("hydrone: compiling ")]
    assert line.startswith("hydrone: error: ")
    assert message in line
    assert not (tmp_path / "new").exists()


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    """Files that are not what they should be, by name."""
    folder = tmp_path_factory.mktemp("odd")
    flat = {"format": "hydrone_gym scenario", "version": 1, "name": "", "start": [0, 0, 5, 0], "goal": [1, 1, 5]}
    flight = {"format": "hydrone_gym flights", "version": 1, "policy": "clrrt", "seed": 0, "vehicle": "paper"}
    record = {"name": "a", "outcome": "GOAL", "references": [[0, 0, 5, 0]], "states": [[0] * 12] * 2, "detected": []}
    texts = {
        "empty": "",
        "cut": '{"format": "hydrone_gym flights", "vers',
        "list": "[1, 2]",
        "number": "1",
        "null": "null",
        "deep": "[" * 100_000,
        "huge": "9" * 5_000_000,
        "no-obstacles": json.dumps({**flat, "obstacles": None}),
        "words": json.dumps({**flat, "obstacles": [["a", "b", "c", "d"]]}),
        "nan": json.dumps({**flat, "obstacles": [], "goal": [math.nan, 0, 5]}),
        "far": json.dumps({**flat, "obstacles": [], "goal": [1e300, 0, 5]}),
        "too-large": json.dumps({**flat, "obstacles": [], "goal": [10**400, 0, 5]}),
        "no-flights": json.dumps(flight),
        "flights-number": json.dumps({**flight, "flights": 3}),
        "flights-null": json.dumps({**flight, "flights": [None]}),
        "flights-empty": json.dumps({**flight, "flights": []}),
        "flights-dict": json.dumps({**flight, "flights": {"a": 1}}),
        "no-scenario": json.dumps({**flight, "flights": [record]}),
        "scenario-text": json.dumps({**flight, "flights": [{**record, "scenario": "x"}]}),
        "scenario-key": json.dumps({**flight, "flights": [{**record, "scenario": {"wind": 3}}]}),
        "seed-text": json.dumps({**flight, "seed": "x", "flights": [{**record, "scenario": {}}]}),
        "vehicle-list": json.dumps({**flight, "vehicle": [], "flights": [{**record, "scenario": {}}]}),
        "outcome-list": json.dumps({**flight, "flights": [{**record, "outcome": []}]}),
        "states-ragged": json.dumps({**flight, "flights": [{**record, "states": [[1], [1, 2]]}]}),
        "states-huge": json.dumps({**flight, "flights": [{**record, "states": [[10**400] * 12] * 2}]}),
        "states-text": json.dumps({**flight, "flights": [{**record, "states": "abc"}]}),
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    (folder / "noise").write_bytes(bytes(range(256)) * 40)
    (folder / "latin").write_bytes('{"format": "é"}'.encode("latin-1"))
    (folder / "folder").mkdir()
    return folder


ODD = ["empty", "cut", "list", "number", "null", "deep", "huge", "noise", "latin", "folder", "missing"]
SCENARIOS = ["no-obstacles", "words", "nan", "far", "too-large"]
FLIGHTS = ["no-flights", "flights-number", "flights-null", "flights-empty", "flights-dict", "no-scenario"]
FLIGHTS += ["scenario-text", "scenario-key", "seed-text", "vehicle-list", "outcome-list"]
FLIGHTS += ["states-ragged", "states-huge", "states-text"]
WRONG = [
    *(["fly", "--scenario", name] for name in ODD + SCENARIOS),
    *(["replay", name] for name in ODD + FLIGHTS),
    *([command, *options] for command in ("fly", "replay") for options in (
        ["--seed", "-1"],
        ["--seed", "-" + "9" * 30],
        ["--obstacles", "-1"],
        ["--obstacles", "9" * 30],
        ["--iterations", "-1"],
        ["--iterations", "9" * 30],
        ["--time-budget", "nan"],
        ["--time-budget", "inf"],
        ["--time-budget", "0"],
        ["--policy", ""],
        ["--policy", "="],
        ["--policy", ":"],
        ["--policy", "a:b"],
        ["--policy", "a.py:b"],
        ["--policy", "..:x"],
        ["--policy", "os:sep"],
        ["--policy", "os:getcwd"],
        ["--policy", "+shield"],
        ["--policy", "clrrt+"],
        ["--policy", "clrrt\n"],
        ["--policy", "."],
        ["--policy", "x" * 5000],
        ["--policy", "\0:a"],
        ["--mission", ""],
        ["--mission", "air-to-watr"],
        ["--mission", "\0"],
        ["--scenario", "\0"],
        ["--scenario", "x" * 5000],
        ["--out", "\0"],
        ["--out", "x" * 5000],
    )),
]  # fmt: skip


@pytest.mark.parametrize("arguments", WRONG, ids=lambda arguments: " ".join(arguments)[:60].encode("unicode_escape"))
def test_whatever_is_wrong_is_told_in_a_line(arguments, odd, monkeypatch, capsys):
    monkeypatch.chdir(odd)
    before = set(odd.iterdir())
    monkeypatch.setattr("hydrone_gym.cli.fly.fly", lambda *given, **options: pytest.fail("flown in vain"))
    cheap = [] if {"--iterations", "--time-budget", "--scenario"} & set(arguments) else ["--policy", "straight-line"]
    cheap = [] if "--policy" in arguments or (arguments[0] == "replay" and arguments[1][0] != "-") else cheap
    assert cli.main([*arguments, *cheap]) == 2
    out, err = capsys.readouterr()
    (line,) = [line for line in err.splitlines() if not line.startswith("hydrone: compiling ")]
    assert not out
    assert line.startswith("hydrone: error: ")
    assert set(odd.iterdir()) == before


def test_a_folder_holds_one_run(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = [*EMPTY, "--mission", "air-to-water"]
    assert cli.main([*options, "--out", "one"]) == cli.main([*options, "--out", "one"]) == 0  # the same run again
    capsys.readouterr()
    content = (tmp_path / "one" / "flight.json").read_bytes()
    assert cli.main([*options, "--out", "one", "--seed", "5"]) == 2
    assert capsys.readouterr().err == (
        "hydrone: error: one: holds another run (seed was 0, is 5): choose another folder with --out\n"
    )
    assert (tmp_path / "one" / "flight.json").read_bytes() == content
    for more in ([], ["--seed", "5"], ["--policy", "line=planners:StraightLine.for_env"]):
        assert cli.main([*options, *more]) == 0
    assert cli.main(EMPTY) == 0
    assert sorted(path.name for path in (tmp_path / "flights").iterdir()) == [
        "air-to-water-line=planners-StraightLine.for_env-seed-0",
        "air-to-water-straight-line-seed-0",
        "air-to-water-straight-line-seed-5",
        "straight-line-seed-0",
    ]


def test_titles_name_policy_and_seed(tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(
        "hydrone_gym.evaluation.flight_figures.save_figure",
        lambda figure, path, **look: titles.extend(text.get_text() for text in figure.texts) or [],
    )
    options = ["--mission", "random", "--policy", "straight-line", "--obstacles", "0", "--seed", "3"]
    assert cli.main(["fly", *options, "--out", str(tmp_path)]) == 0
    assert [title[:30] for title in titles] == ["Random, straight-line, seed 3:"] * 3


def test_ctrl_c_gives_130_and_a_line(tmp_path, capsys, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("hydrone_gym.cli.fly.fly", interrupted)
    assert cli.main([*EMPTY, "--out", str(tmp_path)]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "hydrone: interrupted; the same command begins again"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["air-to-water-straight-line-seed-0-path.pdf", "flight.json"])
def test_a_full_disk_is_told_with_the_file(name, tmp_path, capsys, monkeypatch):
    replace = os.replace

    def full(source, target):
        if os.path.basename(target) == name:  # kernels that are compiled meanwhile are stored under text
            raise OSError(28, "No space left on device")
        replace(source, target)

    monkeypatch.setattr("os.replace", full)
    options = ["--policy", "straight-line", "--obstacles", "0", "--mission", "air-to-water", "--out", str(tmp_path)]
    assert cli.main(["fly", *options]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert error == f"hydrone: error: [Errno 28] No space left on device: '{tmp_path / name}'"
    assert not [path.name for path in tmp_path.iterdir() if path.name == name or path.name.startswith(".")]


def test_a_scenario_file_that_is_none_gives_2(tmp_path, capsys):
    path = tmp_path / "broken.json"
    path.write_text("{")
    assert cli.main(["fly", "--scenario", str(path)]) == 2
    assert "not complete JSON" in capsys.readouterr().err


def test_an_output_folder_that_cannot_be_made_gives_2(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert cli.main([*EMPTY, "--out", str(tmp_path / "file")]) == 2
    assert "hydrone: error: " in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["fly", "--seed", "three"], ["fly", "--no-such-option"], ["swim"], []])
def test_what_the_parser_refuses_gives_2(arguments, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    assert stop.value.code == 2


def test_the_installed_command(tmp_path):
    program = "import sys; from hydrone_gym.cli import main; sys.exit(main())"
    shown = subprocess.run(
        [sys.executable, "-c", program, "fly", "--help"], capture_output=True, text=True, timeout=120, check=False
    )
    assert shown.returncode == 0
    for option in (
        "--mission",
        "--seed",
        "--obstacles",
        "--policy",
        "--time-budget",
        "--vehicle",
        "--out",
        "--json",
    ):
        assert option in shown.stdout
    failed = subprocess.run(
        [sys.executable, "-c", program, "fly", "--seed", "-1"], capture_output=True, text=True, timeout=120, check=False
    )
    assert failed.returncode == 2
    assert "Traceback" not in failed.stderr


def test_a_reader_that_leaves_early_gets_no_traceback(tmp_path):
    program = "import sys; from hydrone_gym.cli import main; sys.exit(main())"
    arguments = [sys.executable, "-c", program, *EMPTY, "--json", "--out", str(tmp_path)]
    reads, writes = os.pipe()
    os.close(reads)
    with started(arguments, stdout=writes, stderr=subprocess.PIPE, text=True) as process:
        os.close(writes)
        assert "Traceback" not in finish(process)[1]
        assert process.returncode == 1
