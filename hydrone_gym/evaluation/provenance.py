"""What a figure means nothing without: versions, commit and machine."""

import hashlib
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("hydrone-gym", "numpy", "numba", "scipy", "gymnasium", "joblib")
_SOURCE = Path(__file__).resolve().parent
_ROOT = _SOURCE.parent.parent
_PARTS = ("hydrone_gym", "planners", "agents")
_KINDS = (".py", ".npz", ".yaml")  # code, and the weights of the agents


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
    """Return the commit of the sources, with "+" when they differ from it; None outside a checkout of this project."""

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(_SOURCE), *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()

    try:
        git("ls-files", "--error-unmatch", "__init__.py")  # an installed copy may lie in somebody else's repository
        changes = git("status", "--porcelain", "--untracked-files=no", "--", *(f":/{part}" for part in _PARTS))
        return git("rev-parse", "--short=12", "HEAD") + "+" * bool(changes)
    except (OSError, subprocess.CalledProcessError):
        return None


def sources() -> str:
    """Return a hash of the code and the weights of this project, as they lie on the disk now."""
    files = sorted(path for part in _PARTS for path in (_ROOT / part).rglob("*") if path.suffix in _KINDS)
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.relative_to(_ROOT).as_posix().encode() + path.read_bytes())
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
