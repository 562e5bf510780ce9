"""Compiled kernels are cached under the source they were made from."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from hydrone_gym import _jit

CODE = "import hydrone_gym._jit as jit; print(jit._fingerprint('hydrone_gym.simulation.advance'))"


def fingerprint_in(root):
    """The fingerprint of the outermost kernel in a copy of the project."""
    shown = subprocess.run([sys.executable, "-c", CODE], cwd=root, capture_output=True, text=True, check=True)
    return shown.stdout.strip()


@pytest.fixture
def copy(tmp_path):
    here = Path(_jit.__file__).parent
    shutil.copytree(here, tmp_path / "hydrone_gym", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def test_editing_an_inlined_function_elsewhere_changes_the_cache(copy):
    """The stock cache would go on with the old drag: the edited file is not the kernel's own."""
    before = fingerprint_in(copy)
    assert before == fingerprint_in(copy)
    path = copy / "hydrone_gym" / "physics" / "dynamics.py"
    path.write_text(path.read_text().replace("2.0 * rate", "2.1 * rate"))
    assert fingerprint_in(copy) != before


def test_editing_a_module_that_is_imported_whole_changes_the_cache(copy):
    """`from hydrone_gym.control import paper` names a module, not something in one."""
    before = fingerprint_in(copy)
    path = copy / "hydrone_gym" / "control" / "paper.py"
    path.write_text(path.read_text() + "\n# a remark\n")
    assert fingerprint_in(copy) != before


def test_editing_what_a_kernel_does_not_use_keeps_the_cache(copy):
    before = fingerprint_in(copy)
    path = copy / "hydrone_gym" / "envs" / "reward.py"
    path.write_text(path.read_text() + "\n# a remark\n")
    assert fingerprint_in(copy) == before


def test_without_a_writable_directory_kernels_still_compile(monkeypatch):
    monkeypatch.setattr(_jit, "cache_root", lambda: None)

    @_jit.kernel
    def double(value):
        return 2.0 * value

    assert double(1.5) == 3.0
