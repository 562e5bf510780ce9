"""Where an edge sends the reference: linear steps in air, a carrot in water."""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym._memory import view
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.storage import REFERENCE, Pose
from planners.check import AIR_GATE, WATER_GATE, inside, state_of

_LEAD = 0.75  # s at cruise speed it may be ahead: a reference that runs away drags the vehicle through obstacles
_CARROT_TURNING = 0.6  # m ahead while misaligned: beyond the hold radius, too near to swim an arc
_ALIGNED = 0.94  # cosine of the misalignment (20 degrees) below which the vehicle turns in place


@inlined
def air_reference(p, vessel, aim, psi, step):
    """Step the reference linearly toward a point in air, at most `step` m on and `_LEAD` from the vehicle."""
    s, old = state_of(vessel), view(vessel, REFERENCE, Pose)
    dx, dy, dz = aim.x - old.x, aim.y - old.y, aim.z - old.z
    across = np.sqrt(dx * dx + dy * dy)
    scale = min(1.0, step / max(across, 1e-9), p.objective.lead.climb / max(abs(dz), 1e-9))
    rx, ry, rz = old.x + scale * dx, old.y + scale * dy, old.z + scale * dz
    lx, ly, lz = rx - s.x, ry - s.y, rz - s.z
    lead = np.sqrt(lx * lx + ly * ly + lz * lz)
    most = _LEAD * p.check.envelope.cruise
    if lead > most:
        rx, ry, rz = s.x + lx * most / lead, s.y + ly * most / lead, s.z + lz * most / lead
    rx, ry, rz = inside(p.check, rx, ry, max(rz, AIR_GATE))
    return rx, ry, rz, psi


@inlined
def water_reference(p, vessel, aim):
    """Place a carrot ahead of the vehicle toward a point in water: from the state, never from the old reference."""
    s, o = state_of(vessel), p.objective
    dx, dy = aim.x - s.x, aim.y - s.y
    distance = np.sqrt(dx * dx + dy * dy)
    sine, cosine = sincos(s.psi)
    along = abs(dx * cosine + dy * sine) / max(distance, 1e-9)  # the vehicle drives both ways
    ahead = o.lead.ahead if along > _ALIGNED else _CARROT_TURNING
    scale = min(1.0, ahead / max(distance, 1e-9))
    # where joules count it dives or rises gently, all along the way
    slope = min(1.0, o.speeds.water * p.check.period / max(distance, 1e-9)) if o.per_joule > 0.0 else 1.0
    rz = min(s.z + clamp(slope * (aim.z - s.z), -o.lead.down, o.lead.up), -WATER_GATE)
    rx, ry, rz = inside(p.check, s.x + scale * dx, s.y + scale * dy, rz)
    return rx, ry, rz, s.psi
