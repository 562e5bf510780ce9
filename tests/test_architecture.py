"""The shape of the code: which way imports point, how long files are, and what an import costs."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("hydrone_gym", "planners", "agents")
MOST_LINES = 300


def test_imports_point_one_way(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    status = lint_imports(config_filename=str(ROOT / "pyproject.toml"), no_cache=True)
    assert status == EXIT_STATUS_SUCCESS, capsys.readouterr().out


def test_files_are_short():
    lengths = {
        path.relative_to(ROOT).as_posix(): len(path.read_text(encoding="utf-8").splitlines())
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
    }
    assert lengths, f"no Python file found under {ROOT}"
    too_long = {name: lines for name, lines in lengths.items() if lines > MOST_LINES}
    assert not too_long, f"files over {MOST_LINES} lines: {too_long}"


@pytest.mark.parametrize("package", PACKAGES)
def test_package_is_typed(package):
    assert (ROOT / package / "py.typed").is_file()


@pytest.mark.parametrize("package", ["hydrone_gym", "planners"])
def test_import_stays_light(package):
    """Torch and Stable-Baselines3 cost seconds, Matplotlib half of one: nobody who only steps an env pays for them."""
    program = f"import {package}, json, sys; print(json.dumps(sorted(sys.modules)))"
    # Without the user's start-up hooks, which may import anything.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONSTARTUP"}
    result = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120
    )
    assert result.returncode == 0, result.stderr
    loaded = set(json.loads(result.stdout.splitlines()[-1]))
    assert package in loaded
    heavy = loaded & {"torch", "stable_baselines3", "matplotlib"}
    assert not heavy, f"import {package} also imports {sorted(heavy)}"
