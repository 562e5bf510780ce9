"""Two checkouts of the project beside each other: how fast each is, in one run on one machine.

    python -m benchmarks.versus ../older_checkout            # this checkout against that one
    python -m benchmarks.versus ../older_checkout --rounds 9

A process a checkout does the same work in turns, so that what else the machine does hits both alike. Figures are
units of work a CPU-second, medians over rounds; the ratio is the median of the rounds' ratios, this over the other.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

HERE = Path(__file__).resolve().parent.parent


@dataclass(frozen=True, kw_only=True)
class Versus:
    """Compare this checkout with another one."""

    other: tyro.conf.Positional[Path]
    """Folder of the other checkout."""
    rounds: int = 7
    """Turns of each."""
    parts: tuple[str, ...] = ()
    """Which works, all unless given: the words in the first column of the table, or parts of them."""


def _substeps(lanes: int, count: int) -> Callable[[], float]:
    """Rows in mid-flight, 20 spheres out of the way."""
    from benchmarks.flying import flying_rows, lane_major, near_references, simulation, spheres_out_of_the_way

    rng = np.random.default_rng(0)
    rows, flat = flying_rows(rng, count), lane_major(spheres_out_of_the_way(rng, count), lanes)
    references, ours = near_references(rng, rows), simulation(lanes)
    closest, work = np.full((len(flat), 20 * lanes), np.inf), rows.copy()

    def run() -> float:
        for _ in range(8):
            work[:] = rows
            ours.advance(work, references, flat, closest, 20)
        return 8.0 * 50 * count

    return run


def _single(interface: str) -> Callable[[], float]:
    import gymnasium as gym

    env = gym.make("HydroneGym/Mission-v0", interface=interface).unwrapped
    env.reset(seed=0)
    action = np.zeros(3, np.float32) if interface == "egocentric" else None

    def run() -> float:
        for _ in range(4000):
            reference = env.action_space.sample() if action is None else action
            *_, terminated, truncated, _ = env.step(reference)
            if terminated or truncated:
                env.reset()
        return 4000.0

    return run


def _vector(count: int) -> Callable[[], float]:
    import gymnasium as gym

    rows = gym.make_vec("HydroneGym/Mission-v0", num_envs=count, vectorization_mode="vector_entry_point")
    observation, _ = rows.reset(seed=0)
    steps, rng = max(8, 65536 // count), np.random.default_rng(0)
    moves = rng.normal(0.0, 1.0, (16, count, 4)).astype(np.float32)

    def run() -> float:
        nonlocal observation
        for k in range(steps):
            observation, *_ = rows.step(observation["reference"].astype(np.float32) + moves[k % 16])
        return float(steps * count)

    return run


def _planning(unit: str) -> Callable[[], float]:
    import gymnasium as gym

    from planners import CLRRT

    env = gym.make("HydroneGym/AirToWater-v0", num_obstacles=40)
    planner = CLRRT.for_env(env)
    observations = [env.reset(seed=seed)[0] for seed in range(40)]

    def run() -> float:
        edges = 0
        for observation in observations:
            _, (memory,) = planner.predict(observation)
            edges += memory.report.edges
        return float(edges) if unit == "edges" else float(len(observations))

    return run


def _learning() -> Callable[[], float]:
    import torch
    from stable_baselines3 import PPO

    from agents.vec_env import HydroneVecEnv

    torch.set_num_threads(1)
    rows = HydroneVecEnv("HydroneGym/Mission-v0", 256)
    model = PPO("MlpPolicy", rows, n_steps=64, batch_size=2048, n_epochs=3, device="cpu", seed=0)

    def run() -> float:
        model.learn(256 * 64, reset_num_timesteps=False)
        return 256.0 * 64

    return run


WORKS: dict[str, Callable[[], Callable[[], float]]] = {
    "substeps, one lane": lambda: _substeps(1, 256),
    "substeps, 16 lanes": lambda: _substeps(16, 1024),
    "single env, steps": lambda: _single("world"),
    "single env, egocentric steps": lambda: _single("egocentric"),
    "vector env of 64, steps": lambda: _vector(64),
    "vector env of 1024, steps": lambda: _vector(1024),
    "vector env of 4096, steps": lambda: _vector(4096),
    "CL-RRT, edges": lambda: _planning("edges"),
    "CL-RRT, planning cycles": lambda: _planning("cycles"),
    "PPO in Stable-Baselines3, steps": _learning,
}


def _serve() -> None:
    """Do the work named on each line of stdin; answer with the units done a CPU-second."""
    import hydrone_gym

    running: dict[str, Callable[[], float]] = {}
    print(json.dumps(hydrone_gym.__file__), flush=True)
    for line in sys.stdin:
        name = json.loads(line)
        if name not in running:
            running[name] = WORKS[name]()
            running[name]()  # compiles
        began = time.process_time()
        done = running[name]()
        print(json.dumps(done / (time.process_time() - began)), flush=True)


class Worker:
    """A process that works in one checkout; the works themselves are those of this file."""

    def __init__(self, checkout: Path) -> None:
        environment = {**os.environ, "PYTHONPATH": f"{checkout}{os.pathsep}{HERE}", "OMP_NUM_THREADS": "1"}
        program = (
            "import runpy, sys; sys.argv = ['versus', '--serve']; runpy.run_path(sys.path.pop(), run_name='__main__')"
        )
        program = f"import sys; sys.path.append({str(Path(__file__).resolve())!r}); " + program
        pipes: Any = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._process = subprocess.Popen([sys.executable, "-P", "-c", program], env=environment, cwd=checkout, **pipes)
        self.imported = self._answer()

    def _answer(self) -> Any:
        while True:
            line = self._process.stdout.readline()
            if not line:
                raise RuntimeError("a worker ended; its error is above")
            try:
                return json.loads(line)
            except ValueError:
                continue  # what the work itself prints

    def rate(self, name: str) -> float:
        """Units of work a CPU-second."""
        self._process.stdin.write(json.dumps(name) + "\n")
        self._process.stdin.flush()
        return float(self._answer())


def main(a: Versus) -> None:
    """Measure and print a Markdown table."""
    ours, theirs = Worker(HERE), Worker(a.other.resolve())
    print(
        f"this: {ours.imported}\nother: {theirs.imported}\n\n| a CPU-second | this | other | ratio |\n|---|---|---|---|"
    )
    for name in WORKS:
        if a.parts and not any(part in name for part in a.parts):
            continue
        pairs = np.array([(ours.rate(name), theirs.rate(name)) for _ in range(a.rounds)])
        this, other = np.median(pairs, axis=0)
        print(f"| {name} | {this:,.0f} | {other:,.0f} | {np.median(pairs[:, 0] / pairs[:, 1]):.3f} |", flush=True)


if __name__ == "__main__":
    _serve() if "--serve" in sys.argv else main(tyro.cli(Versus))
