"""Compiled kernels are cached under the source they were made from."""

import importlib
import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from hydrone_gym import _jit

CODE = "import hydrone_gym._jit as jit; print(jit._fingerprint('hydrone_gym.simulation.advance'))"


def fingerprint_in(root):
    """The fingerprint of the outermost kernel in a copy of the project."""
    shown = subprocess.run(
        [sys.executable, "-c", CODE], cwd=root, capture_output=True, text=True, timeout=120, check=True
    )
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


KERNEL = """
from hydrone_gym._jit import kernel

@kernel
def triple(value):
    return 3.0 * value

assert triple(1.5) == 4.5
"""


@pytest.fixture
def run(tmp_path, monkeypatch, caplog):
    """Make and call a kernel as in a new process: returns how often it came from the cache, and what was told."""
    (tmp_path / "thrice.py").write_text(KERNEL)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))

    def run():
        caplog.clear()
        _jit.cache_root.cache_clear()
        _jit._tell.cache_clear()
        sys.modules.pop("thrice", None)
        hits = importlib.import_module("thrice").triple.stats.cache_hits
        return sum(hits.values()), [record.getMessage() for record in caplog.records]

    assert run() == (0, [])
    assert run() == (1, [])
    yield run
    sys.modules.pop("thrice", None)
    _jit.cache_root.cache_clear()


def stored(tmp_path, suffix):
    (path,) = (tmp_path / "cache").rglob(f"thrice.triple*.{suffix}")
    return path


@pytest.mark.parametrize(
    ("suffix", "damage"),
    [*[(suffix, damage) for suffix in ("nbi", "nbc") for damage in ("empty", "cut", "noise")], ("nbc", "a byte")],
)
def test_a_damaged_cache_is_made_anew(run, tmp_path, suffix, damage):
    path = stored(tmp_path, suffix)
    content = bytearray(path.read_bytes())
    content[-40] ^= 0x55
    path.write_bytes({"empty": b"", "cut": content[:-9], "noise": bytes(range(256)), "a byte": content}[damage])
    hits, (line,) = run()
    assert hits == 0
    assert line.startswith(f"hydrone_gym: kernels are compiled anew, their cache {tmp_path / 'cache'}")
    assert run() == (1, [])


def test_a_cache_folder_that_is_a_file_is_told(run, tmp_path):
    folder = stored(tmp_path, "nbi").parent
    shutil.rmtree(folder)
    folder.write_text("")
    hits, (line,) = run()
    assert hits == 0
    assert line.startswith("hydrone_gym: kernels cannot be cached below")


def test_a_full_disk_is_told(run, tmp_path, monkeypatch):
    def full(self, path):
        raise OSError(28, "No space left on device", path)

    stored(tmp_path, "nbi").unlink()
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile._open_for_write", full)
    cache = tmp_path / "cache" / "hydrone_gym"
    assert run() == (0, [f"hydrone_gym: kernels cannot be cached in {cache}: No space left on device"])


def test_what_is_told_is_one_line_on_stderr(tmp_path, monkeypatch):
    (tmp_path / "thrice.py").write_text(KERNEL)
    (tmp_path / f"hydrone_gym-{os.getuid()}").write_text("")
    for name, value in (("XDG_CACHE_HOME", "thrice.py"), ("TMPDIR", "")):
        monkeypatch.setenv(name, str(tmp_path / value))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    command = [sys.executable, "-c", "import thrice"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    (line,) = done.stderr.splitlines()
    assert line.startswith("hydrone_gym: kernels are not cached, each process compiles them anew: ")


def test_a_folder_for_all_is_used_only_if_nobody_else_can_write_it(run, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "thrice.py"))  # no folder can be made there
    assert run() == (0, [])
    assert run() == (1, [])
    shared, elsewhere = tmp_path / f"hydrone_gym-{os.getuid()}", tmp_path / "elsewhere"
    assert stat.S_IMODE(shared.stat().st_mode) == 0o700
    refused = "hydrone_gym: kernels are not cached, each process compiles them anew: {} must be a folder of yours"
    refused += " that nobody else may write"
    shared.chmod(0o770)
    assert run() == (0, [refused.format(shared)])
    shared.rename(elsewhere)
    elsewhere.chmod(0o700)
    shared.symlink_to(elsewhere)
    assert run() == (0, [refused.format(shared)])
    other = os.getuid() + 1
    elsewhere.rename(tmp_path / f"hydrone_gym-{other}")
    monkeypatch.setattr("os.getuid", lambda: other)
    assert run() == (0, [refused.format(tmp_path / f"hydrone_gym-{other}")])


def test_without_a_writable_directory_kernels_still_compile(monkeypatch):
    monkeypatch.setattr(_jit, "cache_root", lambda: None)

    @_jit.kernel
    def double(value):
        return 2.0 * value

    assert double(1.5) == 3.0
