"""The circumstances of a run: threads, a busy neighbour, memory, start-up, compiled versions."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import Any

from benchmarks.environments import vector
from benchmarks.timing import ROOT, Contestant, in_turns, turn

ROWS = 1024


def probe(name: str, *numbers: int, cache: str | None = None) -> dict[str, Any]:
    """Run a probe in a fresh process; its answer, and the wall-clock seconds from launch to exit."""
    environment = dict(os.environ)
    if cache is not None:
        environment["XDG_CACHE_HOME"] = cache
    command = [sys.executable, "-m", "benchmarks.probe", name, *map(str, numbers)]
    start = time.perf_counter()
    result = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    wall = time.perf_counter() - start
    if result.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{result.stderr}")
    return {**json.loads(result.stdout.splitlines()[-1]), "wall": wall}


def start_up(with_vector: bool) -> dict[str, Any]:
    """Seconds from launching Python to the first result: fresh kernel cache (compiling), then filled."""
    names = ["single", *(["vector"] if with_vector else []), "plan"]
    measured = {}
    for name in names:
        with tempfile.TemporaryDirectory() as cache:
            cold = probe(name, cache=cache)
            warm = min((probe(name, cache=cache) for _ in range(3)), key=lambda answer: answer["cpu"])
        measured[name] = {"cold": cold, "warm": warm}
    return measured


def threads() -> dict[str, Any]:
    """Wall-clock rate of two threads against one, in turns."""
    contestants = []
    for rows in (ROWS, 4 * ROWS):
        for count in (1, 2):
            contestants.append(vector(rows, "near", f"{rows} rows, {count}", threads=count)[0])
    in_turns(contestants, rounds=7, seconds=0.5, clock=time.perf_counter)
    rates = {contestant.name: contestant.rate for contestant in contestants}
    ratios = {rows: rates[f"{rows} rows, 2"] / rates[f"{rows} rows, 1"] for rows in (ROWS, 4 * ROWS)}
    return {"steps_per_second": rates, "ratio": ratios}


@contextlib.contextmanager
def _busy_processes(cores: list[int]) -> Iterator[list[int]]:
    """One busy process pinned to each core, stopped at first; yields their ids."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in cores]
    try:
        for process, core in zip(processes, cores, strict=True):
            os.sched_setaffinity(process.pid, {core})
            process.send_signal(signal.SIGSTOP)
        yield [process.pid for process in processes]
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _beside(contestant: Contestant, pids: list[int], rounds: int, seconds: float) -> dict[str, float]:
    """Wall-clock rates with the busy processes stopped and running, in turns."""
    quiet, crowded = Contestant("quiet", contestant.run), Contestant("crowded", contestant.run)
    contestant.run()
    for _ in range(rounds):
        quiet.rates.append(turn(contestant.run, seconds, time.perf_counter))
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
        crowded.rates.append(turn(contestant.run, seconds, time.perf_counter))
        for pid in pids:
            os.kill(pid, signal.SIGSTOP)
    return {"quiet": quiet.rate, "crowded": crowded.rate, "ratio": crowded.rate / quiet.rate}


def neighbour(rounds: int = 5, seconds: float = 1.0) -> dict[str, Any]:
    """Rate beside busy processes that hold every core this process may use, as a share of the rate without them."""
    if not hasattr(os, "sched_setaffinity"):
        return {"skipped": "processes cannot be pinned to cores on this system"}
    allowed = os.sched_getaffinity(0)
    cores = sorted(allowed)[:2]
    measured: dict[str, Any] = {}
    try:
        for rows, count in ((64, 1), (ROWS, 1), (ROWS, 2)):
            if count > len(cores):
                continue
            mine = cores[:count]
            os.sched_setaffinity(0, mine)
            contestant = vector(rows, "near", "neighbour", threads=count)[0]
            with _busy_processes(mine) as pids:
                measured[f"{rows} rows, threads {count}"] = _beside(contestant, pids, rounds, seconds)
    finally:
        os.sched_setaffinity(0, allowed)
    return measured


def memory(steps: int) -> dict[str, Any]:
    """Memory at 4096 rows, and growth over a long run; kernels already compiled, as compiling takes memory too."""
    probe("memory", 16)
    return {"peak": probe("memory", 4096), "growth": probe("growth", steps)}
