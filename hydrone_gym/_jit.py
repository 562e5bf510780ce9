"""The one place that knows how Numba is told to compile.

Every kernel of the project is made here, so that all of them share one error model, one floating-point mode and one
cache. Three rules hold everywhere and are the reason for this file:

* no ``fastmath``: results must be equal bit for bit between one row, many rows, and a planner's tree edge;
* the NumPy error model: a division by zero gives ``inf`` instead of a branch, which keeps loops over lanes vectorised;
* the cache is keyed by the text of *all* kernel sources. Numba's stock cache looks only at the file of the outermost
  function and goes stale when a function it inlines is edited in another file.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np

_PACKAGES = ("hydrone_gym", "planners")
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False, "boundscheck": False}


def _fingerprint() -> str:
    """Hash of every kernel source, the compiler, and NumPy: the name of the cache directory."""
    root = Path(__file__).resolve().parent.parent
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    for package in _PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            text = path.read_bytes()
            if b"_jit import" in text:
                digest.update(path.relative_to(root).as_posix().encode())
                digest.update(text)
    return digest.hexdigest()[:16]


def _cache_directory() -> str | None:
    """A writable directory for compiled kernels, or None when there is none (then nothing is cached)."""
    base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hydrone_gym"
    for candidate in (base, Path(tempfile.gettempdir()) / f"hydrone_gym-{os.getuid() if hasattr(os, 'getuid') else 0}"):
        directory = candidate / _fingerprint()
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(directory, os.W_OK):
            return str(directory)
    return None


CACHE_DIRECTORY = _cache_directory()


def kernel(function: Callable) -> Callable:
    """Compile an entry point: a function that Python calls, cached on disk."""
    dispatcher = numba.njit(**_OPTIONS)(function)
    if CACHE_DIRECTORY is not None:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = CACHE_DIRECTORY
        try:
            dispatcher.enable_caching()
        finally:
            numba.config.CACHE_DIR = before
    return dispatcher


def inlined(function: Callable) -> Callable:
    """Compile a building block that LLVM must inline into every caller.

    Without forced inlining a loop over lanes is compiled to one scalar call a lane, three times slower.
    """
    return numba.njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)


def routine(function: Callable) -> Callable:
    """Compile a large function that other kernels call: one copy of its code, not inlined, not cached by itself."""
    return numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)
