"""The same measure for crazyflow, PyFlyt and this project, in turns: control steps and physics substeps a CPU second.

    python -m benchmarks.peers.run

A control step takes a position reference and flies toward it. Every peer gets a virtual environment of its own (they
need different NumPy versions) in a cache directory, filled by pip on the first run: 1.5 GB, some minutes. Nothing of it
is a dependency of this project.
"""

import json
import os
import statistics
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tyro
from rich.console import Console

from benchmarks.tables import Sheet, number
from benchmarks.timing import save

HERE = Path(__file__).resolve().parent
PEERS = {"crazyflow": "crazyflow==0.4.*", "PyFlyt": "PyFlyt==0.29.*"}
OURS = "hydrone_gym"


def default_cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "hydrone_gym_peers"


@dataclass(frozen=True, kw_only=True)
class Settings:
    rounds: int = 7
    """turns of each contestant"""
    seconds: float = 0.5
    """CPU seconds of a turn"""
    cache: Path = field(default_factory=default_cache)
    """where the peers' environments are kept"""
    json: bool = False
    """print JSON instead of a table; it is written to benchmarks/results in both cases"""


def _tail(log: Path) -> str:
    return "\n".join(log.read_text(encoding="utf-8", errors="replace").splitlines()[-15:])


class Worker:
    """A simulator in a process of its own."""

    def __init__(self, name: str, python: Path, cache: Path) -> None:
        cache.mkdir(parents=True, exist_ok=True)
        self._log = cache / f"{name}-run.log"
        script = HERE / f"{name.lower().removesuffix('_gym')}_worker.py"
        self.name = name
        with self._log.open("w", encoding="utf-8") as log:
            self._process = subprocess.Popen(
                [str(python), str(script)],
                cwd=cache,  # some libraries write logs where they stand
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )
        listing = self._read()
        self.version: str = listing["version"]
        self.runs: dict[str, int] = listing["runs"]

    def _read(self) -> Any:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self.close()
            raise RuntimeError(f"{self.name} failed; {self._log} ends with:\n{_tail(self._log)}")
        return json.loads(line)

    def rate(self, run: str, seconds: float) -> float:
        """Control steps a CPU second."""
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps([run, seconds]) + "\n")
        self._process.stdin.flush()
        return self._read()

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


def install(name: str, requirement: str, cache: Path) -> Path:
    """Make a peer's environment if it is not there yet; return its Python. Raises RuntimeError with pip's words."""
    folder = cache / name
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    done = folder / "installed"
    if done.exists() and done.read_text(encoding="utf-8") == requirement:
        return python
    print(f"installing {requirement} into {folder} …", file=sys.stderr)
    log = cache / f"{name}.log"
    cache.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8") as output:
        for command in (
            [sys.executable, "-m", "venv", "--clear", str(folder)],
            [str(python), "-m", "pip", "install", "--no-input", "--disable-pip-version-check", requirement],
        ):
            if subprocess.run(command, stdout=output, stderr=subprocess.STDOUT).returncode:
                raise RuntimeError(f"{' '.join(command)} failed; {log} ends with:\n{_tail(log)}")
    done.write_text(requirement, encoding="utf-8")
    return python


def start(cache: Path) -> tuple[list[Worker], dict[str, str]]:
    """Start every simulator; those that cannot be had are named with the reason."""
    workers, missing = [], {}
    for name, requirement in PEERS.items():
        try:
            workers.append(Worker(name, install(name, requirement, cache), cache))
        except (OSError, RuntimeError) as error:
            missing[name] = str(error)
            print(f"{name}: not measured.\n{error}", file=sys.stderr)
    return [Worker(OURS, Path(sys.executable), cache), *workers], missing


def measure(workers: list[Worker], settings: Settings) -> list[dict[str, Any]]:
    """Turns of every run of every simulator; medians."""
    rates: dict[tuple[str, str], list[float]] = {}
    for _ in range(settings.rounds):
        for worker in workers:
            for run in worker.runs:
                rates.setdefault((worker.name, run), []).append(worker.rate(run, settings.seconds))
    rows = []
    for worker in workers:
        for run, substeps in worker.runs.items():
            rate = statistics.median(rates[worker.name, run])
            rows.append({"name": worker.name, "version": worker.version, "run": run, "control": rate})
            rows[-1]["physics"] = rate * substeps
    return rows


def sheet(measured: dict[str, Any]) -> Sheet:
    """The table."""
    best = max((row["physics"] for row in measured["rows"] if row["name"] == OURS), default=float("nan"))
    rows = [
        (
            f"{row['name']} {row['version']}, {row['run']}",
            number(row["control"]),
            number(row["physics"]),
            f"{best / row['physics']:.1f}",
        )
        for row in measured["rows"]
    ]
    notes = [
        f"One core, in turns. {OURS}: whole environment step with swept collision against 20 spheres, sensing, reward, "
        "resets. crazyflow: `Sim.step` alone, float32, Euler 2 ms. PyFlyt: `Aviary.step` and the state."
    ]
    notes += [f"{name}: not measured." for name in measured["missing"]]
    return Sheet(
        "Position references, beside its peers",
        ("simulator", "control steps/CPU s", "physics substeps/CPU s", f"{OURS}'s best / this"),
        rows,
        notes,
    )


def main() -> int:
    settings = tyro.cli(Settings, description=__doc__)
    workers, missing = start(settings.cache.resolve())
    try:
        measured = {"rows": measure(workers, settings), "missing": missing}
    finally:
        for worker in workers:
            worker.close()
    save("peers", "python -m benchmarks.peers.run", {"measured": measured})
    if settings.json:
        print(json.dumps(measured))
    else:
        Console().print(sheet(measured))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
