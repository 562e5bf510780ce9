"""Where jobs run: joblib, with the backend left to the user."""

import contextlib
import itertools
import logging
import os
import signal
import threading
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any

Runner = Callable[[Iterable[Any]], Generator[Any, None, None]]
MOST_JOBS = 1024
_PORTION = 16  # calls a worker
_IDLE = 20  # s after which a worker without work ends: also one whose parent was killed


@contextlib.contextmanager
def runner(backend: str | None, jobs: int | None, most: int) -> Iterator[Runner]:
    """Yield what runs joblib's delayed calls and returns their results one by one, in order.

    Args:
        backend: "loky" (processes), "threading", "dask", "ray", or another one registered with joblib; None for the one
            that `joblib.parallel_config` has set, this process unless told otherwise. Dask uses the client of this
            process or makes one: of the cluster that the configuration names (DASK_SCHEDULER_ADDRESS), else a local
            one. Ray joins RAY_ADDRESS or starts locally.
        jobs: how many at once; None for as many as there are cores, on a cluster those of the cluster, or what
            `parallel_config` has set where no backend is named.
        most: how many calls there are; more jobs than that are not started.

    Raises ValueError for a backend that joblib does not know or that lacks its package, or jobs out of range.
    """
    import joblib

    check_jobs(jobs)
    jobs = None if jobs is None else min(jobs, most)
    options: dict[str, Any] = {} if jobs is None else {"n_jobs": jobs}  # all others stay as the user set them
    if backend is not None:
        options = {"backend": backend, "n_jobs": jobs or -1}
    if backend == "loky":  # the workers of the others have one thread anyhow
        options |= {"inner_max_num_threads": 1, "idle_worker_timeout": _IDLE}
    with contextlib.ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        # work under way when an evaluation stops is flown again when it goes on
        warnings.filterwarnings("ignore", message=".*adjusting the input task", category=UserWarning)
        if backend in _STARTED:
            try:
                _STARTED[backend](stack, jobs)
            except ImportError as error:
                needed = f'it needs: pip install "hydrone-gym[{backend}]"'
                raise ValueError(f"backend {backend}: {error}; {needed}") from error
        stack.enter_context(joblib.parallel_config(**options))
        try:
            parallel = joblib.Parallel(return_as="generator")
        except ValueError:  # a backend that returns results only all at once: Ray's, for one
            yield _in_portions
        else:

            def run(calls: Iterable[Any]) -> Generator[Any, None, None]:
                with _deaf():  # workers start here
                    return parallel(calls)

            yield run


@contextlib.contextmanager
def _deaf() -> Iterator[None]:
    """Leave Ctrl-C to this process: those it starts meanwhile are ended by it, not in the middle of anything."""
    with contextlib.ExitStack() as stack:
        if threading.current_thread() is threading.main_thread():
            stack.callback(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.SIG_IGN))
        yield


def check_jobs(jobs: int | None) -> None:
    """Raise ValueError for a number of jobs out of range."""
    if jobs is not None and (isinstance(jobs, bool) or not isinstance(jobs, int) or not 1 <= jobs <= MOST_JOBS):
        raise ValueError(f"jobs must be a whole number of at least 1, at most {MOST_JOBS}, got {jobs!r}")


def _in_portions(calls: Iterable[Any]) -> Generator[Any, None, None]:
    """Run calls portion by portion on the same workers, so that finished results come before all are finished."""
    import joblib

    waiting, size = iter(calls), _PORTION * joblib.effective_n_jobs()
    with joblib.Parallel() as parallel:
        while portion := list(itertools.islice(waiting, size)):
            yield from parallel(portion)


def _dask(stack: contextlib.ExitStack, jobs: int | None) -> None:
    """See to it that there is a client."""
    import dask
    from distributed import Client

    try:
        Client.current()
    except ValueError:
        if dask.config.get("scheduler-address", None) is not None:
            stack.enter_context(Client())
            return
        with _deaf():
            client = Client(n_workers=jobs, threads_per_worker=1, dashboard_address=None)
        stack.enter_context(client)


def _ray(stack: contextlib.ExitStack, jobs: int | None) -> None:
    """See to it that this process belongs to a cluster, and that joblib knows of it."""
    import ray
    from ray.util.joblib import register_ray

    register_ray()
    if not ray.is_initialized():
        options: dict[str, Any] = {"logging_level": logging.ERROR, "log_to_driver": False}
        if "RAY_ADDRESS" not in os.environ:
            # "local": a cluster that was killed leaves its address in a file, which Ray would connect to
            options |= {"address": "local", "num_cpus": jobs, "include_dashboard": False}
        ray.init(**options)
        stack.callback(ray.shutdown)


_STARTED = {"dask": _dask, "ray": _ray}
