"""The attitude that the control laws ask for along a flight, which a policy that sends positions never sees."""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import kernel
from hydrone_gym.control.air import tilt_reference
from hydrone_gym.control.reference import Reference
from hydrone_gym.control.water import surge_and_heading
from hydrone_gym.evaluation.flight import Trace
from hydrone_gym.physics.kinematics import State, attitude_of
from hydrone_gym.simulation.model import unpack_model
from hydrone_gym.simulation.simulation import TICK, Simulation
from hydrone_gym.surface import is_air


@kernel
def _write_references(
    states: NDArray, moving: NDArray, values: NDArray[np.float64], tick: float, out: NDArray[np.float64]
) -> None:
    """Write the attitude reference (φ, θ, ψ) of every sample; NaN where a law has none.

    Shapes: states (N, 12), moving (N, 4), values packed `Model`, out (N, 3); tick in s.
    """
    model = unpack_model(values)
    w = model.world
    for n in range(states.shape[0]):
        s = states[n]
        state = State(s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11])
        # the reference moves evenly within a period; at rest before the first
        old, new = moving[max(n - 1, 0)], moving[n]
        vx, vy, vz = (new[0] - old[0]) / tick, (new[1] - old[1]) / tick, (new[2] - old[2]) / tick
        reference = Reference(new[0], new[1], new[2], new[3], vx, vy, vz)
        attitude = attitude_of(state)
        vertical = abs(state.z) <= w.zone and w.vertical_mode > 0.0
        if is_air(state.z):
            phi, theta = tilt_reference(state, attitude, reference, vertical, model.air_gains)
            out[n, 0], out[n, 1], out[n, 2] = phi, theta, reference.psi
        else:
            _, error, drive = surge_and_heading(state, attitude, reference, vertical, model.water_gains)
            out[n, 0], out[n, 1] = np.nan, 0.0
            out[n, 2] = state.psi + error if drive else np.nan


def attitude_references(simulation: Simulation, trace: Trace) -> NDArray[np.float64]:
    """Return roll, pitch and yaw (rad) that the control laws track at every tick of a trace, (N, 3).

    Under water roll is free, pitch is held level and yaw is the line of sight while the vehicle drives; what a law does
    not track is NaN.
    """
    out = np.empty((len(trace.times), 3))
    _write_references(trace.states, trace.references, simulation.values, TICK, out)
    return out
