"""`python -m benchmarks.generalisation`: its figures are those of single flights, its tables say what it measured."""

import json
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from agents import load_agent
from benchmarks import generalisation_table as table
from benchmarks.generalisation import FIRST, main
from benchmarks.results import sheets_of
from benchmarks.tables import BEGIN, END, put_into
from benchmarks.world_shapes import SHAPES
from hydrone_gym.evaluation import Suite, evaluate, fly
from hydrone_gym.evaluation.policies import find_policy
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.evaluation.summary import scores_of

ROOT = Path(__file__).resolve().parent.parent.parent
FLOWN = ("ppo", "straight-line", "straight-line-shield", "clrrt")


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """What a tiny run writes; the straight line fails in some worlds, and the shield must know the vehicle at hand."""
    out = tmp_path_factory.mktemp("results") / "new"
    flown = ["--policies", *FLOWN, "--shapes", "random missions", "short", "physical vehicle"]
    assert main(["--episodes", "6", "--yardstick-episodes", "2", *flown, "--out", str(out)]) == 0
    return json.loads((out / "generalisation.json").read_text(encoding="utf-8"))


def cell_of(record, shape, policy):
    (found,) = [c for c in record["measured"]["cells"] if (c["shape"], c["policy"]) == (shape, policy)]
    return found


def test_it_says_where_the_figures_come_from(record):
    assert record["command"].startswith("python -m benchmarks.generalisation --episodes 6 --yardstick-episodes 2")
    assert {"processor", "versions", "commit", "date"} <= record["machine"].keys()
    assert {"python", "numpy", "numba", "gymnasium"} <= record["machine"]["versions"].keys()
    assert record["measured"]["seed"] == FIRST
    assert record["measured"]["cpu_seconds"] > 0.0


def test_random_missions_are_those_of_the_evaluation(record):
    cell = cell_of(record, "random missions", "ppo")
    suite = Suite.drawn("HydroneGym/Mission-v0", range(FIRST, FIRST + 6))
    (score,) = scores_of(evaluate(suite, {"ppo": lambda env: load_agent("ppo")}))
    assert (cell["outcomes"], cell["success"]) == (score["outcomes"], score["success"])
    assert (cell["time"], cell["energy"]) == (score["time"], score["energy"])
    assert tuple(cell["interval"]) == score["interval"]


@pytest.mark.parametrize(
    ("shape", "policy", "worlds"),
    [
        ("short", "ppo", 6),
        ("short", "clrrt", 2),
        ("physical vehicle", "ppo", 6),
        ("physical vehicle", "straight-line", 6),
        ("physical vehicle", "straight-line-shield", 6),
    ],
)
def test_a_cell_is_the_single_flights_of_its_worlds(record, shape, policy, worlds):
    env = gym.make("HydroneGym/Mission-v0", **SHAPES[shape].options)
    source = find_policy(policy)
    flights = [fly(env, source.make(env, 0), scenario=SHAPES[shape].scenario(FIRST + k)) for k in range(worlds)]
    arrived = [flight for flight in flights if flight.outcome.name == "GOAL"]
    cell = cell_of(record, shape, policy)
    assert cell["episodes"] == sum(cell["outcomes"].values()) == worlds
    assert cell["outcomes"].get("GOAL", 0) == len(arrived)
    lost = {str(FIRST + k): f.outcome.name for k, f in enumerate(flights) if f.outcome.name != "GOAL"}
    assert cell["failures"] == lost
    assert lost or policy != "straight-line"
    assert cell["time"] == pytest.approx(np.mean([flight.time for flight in arrived]), abs=1e-9)
    assert cell["energy"] == pytest.approx(np.mean([flight.energy for flight in arrived]), rel=1e-9)


def test_the_tables_show_the_record(record):
    success, failures = sheets_of("generalisation", record["measured"])
    assert success.columns == failures.columns == ("worlds", "PPO", "straight-line", "straight line, shield", "CL-RRT")
    assert [row[0] for row in success.rows] == ["random missions", "short", "physical vehicle"]
    for row in success.rows:
        for shown, policy in zip(row[1:], FLOWN, strict=True):
            cell = cell_of(record, row[0], policy)
            low, high = (100.0 * end for end in cell["interval"])
            assert shown == f"{100 * cell['success']:.1f} [{low:.1f},\N{NO-BREAK SPACE}{high:.1f}]"
    assert success.notes[0].startswith("6 worlds a row; CL-RRT the first 2; seeds from 20,000,000 on.")


def made_up(shape, policy, arrived, **failures):
    group = SHAPES[shape].group
    episodes = arrived + sum(failures.values())
    return {
        "shape": shape,
        "group": group,
        "reference": SHAPES[shape].reference,
        "policy": policy,
        "episodes": episodes,
        "outcomes": {"GOAL": arrived, **failures},
        "success": arrived / episodes,
        "interval": list(wilson_interval(arrived, episodes)),
        "time": 9.0,
        "energy": 400.0,
    }


MADE_UP = {
    "seed": FIRST,
    "cpu_seconds": 90.0,
    "cells": [
        made_up("as in training", "ppo", 970, COLLISION=30),
        made_up("as in training", "mine", 500, TIMEOUT=500),
        made_up("random missions", "ppo", 1000),
        made_up("random missions", "mine", 1000),
        made_up("60 spheres", "ppo", 880, COLLISION=110, TIMEOUT=7, OUT_OF_BOUNDS=3),
        made_up("60 spheres", "mine", 700, TIMEOUT=300),
        made_up("short", "ppo", 990, COLLISION=10),
        made_up("short", "mine", 998, ROUGH_TRANSITION=1, DIVERGED=1),
    ],
}


def test_failures_are_counted_by_kind():
    rows = {row[0]: row[1:] for row in table.failure_sheet(MADE_UP).rows}
    assert rows["random missions"] == ("–", "–")
    assert rows["60 spheres"] == ("110 C, 3 B, 7 T", "300 T")
    assert rows["short"] == ("10 C", "1 R, 1 D")
    assert rows["all"] == ("150 C, 3 B, 7 T of 4,000", "1 R, 800 T, 1 D of 4,000")
    assert table.success_sheet(MADE_UP).notes == [
        "1,000 worlds a row; seeds from 20,000,000 on. Wilson intervals of 95 %. 1.5 minutes of one core."
    ]


def test_clear_changes_are_against_the_reference_of_each_shape():
    assert table.changes(MADE_UP) == [
        "- PPO: less often in 60 spheres (88.0 against 97.0), short (99.0 against 100.0)",
        "- mine: nowhere less often; more often in 60 spheres (70.0 against 50.0)",
    ]


def test_the_page_is_written_between_its_marks(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(f"# Words\n\n{BEGIN}old\n{END}\nMore words\n", encoding="utf-8")
    for _ in range(2):
        put_into(page, table.section(MADE_UP, "`the command`\n"))
        text = page.read_text(encoding="utf-8")
        assert text.startswith(f"# Words\n\n{BEGIN}\n### At the goal")
        assert text.endswith(f"`the command`\n\n{END}\nMore words\n")
        assert text.count("| 60 spheres | 110 C, 3 B, 7 T | 300 T |") == 1
        assert "old" not in text
    page.write_text(f"{END}{BEGIN}", encoding="utf-8")
    with pytest.raises(ValueError, match=r"page\.md must hold <!-- measured --> and <!-- end of what was measured -->"):
        put_into(page, "")


def test_the_figure_shows_each_share_that_did_not_arrive(tmp_path, monkeypatch):
    import matplotlib.pyplot as plt

    kept = []
    monkeypatch.setattr(plt, "close", kept.append)
    table.draw(MADE_UP, tmp_path / "figure.png")
    monkeypatch.undo()
    (axes,) = kept[0].axes
    (bars,) = axes.containers  # "mine" has no looks
    assert bars.get_label() == "PPO"
    assert bars.lines[0].get_xdata() == pytest.approx([3.0, 0.0, 12.0, 1.0])
    ends = np.array([segment[:, 0] for segment in bars.lines[2][0].get_segments()])
    intervals = [cell["interval"] for cell in MADE_UP["cells"] if cell["policy"] == "ppo"]
    assert ends == pytest.approx(np.array([[100 * (1 - high), 100 * (1 - low)] for low, high in intervals]))
    assert [label.get_text() for label in axes.get_yticklabels()] == list(table.by_shape(MADE_UP))
    assert (tmp_path / "figure.png").stat().st_size > 10_000
    plt.close(kept[0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--shapes", "61 spheres"], "no shape '61 spheres': known are 'as in training', 'random missions',"),
        (["--policies", "nobody"], "no policy 'nobody': known are clrrt,"),
        (["--policies", "ppo", "--shapes", "short", "--episodes", "0"], "episodes must be at least 1, got 0"),
    ],
)
def test_bad_options(capsys, arguments, message, tmp_path):
    assert main([*arguments, "--out", str(tmp_path)]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_page_names_every_shape():
    page = (ROOT / "docs" / "generalisation.md").read_text(encoding="utf-8")
    described = page.partition("## The worlds")[2].partition("## Results")[0]
    assert [name for name in SHAPES if name not in described.replace("2 m, 5 m", "2 m, sensing within 5 m")] == []
