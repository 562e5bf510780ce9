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
    assert setup.strip().endswith(".venv/bin/hydrone fly")
    assert tests.strip().endswith(".venv/bin/pytest")
    picture = re.search(r"`hydrone (fly [^`]*--seed \d+)`", README)
    assert picture is not None
    assert cli.main([*shlex.split(picture[1]), "--no-figures", "--out", str(tmp_path)]) == 0
    for option in re.findall(r"`(--[a-z-]+)", README.split("lists the")[1].split("exit code")[0]):
        with pytest.raises(SystemExit):
            cli.main(["fly", "--help"])
        assert option in capsys.readouterr().out
