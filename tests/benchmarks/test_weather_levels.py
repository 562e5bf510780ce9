"""Where policies lose five points: what is flown under which law, and what the table makes of it."""

import json

import matplotlib.pyplot as plt
import pytest

from benchmarks import weather_levels
from benchmarks.weather_levels import Arguments, change, first_loss, flown, sheet
from hydrone_gym.evaluation import MISSIONS, Suite, evaluate
from hydrone_gym.evaluation.statistics import Estimate, paired_success


def told(value, half):
    return Estimate(value, value - half, value + half)


@pytest.fixture
def small(tmp_path, monkeypatch):
    """Two entrants of which one flies under both laws."""
    monkeypatch.setattr(weather_levels, "PICTURED", ("straight-line, robust", "potential-field, robust"))
    monkeypatch.setattr(weather_levels, "FAST", {"paper": ("straight-line",), "robust": ("straight-line",)})
    monkeypatch.setattr(weather_levels, "SLOW", {"paper": (), "robust": ("potential-field",)})
    return Arguments(worlds=4, slow_worlds=2, levels=(0, 3), runs=tmp_path / "runs", out=tmp_path)


def test_entrants_fly_the_same_worlds_in_every_weather_under_their_laws(small):
    records = flown(small)
    counts = {}
    for record in records:
        counts.setdefault((record.policy, record.suite), []).append((record.mission, record.world))
    assert counts == {
        (f"{policy}, {law} law", f"weather-{level}"): [(m, w) for m in MISSIONS for w in range(worlds)]
        for policy, law, worlds in [
            ("straight-line", "paper", 4),
            ("straight-line", "robust", 4),
            ("potential-field", "robust", 2),
        ]
        for level in (0, 3)
    }
    suite = Suite.held_out(4, {"weather": 3, "controller": "robust"})
    again = [(r.outcome, r.time) for r in evaluate(suite, "straight-line")]
    name = "straight-line, robust law"
    assert [(r.outcome, r.time) for r in records if (r.policy, r.suite) == (name, "weather-3")] == again
    assert again != [(r.outcome, r.time) for r in records if r.policy == "straight-line, paper law"][-12:]


def test_change_is_that_of_pairs(small):
    records = flown(small)
    name = "straight-line, paper law"
    still, windy = ([r.success for r in records if (r.policy, r.suite) == (name, f"weather-{k}")] for k in (0, 3))
    assert change(records, name, 3) == paired_success(windy, still).difference
    cells = {row[0]: row for row in sheet(records, (0, 3)).rows}
    assert cells[name][1].startswith(f"{100 * (sum(windy) - sum(still)) / 12:.1f} [")


def test_five_points_are_lost_at_the_first_level_that_loses_them():
    assert first_loss({1: told(-0.01, 0.01), 2: told(-0.049, 0.0), 3: told(-0.05, 0.0), 4: told(-0.9, 0.0)}) == "3"
    assert first_loss({1: told(-0.01, 0.01), 2: told(-0.04, 0.02), 3: told(-0.06, 0.02)}) == "3 (2 to none)"
    assert first_loss({1: told(0.01, 0.01), 2: told(-0.02, 0.01)}) == "none"


def test_the_command_prints_and_keeps_the_tables(small, capsys):
    given = ["--worlds", "4", "--slow-worlds", "2", "--levels", "0", "3"]
    given += ["--runs", str(small.runs), "--out", str(small.out), "--picture", str(small.out / "levels.png")]
    assert weather_levels.main(given) == 0
    assert plt.imread(small.out / "levels.png").std() > 0.05
    printed = capsys.readouterr().out
    kept = json.loads((small.out / "weather_levels.json").read_text())
    assert "| straight-line, robust law |" in printed
    assert "failures by level of weather" in printed
    assert set(kept["tables"]) <= set(printed.splitlines())


def test_levels_it_does_not_fly(capsys):
    assert weather_levels.main(["--levels", "1", "2"]) == 2
    assert "levels must be some of 0 to 5 and 0 itself, got (1, 2)" in capsys.readouterr().err
