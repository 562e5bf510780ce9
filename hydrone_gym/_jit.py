"""The one place that knows how Numba is told to compile.

Every kernel of the project is made here, so that all of them share one error model, one floating-point mode and one
cache. Three rules hold everywhere and are the reason for this file:

* no ``fastmath``: results must be equal bit for bit between one row, many rows, and a planner's tree edge;
* the NumPy error model: a division by zero gives ``inf`` instead of a branch, which keeps loops over lanes vectorised;
* the cache is keyed by the source of a kernel's module and of every module that one imports. Numba's stock cache looks
  only at the file of the outermost function and goes stale when a function it inlines is edited in another file.

A cache that cannot be used costs time, never a result: kernels are then compiled anew, and one line says why.

Kernels read and write what they work on through `hydrone_gym._memory`.
"""

import contextlib
import functools
import hashlib
import logging
import os
import pickle
import re
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
from numba.core import sigutils
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.ccallback import CFunc
from numba.extending import register_jitable

try:
    import fcntl
except ImportError:  # Windows: processes that start together compile the same thing
    fcntl = None  # type: ignore[assignment]

_ROOT = Path(__file__).resolve().parent.parent
_IMPORT = re.compile(r"^\s*from ((?:hydrone_gym|planners|agents)[\w.]*) import (.*)$", re.MULTILINE)
_PATIENCE, _GLANCE = 120.0, 0.05  # s that a process waits for another one to compile, and between looks
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False, "boundscheck": False}


def _source(module: str) -> Path | None:
    """File of a module of this project, or of another one that is loaded; None if there is none."""
    path = _ROOT.joinpath(*module.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    elsewhere = getattr(sys.modules.get(module), "__file__", None)
    return Path(elsewhere) if elsewhere else None


@functools.cache
def _imported(module: str) -> frozenset[str]:
    """The project's modules that a module imports from, or by name."""
    path, found = _source(module), set()
    for origin, names in [] if path is None else _IMPORT.findall(path.read_text(encoding="utf-8")):
        found.add(origin)
        found |= {inner for name in re.findall(r"\w+", names) if _source(inner := f"{origin}.{name}")}
    return frozenset(found)


@functools.cache
def _fingerprint(*modules: str) -> str:
    """Hash of the compiler, NumPy, and the source of modules and of all they import, however deep."""
    seen: set[str] = set()
    waiting = set(modules)
    while waiting:
        seen |= waiting
        waiting = {name for found in waiting for name in _imported(found)} - seen
    digest = hashlib.sha256(f"{numba.__version__} {np.__version__}".encode())
    for name in sorted(seen):
        path = _source(name)
        digest.update(name.encode() + (b"" if path is None else path.read_bytes()))
    return digest.hexdigest()[:16]


def _folders() -> Iterator[Path]:
    """Yield where compiled kernels may be kept, made if missing; OSError where that fails."""
    with contextlib.suppress(RuntimeError):  # an account without a home
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hydrone_gym"
        with contextlib.suppress(OSError):
            home.mkdir(parents=True, exist_ok=True)
            yield home
    owner = os.getuid() if hasattr(os, "getuid") else 0
    shared = Path(tempfile.gettempdir()) / f"hydrone_gym-{owner}"
    shared.mkdir(mode=0o700, exist_ok=True)
    found = shared.lstat()  # what is stored is executed, and anybody could have put this here before
    if os.name == "posix" and not (stat.S_ISDIR(found.st_mode) and found.st_uid == owner and not found.st_mode & 0o022):
        raise PermissionError(f"{shared} must be a folder of yours that nobody else may write")
    yield shared


@functools.cache
def cache_root() -> Path | None:
    """A writable directory for compiled kernels, or None when there is none (then nothing is cached)."""
    reason = "no folder is writable"
    try:
        for folder in _folders():
            if os.access(folder, os.W_OK | os.X_OK):
                return folder
    except OSError as error:
        reason = str(error)
    _tell(f"kernels are not cached, each process compiles them anew: {reason}")
    return None


@functools.cache
def _tell(line: str) -> None:
    """Log a warning, which goes to stderr unless the user says otherwise; the same one once."""
    logging.getLogger("hydrone_gym").warning("hydrone_gym: %s", line)


class _CheckedFile(IndexDataCacheFile):
    """Cache files whose machine code is compared with its hash: damaged code would end the process."""

    def _save_data(self, name: str, data: Any) -> None:
        content = self._dump(data)
        super()._save_data(name, (hashlib.sha256(content).digest(), content))

    def _load_data(self, name: str) -> Any:
        digest, content = super()._load_data(name)
        if hashlib.sha256(content).digest() != digest:
            raise ValueError(f"{name} is not what was written")
        return pickle.loads(content)


class _SharedCache(FunctionCache):
    """A cache whose functions one process compiles while others wait for them: so several compile in parallel."""

    def __init__(self, function: Callable) -> None:
        """Begin without the lock."""
        super().__init__(function)
        self._cache_file.__class__ = _CheckedFile
        self._lock: Any = None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what is stored; if nothing is, hold the lock until it is, or wait for who holds it."""
        found = self._stored(sig, target_context)
        if found is None and self._acquire():
            found = self._stored(sig, target_context)
            if found is not None:
                self.release()
        return found

    def _stored(self, sig: Any, target_context: Any) -> Any:
        """Return what is stored, None if there is nothing or only something damaged, which is forgotten."""
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:  # reading what is damaged may raise anything
            _tell(f"kernels are compiled anew, their cache {cache_root()} is damaged: {type(error).__name__}: {error}")
        try:
            self.flush()
        except OSError:
            self.disable()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a function, where that can be done, and let the others have it."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _tell(f"kernels cannot be cached in {cache_root()}: {error.strerror or error}")
        finally:
            self.release()

    def _acquire(self) -> bool:
        """Take the lock, or give up after a while: it saves work, and must never hold anybody up for good."""
        if fcntl is None or self._lock is not None:
            return False
        with contextlib.suppress(OSError):
            Path(self.cache_path).mkdir(parents=True, exist_ok=True)
            lock = open(Path(self.cache_path, f"{self._impl.filename_base}.lock"), "w")  # noqa: SIM115  kept open
            for _ in range(int(_PATIENCE / _GLANCE)):
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    time.sleep(_GLANCE)
                else:
                    self._lock = lock
                    return True
            lock.close()
        return False

    def release(self) -> None:
        """Let others go on: what was compiled is stored, or failed."""
        if self._lock is not None:
            fcntl.flock(self._lock, fcntl.LOCK_UN)  # closing is not enough where a forked process has it open too
            self._lock.close()
            self._lock = None


def _releasing(compile_it: Callable, cache: _SharedCache) -> Callable:
    """Make a compiler let go of the lock when it fails or is interrupted."""

    def compile_or_release(*arguments: Any) -> Any:
        try:
            return compile_it(*arguments)
        except BaseException:
            cache.release()
            raise

    return compile_or_release


def _cached(compiled: Any, function: Callable, *modules: str) -> Any:
    """Let a compiled function keep its machine code on disk, under the fingerprint of modules."""
    root = cache_root()
    if root is None:
        return compiled
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(root / _fingerprint(*modules))
    try:
        cache = _SharedCache(function)
        usable = Path(cache.cache_path).is_relative_to(root)  # Numba's own folders go stale
    except RuntimeError:
        usable = False
    finally:
        numba.config.CACHE_DIR = before
    if not usable:
        _tell(f"kernels cannot be cached below {root}: nothing can be written there")
        return compiled
    compiled._cache = cache
    compiler = getattr(compiled, "_compiler", compiled)
    compiler.compile = _releasing(compiler.compile, cache)
    return compiled


def kernel(function: Callable) -> Any:
    """Compile an entry point: a function that Python calls, cached on disk."""
    return _cached(numba.njit(**_OPTIONS)(function), function, function.__module__)


def unit(signature: Any, function: Callable, *modules: str) -> Any:
    """Compile a function that other kernels call by its `address`, see `hydrone_gym._memory.call`; cached on disk.

    Its callers do not contain it: they compile without it, and are the same for every variant of it.

    Args:
        signature: Numba types; pointers and numbers only.
        function: what it closes over must be plain data or classes, which do not change from process to process.
        modules: under whose fingerprint it is cached; they import everything that the function uses.
    """
    unit = CFunc(function, sigutils.normalize_signature(signature), {}, _OPTIONS)
    _cached(unit, function, *modules).compile()
    return unit


def inlined(function: Callable) -> Any:
    """Compile a building block that LLVM must inline into every caller.

    Without forced inlining a loop over lanes is compiled to one scalar call a lane, three times slower.
    """
    return numba.njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)


def routine(function: Callable) -> Any:
    """Compile a large function that other kernels call: one copy of its code, not inlined, not cached by itself."""
    return numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)


def shared(function: Callable) -> Any:
    """Let kernels call a function that stays what it is for Python: plain arithmetic, for what Python works out too."""
    return register_jitable(error_model="numpy")(function)
