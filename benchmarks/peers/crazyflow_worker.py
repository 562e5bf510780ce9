"""crazyflow's `Sim` with position references: its default dynamics and Euler steps of 2 ms, in the worlds given."""

from protocol import begin, serve

answers = begin()

from importlib.metadata import version  # noqa: E402

import jax  # noqa: E402
import numpy as np  # noqa: E402
from crazyflow.control import Control  # noqa: E402
from crazyflow.sim import Sim  # noqa: E402
from crazyflow.sim.integration import Integrator  # noqa: E402


def make(worlds, substeps):
    sim = Sim(n_worlds=worlds, n_drones=1, control=Control.state, integrator=Integrator.euler, freq=500)
    sim.reset()
    rng = np.random.default_rng(0)
    references = np.zeros((16, worlds, 1, 16), np.float32)
    references[..., :3] = rng.uniform((-0.5, -0.5, 0.5), (0.5, 0.5, 1.5), (16, worlds, 1, 3))
    references[..., 12] = 1.0  # level, facing x
    calls = max(1, 256 // worlds)
    turn = 0

    def run():
        nonlocal turn
        for _ in range(calls):
            sim.state_control(references[turn % 16])
            sim.step(substeps)
            turn += 1
        jax.block_until_ready(sim.data.states.pos)
        return worlds * calls

    return substeps, run


serve(
    answers,
    version("crazyflow"),
    {
        f"N = {worlds}, {substeps} substeps": make(worlds, substeps)
        for substeps in (10, 50)
        for worlds in (1, 64, 1024, 4096)
    },
)
