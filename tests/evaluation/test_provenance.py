"""What a result was made with: the commit of a checkout, or of an installed copy, noted as it was built."""

import os
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

from hydrone_gym.evaluation import made_with, provenance

ROOT = Path(__file__).parents[2]


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A small repository with the file that tells its commit, and the hook that is run when it is built."""
    folder = tmp_path / "checkout"
    for name in ("hatch_build.py", "hydrone_gym/evaluation/provenance.py", "hydrone_gym/evaluation/__init__.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes((ROOT / name).read_bytes())
    for name in ("GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"):
        monkeypatch.delenv(name, raising=False)
    who = ["-c", "user.name=n", "-c", "user.email=e"]
    for command in (["init", "-q"], ["add", "."], [*who, "commit", "-q", "-m", "first"]):
        subprocess.run(["git", "-C", folder, *command], timeout=60, check=True)
    stub = ModuleType("interface")
    stub.BuildHookInterface = SimpleNamespace
    monkeypatch.setitem(sys.modules, "hatchling.builders.hooks.plugin.interface", stub)
    return folder


def commit_of(folder):
    return runpy.run_path(str(folder / "hydrone_gym" / "evaluation" / "provenance.py"))["commit"]()


def built(folder, version="standard"):
    """Files that the hook adds to a build: path to content."""
    hook, data = runpy.run_path(str(folder / "hatch_build.py"))["CommitHook"](root=str(folder)), {"force_include": {}}
    hook.initialize(version, data)
    return {path: Path(file).read_text() for file, path in data["force_include"].items()}


def test_a_build_notes_the_commit_and_leaves_the_checkout_clean(checkout, tmp_path):
    head = subprocess.run(
        ["git", "-C", checkout, "rev-parse", "HEAD"], capture_output=True, text=True, timeout=60, check=True
    )
    commit = commit_of(checkout)
    assert commit == head.stdout[:12]
    ((path, text),) = built(checkout).items()
    assert (path, text) == ("hydrone_gym/evaluation/commit.txt", f"{commit}\n")
    assert built(checkout, "editable") == {}
    status = ["git", "-C", checkout, "status", "--porcelain"]
    assert subprocess.run(status, capture_output=True, timeout=60, check=True).stdout == b""
    installed = tmp_path / "site"  # outside the repository, as pip leaves it
    os.rename(checkout, installed)
    shutil.rmtree(installed / ".git")
    assert commit_of(installed) is None
    (installed / path).write_text(text)
    assert commit_of(installed) == commit
    assert built(installed) == {}  # a wheel of a source distribution holds the file already


def test_an_edited_checkout_is_marked(checkout):
    with (checkout / "hydrone_gym" / "evaluation" / "__init__.py").open("a") as stream:
        stream.write("# edited\n")
    assert commit_of(checkout).endswith("+")


def test_what_a_result_is_recorded_with():
    made = made_with(("numpy", "no-such-package"))
    assert made["versions"].keys() == {"python", "numpy", "no-such-package"}
    assert made["versions"]["no-such-package"] == "absent"
    assert made["commit"] == provenance.commit()
    assert made["machine"]["cores"] >= 1
    assert made.keys() == {"versions", "commit", "machine", "date"}
