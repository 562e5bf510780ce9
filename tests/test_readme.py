"""The README's code runs, and what it links to exists."""

import re
import shlex
from pathlib import Path

import pytest

import hydrone_gym.cli as cli

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


def test_python_blocks_run_in_order(capsys):
    code = blocks("python")
    assert len(code) == 5
    names = {}
    for block in code:
        exec(compile(block, "README.md", "exec"), names)
    shown = capsys.readouterr().out.splitlines()
    assert shown[0].startswith("RUNNING 0.5 ")
    assert shown[1].startswith("GOAL ")
    assert shown[2].startswith("GOAL ")
    assert names["mean_return"] > 0.0


def test_links_lead_somewhere():
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", README) if "://" not in target]
    assert len(targets) >= 5
    missing = [target for target in targets if not (ROOT / target).exists()]
    assert not missing


def test_the_commands_are_those_of_the_package(monkeypatch, tmp_path, capsys):
    setup, tests = blocks("bash")
    assert setup.strip().endswith(".venv/bin/hydrone evaluate --report comparison")
    assert tests.strip().endswith(".venv/bin/pytest")
    picture = re.search(r"`hydrone (fly [^`]*--seed \d+)`", README)
    assert picture is not None
    assert cli.main([*shlex.split(picture[1]), "--no-figures", "--out", str(tmp_path)]) == 0
    (listed,) = re.findall(r"^\| `hydrone fly` \|.*$", README, re.MULTILINE)
    with pytest.raises(SystemExit):
        cli.main(["fly", "--help"])
    shown = capsys.readouterr().out
    for option in re.findall(r"`(--[a-z-]+)", listed):
        assert option in shown
    for command in re.findall(r"^\| `hydrone ([a-z]+)` \|", README, re.MULTILINE):
        with pytest.raises(SystemExit) as stopped:
            cli.main([command, "--help"])
        assert stopped.value.code == 0
