"""What only a fresh process can tell: start-up time, memory, growth, compiled versions. Run by throughput.py.

    python -m benchmarks.probe single|vector|plan|memory|growth|versions [NUMBER ...]

Prints one line of JSON.
"""

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ID = "HydroneGym/Mission-v0"


def resident() -> float:
    """Memory in use now, MB (Linux; elsewhere the peak so far)."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return peak()
    return pages * resource.getpagesize() / 1e6


def peak() -> float:
    """Peak memory, MB."""
    scale = 1.0 if sys.platform == "darwin" else 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * scale / 1e6


def single() -> dict[str, Any]:
    """First step of a single environment."""
    import gymnasium as gym

    import hydrone_gym  # noqa: F401

    env = gym.make(ID)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    return {"cpu": time.process_time()}


def vector(count: int = 64) -> dict[str, Any]:
    """First step of a vector environment."""
    from benchmarks.environments import make_vector

    env = make_vector(count)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    return {"cpu": time.process_time()}


def plan() -> dict[str, Any]:
    """First plan of the CL-RRT."""
    import gymnasium as gym

    import hydrone_gym  # noqa: F401
    from planners import CLRRT

    env = gym.make(ID)
    observation, _ = env.reset(seed=0)
    policy = CLRRT.for_env(env, iterations=50)
    policy.predict(observation)
    return {"cpu": time.process_time()}


def memory(count: int = 4096) -> dict[str, Any]:
    """Memory of a vector environment after some steps: peak, and beyond what the imports alone take."""
    from benchmarks.environments import vector as drive

    imports = resident()
    contestant, _ = drive(count, "near", "memory")
    for _ in range(20):
        contestant.run()
    return {"num_envs": count, "imports": imports, "now": resident(), "peak": peak()}


def growth(steps: int = 1_000_000, count: int = 1024) -> dict[str, Any]:
    """Memory at tenths of a long run."""
    from benchmarks.environments import vector as drive

    contestant, flights = drive(count, "near", "growth")
    samples = []
    for tenth in range(11):
        while flights.steps < steps * tenth / 10:
            contestant.run()
        samples.append(round(resident(), 2))
    return {"num_envs": count, "steps": flights.steps, "episodes": flights.outcomes.total(), "megabytes": samples}


def compiled_versions() -> dict[str, int]:
    """Number of compiled signatures of every kernel Python calls."""
    found = {}
    for module in list(sys.modules.values()):
        if module.__name__.split(".")[0] in ("hydrone_gym", "planners"):
            for name, thing in vars(module).items():
                if hasattr(thing, "py_func") and getattr(thing, "signatures", None):
                    found[f"{thing.py_func.__module__}.{name}"] = len(thing.signatures)
    return found


def versions(*counts: int) -> dict[str, Any]:
    """Compiled versions after each number of rows: no kernel may get a second one."""
    from benchmarks.environments import make_vector

    sizes = counts or (1, 7, 64, 1000, 4096)
    kernels, most = [], []
    for count in sizes:
        env = make_vector(count)
        env.reset(seed=0)
        for _ in range(3):
            env.step(env.action_space.sample())
        found = compiled_versions()
        kernels.append(len(found))
        most.append(max(found.values()))
    return {"num_envs": list(sizes), "kernels": kernels, "most": most, "versions": compiled_versions()}


PROBES: dict[str, Callable[..., dict[str, Any]]] = {
    "single": single,
    "vector": vector,
    "plan": plan,
    "memory": memory,
    "growth": growth,
    "versions": versions,
}

if __name__ == "__main__":
    print(json.dumps(PROBES[sys.argv[1]](*(int(value) for value in sys.argv[2:]))))
