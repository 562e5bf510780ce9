"""PyFlyt's `Aviary` with one quadrotor in position mode: its default rates, a control step is two of physics."""

from protocol import begin, serve

answers = begin()

from importlib.metadata import version  # noqa: E402

import numpy as np  # noqa: E402
from PyFlyt.core import Aviary  # noqa: E402

CALLS = 16
aviary = Aviary(start_pos=np.array([[0.0, 0.0, 1.0]]), start_orn=np.zeros((1, 3)), drone_type="quadx")
aviary.set_mode(7)
rng = np.random.default_rng(0)
references = rng.uniform((-0.5, -0.5, 0.0, 0.5), (0.5, 0.5, 0.0, 1.5), (CALLS, 4))


def run():
    for reference in references:
        aviary.set_setpoint(0, reference)
        aviary.step()
        aviary.state(0)
    return CALLS


serve(answers, version("PyFlyt"), {f"N = 1, {aviary.updates_per_step} substeps": (int(aviary.updates_per_step), run)})
