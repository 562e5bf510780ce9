"""Does examples/rllib_ppo.py run with what RLlib pins? In a virtual environment of its own, for one iteration.

    python -m benchmarks.rllib_example

The environment is made in a cache directory and filled by pip with the extra `rllib` on the first run: 2 GB, some
minutes. Exit code 0 if the example sampled the steps it was asked for, learnt from them and closed; 1 otherwise.
"""

import json
import os
import re
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tyro

from benchmarks.peers.run import default_cache, install
from benchmarks.timing import save

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples" / "rllib_ppo.py"
PACKAGES = ("ray", "gymnasium", "numpy", "numba", "torch")
_LINE = re.compile(r"^iteration (\d+): steps (\d+), learnt from (\d+), mean return (\S+)$", re.MULTILINE)


@dataclass(frozen=True, kw_only=True)
class Settings:
    steps: int = 8192
    """transitions of the iteration"""
    seconds: float = 600.0
    """time the example may take; it compiles the kernels of a fresh environment first"""
    cache: Path = field(default_factory=lambda: default_cache().with_name("hydrone_gym_rllib"))
    """where the environment is kept"""


def installed(python: Path) -> dict[str, str]:
    code = f"import json, importlib.metadata as m; print(json.dumps({{p: m.version(p) for p in {PACKAGES!r}}}))"
    return json.loads(subprocess.run([str(python), "-c", code], capture_output=True, text=True, check=True).stdout)


def checked(output: str, steps: int) -> dict[str, Any]:
    """What the example printed; raises RuntimeError if it did not sample, learn and close."""
    lines = _LINE.findall(output)
    if len(lines) != 1 or int(lines[0][1]) < steps or int(lines[0][2]) < steps or not output.endswith("closed\n"):
        raise RuntimeError(f"the example did not do its iteration of {steps} steps:\n{output}")
    _, sampled, learnt, mean = lines[0]
    return {"steps": int(sampled), "learnt_from": int(learnt), "mean_return": float(mean)}


def run(settings: Settings) -> dict[str, Any]:
    """Install, run, check; raises RuntimeError with what went wrong."""
    began = time.perf_counter()
    python = install("rllib", f"--editable={ROOT}[rllib]", settings.cache.resolve())
    ready = time.perf_counter()
    arguments = [str(python), str(EXAMPLE), "--iterations", "1", "--steps", str(settings.steps)]
    try:
        done = subprocess.run(
            arguments,
            capture_output=True,
            text=True,
            timeout=settings.seconds,
            cwd=settings.cache,
            env={
                **os.environ,
                "XDG_CACHE_HOME": str(settings.cache.resolve()),
            },  # kernels of its Numba, beside nobody else's
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"the example did not end within {settings.seconds:g} s") from None
    if done.returncode:
        raise RuntimeError(f"the example failed with {done.returncode}:\n{done.stdout}{done.stderr[-4000:]}")
    result = checked(done.stdout, settings.steps)
    times = {"install_s": round(ready - began, 1), "example_s": round(time.perf_counter() - ready, 1)}
    return {**result, **times, "versions": installed(python)}


def main() -> int:
    settings = tyro.cli(Settings, description=__doc__)
    try:
        measured = run(settings)
    except (OSError, RuntimeError) as error:
        print(error, file=sys.stderr)
        return 1
    save("rllib_example", "python -m benchmarks.rllib_example", {"measured": measured})
    print(json.dumps(measured, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
