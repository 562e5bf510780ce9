"""How everything here is measured: warmed up, in turn (A B A B ...), in CPU seconds of this process, medians.

Wall-clock time on a shared machine swings by more than what is compared; CPU time and turns of a fraction of a second
leave ratios that repeat within a few percent.
"""

import dataclasses
import json
import os
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation import provenance

ROOT = Path(__file__).resolve().parent.parent
RESULTS = Path(__file__).resolve().parent / "results"


@dataclasses.dataclass
class Contestant:
    """Something to measure: `run` does a turn's smallest share of work and returns how many units it did."""

    name: str
    run: Callable[[], float]
    rates: list[float] = dataclasses.field(default_factory=list)  # units per CPU second, one a turn

    @property
    def rate(self) -> float:
        """Median over the turns."""
        return statistics.median(self.rates)

    @property
    def spread(self) -> float:
        """Half the distance between the quartiles, as a share of the median."""
        if len(self.rates) < 4:
            return float("nan")
        low, _, high = statistics.quantiles(self.rates, n=4)
        return (high - low) / 2.0 / self.rate


def turn(run: Callable[[], float], seconds: float, clock: Callable[[], float] = time.process_time) -> float:
    """Call `run` for so many seconds of a clock; return units per second."""
    units, start = 0.0, clock()
    while True:
        units += run()
        elapsed = clock() - start
        if elapsed >= seconds:
            return units / elapsed


def in_turns(
    contestants: list[Contestant],
    rounds: int,
    seconds: float,
    clock: Callable[[], float] = time.process_time,
) -> None:
    """Measure contestants in turn, after one warm-up call each."""
    for contestant in contestants:
        contestant.run()
    for _ in range(rounds):
        for contestant in contestants:
            contestant.rates.append(turn(contestant.run, seconds, clock))


def machine(packages: tuple[str, ...] = ("numpy", "numba", "gymnasium")) -> dict[str, Any]:
    """What a figure means nothing without: processor, cores, versions, commit, date."""
    return {
        **provenance.machine(),
        "load": [round(value, 2) for value in os.getloadavg()] if hasattr(os, "getloadavg") else None,
        "versions": provenance.versions(packages),
        "commit": provenance.commit() or "unknown",
        "date": time.strftime("%Y-%m-%d"),
    }


def save(name: str, command: str, measured: dict[str, Any], folder: Path = RESULTS) -> Path:
    """Write a measurement with its machine and command to results/NAME.json, or into another folder."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    record = {"command": command, "machine": machine(), **measured}
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return path
