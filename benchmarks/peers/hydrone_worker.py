"""This project's vector env and single env, raw interface, with everything an environment step includes."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1])]

from protocol import begin, serve  # noqa: E402

answers = begin()

from benchmarks.environments import has_vector_env, single, vector  # noqa: E402
from hydrone_gym import __version__  # noqa: E402
from hydrone_gym.simulation.clock import SUBSTEPS, TICK  # noqa: E402

PERIOD = round(0.5 / TICK) * SUBSTEPS
runs = {f"single, {PERIOD} substeps": single("near", "single")[0]}
if has_vector_env():
    for rows in (1, 64, 1024, 4096):
        runs[f"N = {rows}, {PERIOD} substeps"] = vector(rows, "near", "vector")[0]
serve(answers, __version__, {name: (PERIOD, contestant.run) for name, contestant in runs.items()})
