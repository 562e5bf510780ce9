"""Starts OMPL in an environment of its own and plans in one world at a time."""

import json
import os
import site
import subprocess
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.peers.run import install
from benchmarks.timing import ROOT
from hydrone_gym.world.scenario import Scenario

REQUIREMENT = "ompl==2.0.*"


class Tuning(NamedTuple):
    """What its user may set."""

    goal_bias: float  # share of samples that are the goal
    longest: int  # periods a control is held for at most


TUNINGS = {
    "defaults": Tuning(0.05, 10),  # OMPL's own
    "goal 25 %": Tuning(0.25, 10),  # CL-RRT's share
    "goal 25 %, short": Tuning(0.25, 5),
}


class Planned(NamedTuple):
    """One world."""

    solved: bool
    wall: float  # s until the first solution or the limit
    cpu: float  # s
    edges: int  # propagated


class OmplWorker:
    """OMPL's control RRT in a process of its own. Raises RuntimeError with pip's words if it cannot be installed.

    Args:
        vehicle: name of the parameter set.
        period: s between references.
        cache: where the environment is kept.
    """

    def __init__(self, vehicle: str, period: float, cache: Path) -> None:
        """Install what is missing, start the process and wait for its kernels."""
        python = install("ompl", REQUIREMENT, cache)
        self._log = cache / "ompl-run.log"
        # the wheel needs neither NumPy nor Numba: both are ours, so the kernel and its cache are the very same
        path = os.pathsep.join([str(ROOT), *site.getsitepackages()])
        with self._log.open("w", encoding="utf-8") as log:
            self._process = subprocess.Popen(
                [str(python), "-m", "benchmarks.peers.ompl_worker", vehicle, str(period)],
                cwd=cache,
                env={**os.environ, "PYTHONPATH": path},
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )
        self.version: str = self._read()["version"]

    def _read(self) -> dict:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self.close()
            raise RuntimeError(f"OMPL failed; {self._log} ends with:\n{self._log.read_text(encoding='utf-8')[-2000:]}")
        return json.loads(line)

    def plan(self, row: np.ndarray, scenario: Scenario, limit: float, tuning: Tuning) -> Planned:
        """Plan from a start (20,), state, controller memory and reference, for at most `limit` s."""
        request = {
            "row": row.tolist(),
            "goal": list(scenario.goal),
            "obstacles": scenario.obstacles.tolist(),
            "limit": limit,
            **tuning._asdict(),
        }
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return Planned(**self._read())

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.communicate()
