"""The command line: what it prints, what it writes, and how it ends."""

import json
import math
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym import cli
from hydrone_gym.evaluation import fly
from hydrone_gym.world.scenario import Scenario, load_scenario, save_scenario
from planners import CLRRT

EMPTY = ["fly", "--policy", "straight-line", "--obstacles", "0", "--no-figures"]


def reject(constant):
    raise AssertionError(f"{constant} is not JSON")


def test_flies_both_experiments_by_default(tmp_path, capsys):
    assert cli.main([*EMPTY, "--out", str(tmp_path)]) == 0
    out = capsys.readouterr().out
    assert "experiment-1" in out
    assert "experiment-2" in out
    for label in ("outcome", "crossing at", "lateral speed", "tilt", "clearance", "length", "energy", "p50", "p99"):
        assert label in out
    assert out.count("GOAL") == 2
    assert out.strip().splitlines()[-1] == str(tmp_path / "flight.json")


def test_draws_every_figure_and_agrees_with_fly(tmp_path, capsys):
    assert cli.main(["fly", "--experiment", "1", "--seed", "4", "--json", "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    document = json.loads(text, parse_constant=reject)
    assert json.loads((tmp_path / "flight.json").read_text()) == document
    (record,) = document["flights"]
    env = gym.make("HydroneGym/AirToWater-v0")
    flight = fly(env, CLRRT.for_env(env, seed=4), seed=4)
    assert record["time"] == flight.time
    np.testing.assert_array_equal(record["states"], flight.states)
    assert record["scenario"]["obstacles"] == flight.scenario.obstacles.tolist()
    names = {f"experiment-1-{kind}.{suffix}" for kind in FIGURES for suffix in ("png", "pdf")}
    assert {file.name for file in tmp_path.iterdir()} == {"flight.json", *names}
    assert sorted(record["figures"]) == sorted(str(tmp_path / name) for name in names)
    assert all((tmp_path / name).stat().st_size > 5000 for name in names)


def test_figures_for_a_column_without_titles(tmp_path):
    options = ["fly", "--experiment", "1", "--policy", "straight-line", "--obstacles", "0", "--out", str(tmp_path)]
    assert cli.main([*options, "--width", "column", "--no-title"]) == 0
    for name in ("path", "position", "attitude"):
        content = (tmp_path / f"experiment-1-{name}.pdf").read_bytes()
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
        options = ["fly", "--policy", policy, "--obstacles", "0", "--experiment", "1", "--no-figures", "--json"]
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
    assert cli.main([*options, "--iterations", "80"]) == 0
    assert "GOAL" in capsys.readouterr().out
    assert cli.main([*options, "--time-budget", "0.02", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)["flights"][0]
    assert record["planning_ms"]["p50"] > 15.0
    assert record["scenario"]["obstacles"] == load_scenario(scenario_file).obstacles.tolist()


def test_vehicle_seed_and_obstacles_reach_the_environment(tmp_path, capsys):
    records = []
    for options in (["--seed", "1"], ["--seed", "2"], ["--seed", "1", "--vehicle", "physical"]):
        cli.main(
            ["fly", "--experiment", "2", "--obstacles", "7", "--json", "--no-figures", "--out", str(tmp_path), *options]
        )
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
        (["--policy", "clrt"], "no policy 'clrt': known are clrrt,"),
        (["--iterations", "0"], "iterations must be a whole number of at least 1, got 0"),
        (["--time-budget", "-1"], "time_budget must be positive (s), got -1.0"),
        (["--obstacles", "100000000"], "--obstacles must be at most 1000, got 100000000"),
        (["--obstacles", "-2"], "num_obstacles must be a whole number, not negative, got -2"),
        (["--scenario", "no-such-file.json"], "no-such-file.json"),
        (["--scenario", "x.json", "--experiment", "1"], "--scenario excludes --experiment and --obstacles"),
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


def test_a_scenario_file_that_is_none_gives_2(tmp_path, capsys):
    path = tmp_path / "broken.json"
    path.write_text("{")
    assert cli.main(["fly", "--scenario", str(path)]) == 2
    assert "not complete JSON" in capsys.readouterr().err


def test_an_output_folder_that_cannot_be_made_gives_2(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert cli.main([*EMPTY, "--out", str(tmp_path / "file")]) == 2
    assert "hydrone: error: " in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["fly", "--experiment", "3"], ["fly", "--no-such-option"], ["swim"], []])
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
        "--experiment",
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
    with subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        process.stdout.close()
        assert "Traceback" not in process.stderr.read()
        assert process.wait(timeout=120) == 1
