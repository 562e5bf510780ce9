"""The leaderboard: a stranger's policy, written from its page alone, is ranked, and the page says what was measured."""

import json
import re
import shlex
import shutil
import sys

import pytest

from benchmarks import leaderboard
from benchmarks.timing import RESULTS
from hydrone_gym.evaluation import evaluate
from hydrone_gym.evaluation.bounds import load_bounds
from tests.processes import completed

PAGE = leaderboard.PAGE.read_text(encoding="utf-8")


def block(begins):
    """The only block of code on the page that begins so."""
    (text,) = re.findall(rf"^```\w*\n({begins}.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    return text


def test_a_policy_written_from_the_page_is_ranked_by_its_command(tmp_path):
    (tmp_path / "mine.py").write_text(block("import numpy"), encoding="utf-8")
    command, *words = shlex.split(block("hydrone evaluate"))
    assert command == "hydrone"
    done = completed([sys.executable, "-m", "hydrone_gym", *words, "--worlds", "4"], cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    cells = [
        line.split()[:2]
        for line in done.stdout.splitlines()
        if line[:1].isalpha() and "] " in line and line[:6] != "policy"
    ]
    ranked = {name: float(score) for name, score in cells}
    assert ranked.keys() == {"clrrt", "ppo-shield", "straight-line", "mine"}
    assert list(ranked.values()) == sorted(ranked.values(), reverse=True)
    assert 0.2 < ranked["mine"] < ranked["clrrt"] < 1.0
    summary = json.loads((tmp_path / "evaluations" / "paper-20-v1" / "summary.json").read_text())
    (mine,) = [entry for entry in summary["missions"][-1]["policies"] if entry["policy"] == "mine"]
    assert mine["rank"] == 1 + list(ranked).index("mine")
    assert mine["score"]["value"] == pytest.approx(ranked["mine"], abs=5e-4)


def test_difficulty_is_what_the_planners_lack(tmp_path):
    records = evaluate("paper-20", leaderboard.PLANNERS, worlds=1, out=tmp_path)
    bounds = load_bounds("paper-20-v1", "paper")
    found = leaderboard.difficulties(tmp_path)["paper-20-v1"]
    for mission in ("air-to-water", "water-to-air"):
        best = bounds[mission, 0].free.time
        flown = [record for record in records if record.mission == mission]
        scores = [record.success * best / max(best, record.time) for record in flown]
        assert len(scores) == 4
        assert found[mission][0] == pytest.approx(1.0 - sum(scores) / 4)
    evaluate("paper-20", "straight-line", worlds=1, out=tmp_path / "one")
    with pytest.raises(ValueError, match="measured by straight-line, "):
        leaderboard.difficulties(tmp_path / "one")


def test_difficulty_sorts_worlds_into_quarters_of_each_mission():
    quarters = leaderboard.quarters_of({"a": [0.3, 0.0, 0.2, 0.1], "b": [0.0, 0.1, 0.4, 0.3, 0.2, 0.5, 0.6, 0.7]})
    assert [quarters["a", k] for k in range(4)] == [3, 0, 2, 1]
    assert [quarters["b", k] for k in range(8)] == [0, 0, 2, 1, 1, 2, 3, 3]


@pytest.fixture
def board(tmp_path):
    """A copy of results and page."""
    for name in ("leaderboard.json", "difficulty.json"):
        shutil.copy(RESULTS / name, tmp_path / name)
    shutil.copy(leaderboard.PAGE, tmp_path / "page.md")
    return ["--results", str(tmp_path), "--page", str(tmp_path / "page.md")]


def test_the_page_is_what_its_command_writes(board, tmp_path):
    assert leaderboard.main(board) == 0
    assert (tmp_path / "page.md").read_text(encoding="utf-8") == PAGE
    assert (tmp_path / "leaderboard.json").read_text() == (RESULTS / "leaderboard.json").read_text()
    for scores in re.findall(r"(?:^\| \d.*\n)+", PAGE, re.MULTILINE):
        told = [float(line.split("|")[2].split()[0]) for line in scores.splitlines()]
        assert told == sorted(told, reverse=True)


def test_a_folder_is_entered_when_it_has_flown_every_world_that_has_a_bound(board, tmp_path, capsys):
    few = tmp_path / "few"
    evaluate("paper-20", "straight-line", worlds=2, out=few)
    assert leaderboard.main([str(few), *board]) == 2
    assert "of paper-20-v1 must fly the 200 worlds that have a bound, flew 4" in capsys.readouterr().err
    evaluate("paper-20", {"stranger": "straight-line"}, worlds=100, out=tmp_path / "all")
    assert leaderboard.main([str(tmp_path / "all"), *board]) == 0
    entered = json.loads((tmp_path / "leaderboard.json").read_text())["paper-20-v1, paper"]
    shipped = entered["straight-line"]
    same = ("score", "success", "collisions", "rough_crossings", "others", "time", "quarters")
    assert [entered["stranger"][name] for name in same] == [shipped[name] for name in same]
    assert "`stranger`" in (tmp_path / "page.md").read_text(encoding="utf-8")


def test_harder_worlds_have_lower_scores():
    """Also those of agents, by whom it was not measured: the hardest quarter against the easiest."""
    for name, board in json.loads((RESULTS / "leaderboard.json").read_text()).items():
        easiest, *_, hardest = zip(*(board[agent]["quarters"] for agent in ("ppo", "ppo-shield", "sac")), strict=True)
        assert sum(hardest) < sum(easiest), name
