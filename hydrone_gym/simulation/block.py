"""Lane blocks: the working storage of the simulation kernel, one field a quantity, one entry a lane.

The number of lanes is part of the type. One lane serves the single environment and the planner's tree edge, sixteen
serve batches; the kernel is the same source for both and their results are equal bit for bit.
"""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.reference import Integral
from hydrone_gym.physics.kinematics import State

LANES = 16
LOGGED_CROSSINGS = 8  # details kept until the driver sets `crossings` back to zero; further ones are only counted
CROSSING_FIELDS = ("time", "direction", "lateral_speed", "tilt", "vertical_speed")

_STATE = tuple(State._fields)
_INTEGRAL = tuple(f"integral_{name}" for name in Integral._fields)
_SAVED = tuple(f"saved_{name}" for name in (*_STATE, *_INTEGRAL, "energy"))
_REFERENCE = ("old_x", "old_y", "old_z", "old_psi", "move_x", "move_y", "move_z", "move_psi")
_EPISODE = ("goal_x", "goal_y", "goal_z", "ticks", "energy", "clearance", "outcome", "crossings")
_CROSSING = ("crossed", "cross_direction", "cross_speed2", "cross_cos", "cross_vz", "inverse_length2")

ROW = np.dtype(
    [
        ("state", np.float64, (12,)),
        ("integral", np.float64, (4,)),
        ("reference", np.float64, (4,)),
        ("goal", np.float64, (3,)),
        ("ticks", np.float64),
        ("energy", np.float64),
        ("clearance", np.float64),
        ("outcome", np.float64),
        ("crossings", np.float64),
        ("crossing_log", np.float64, (LOGGED_CROSSINGS, len(CROSSING_FIELDS))),
    ]
)


def new_block(lanes: int) -> np.ndarray:
    """Return working storage for a number of lanes: a record array of length one."""
    fields = (*_STATE, *_INTEGRAL, *_REFERENCE, *_EPISODE, *_CROSSING, *_SAVED)
    return np.zeros(1, np.dtype([(name, np.float64, (lanes,)) for name in fields]))


@inlined
def load_state(b, i):
    """Return the `State` in lane i."""
    return State(
        b.x[i], b.y[i], b.z[i], b.phi[i], b.theta[i], b.psi[i], b.vx[i], b.vy[i], b.vz[i], b.p[i], b.q[i], b.r[i]
    )


@inlined
def store_state(b, i, s):
    """Put a `State` into lane i."""
    b.x[i], b.y[i], b.z[i] = s.x, s.y, s.z
    b.phi[i], b.theta[i], b.psi[i] = s.phi, s.theta, s.psi
    b.vx[i], b.vy[i], b.vz[i] = s.vx, s.vy, s.vz
    b.p[i], b.q[i], b.r[i] = s.p, s.q, s.r


@inlined
def load_saved(b, i):
    """Return the `State` that lane i had when the tick began."""
    return State(
        b.saved_x[i],
        b.saved_y[i],
        b.saved_z[i],
        b.saved_phi[i],
        b.saved_theta[i],
        b.saved_psi[i],
        b.saved_vx[i],
        b.saved_vy[i],
        b.saved_vz[i],
        b.saved_p[i],
        b.saved_q[i],
        b.saved_r[i],
    )


@inlined
def save_lane(b, i):
    """Keep what lane i must fall back to if it is finished already or diverges in this tick."""
    b.saved_x[i], b.saved_y[i], b.saved_z[i] = b.x[i], b.y[i], b.z[i]
    b.saved_phi[i], b.saved_theta[i], b.saved_psi[i] = b.phi[i], b.theta[i], b.psi[i]
    b.saved_vx[i], b.saved_vy[i], b.saved_vz[i] = b.vx[i], b.vy[i], b.vz[i]
    b.saved_p[i], b.saved_q[i], b.saved_r[i] = b.p[i], b.q[i], b.r[i]
    b.saved_integral_z[i] = b.integral_z[i]
    b.saved_integral_phi[i] = b.integral_phi[i]
    b.saved_integral_theta[i] = b.integral_theta[i]
    b.saved_integral_psi[i] = b.integral_psi[i]
    b.saved_energy[i] = b.energy[i]


@inlined
def keep_or_restore(b, i, keep):
    """Keep lane i as it is, or put the saved values back: a select, so that lanes stay vectorised."""
    s, o = load_state(b, i), load_saved(b, i)
    b.x[i], b.y[i], b.z[i] = (s.x if keep else o.x), (s.y if keep else o.y), (s.z if keep else o.z)
    b.phi[i] = s.phi if keep else o.phi
    b.theta[i] = s.theta if keep else o.theta
    b.psi[i] = s.psi if keep else o.psi
    b.vx[i], b.vy[i], b.vz[i] = (s.vx if keep else o.vx), (s.vy if keep else o.vy), (s.vz if keep else o.vz)
    b.p[i], b.q[i], b.r[i] = (s.p if keep else o.p), (s.q if keep else o.q), (s.r if keep else o.r)
    # both sides are loaded before the choice: a load on one side only would keep the loop over lanes scalar
    z, phi, theta, psi, energy = (
        b.integral_z[i],
        b.integral_phi[i],
        b.integral_theta[i],
        b.integral_psi[i],
        b.energy[i],
    )
    saved_z, saved_phi, saved_theta = b.saved_integral_z[i], b.saved_integral_phi[i], b.saved_integral_theta[i]
    saved_psi, saved_energy = b.saved_integral_psi[i], b.saved_energy[i]
    b.integral_z[i] = z if keep else saved_z
    b.integral_phi[i] = phi if keep else saved_phi
    b.integral_theta[i] = theta if keep else saved_theta
    b.integral_psi[i] = psi if keep else saved_psi
    b.energy[i] = energy if keep else saved_energy
