"""What a figure means nothing without: versions, commit and machine."""

import hashlib
import platform
import subprocess
import time
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("hydrone-gym", "numpy", "numba", "scipy", "gymnasium", "joblib")
PARTS = ("hydrone_gym", "planners", "agents")  # the packages of this project
CODE = (".py", ".npz", ".yaml")  # code, and the weights of the agents
_SOURCE = Path(__file__).resolve().parent
_ROOT = _SOURCE.parent.parent
BUILT = _SOURCE / "commit.txt"  # written into what is built to be installed, see hatch_build.py


def made_with(packages: tuple[str, ...] = PACKAGES) -> dict[str, Any]:
    """Return versions, commit, machine and date, as plain data: what a result is recorded with."""
    return {
        "versions": versions(packages),
        "commit": commit(),
        "machine": machine(),
        "date": time.strftime("%Y-%m-%d"),
    }


def versions(packages: tuple[str, ...] = PACKAGES) -> dict[str, str]:
    """Return the versions of Python and of some packages, "absent" for those that are not installed."""
    found = {"python": platform.python_version()}
    for package in packages:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "absent"
    return found


def commit() -> str | None:
    """Return the commit of the sources, with "+" when they differ from it: the checkout's, or that of the build.

    None where neither is known, as in sources that were copied by hand.
    """

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(_SOURCE), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", "__init__.py")  # an installed copy may lie in somebody else's repository
        changes = git("status", "--porcelain", "--untracked-files=no", "--", *(f":/{part}" for part in PARTS))
        return git("rev-parse", "--short=12", "HEAD") + "+" * bool(changes)
    except (OSError, subprocess.CalledProcessError):
        return BUILT.read_text(encoding="utf-8").strip() if BUILT.is_file() else None


def sources() -> str:
    """Return a hash of the code and the weights of this project, as they lie on the disk now."""
    files = (path for part in PARTS for path in (_ROOT / part).rglob("*") if path.suffix in CODE)
    return hash_of({path.relative_to(_ROOT).as_posix(): path for path in files})


def hash_of(files: Mapping[str, Path]) -> str:
    """Return a hash of files and of the names they go by; OSError for one that cannot be read."""
    digest = hashlib.sha256()
    for name, path in sorted(files.items()):
        digest.update(f"{name}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def machine() -> dict[str, Any]:
    """Return processor, cores this process may use, and system."""
    import joblib

    try:
        named = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("model name")[2].partition("\n")[0]
    except OSError:
        named = ""
    processor = named.strip("\t: ") or platform.processor() or platform.machine()
    return {"processor": processor, "cores": joblib.cpu_count(), "system": f"{platform.system()} {platform.machine()}"}
