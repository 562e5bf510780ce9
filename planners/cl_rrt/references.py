"""Where an edge sends the reference: linear steps in air, a carrot in water, a hover for stopping."""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.trigonometry import sincos
from planners.cl_rrt.stopping import AHEAD_AIR, AHEAD_WATER

AIR_GATE = 1.1  # m above the surface: crossings begin or end here; from 1.4 m the exit would lie beyond sensing
WATER_GATE = 1.0  # m below the surface
_LEAD = 1.5  # m the reference may be ahead of the vehicle: a reference that runs away drags it through obstacles
_CLIMB = 0.6  # m of height an edge of 0.5 s may change
_CARROT_TIME = 1.4  # s of travel ahead under water
_CARROT_TURNING = 0.6  # m ahead while misaligned: beyond the hold radius, too near to swim an arc
_ALIGNED = 0.94  # cosine of the misalignment (20 degrees) below which the vehicle turns in place
_WALL = 0.1  # m: references keep this far inside the box


@inlined
def inside(value, low, high):
    """Keep a coordinate inside the box."""
    return clamp(value, low + _WALL, high - _WALL)


@inlined
def air_reference(node, gx, gy, gz, psi, model, step, period):
    """Step the reference linearly toward a point in air, at most `step` m on and `_LEAD` from the vehicle."""
    w = model.world
    x, y, z = node.state[0], node.state[1], node.state[2]
    ox, oy, oz = node.reference[0], node.reference[1], node.reference[2]
    dx, dy, dz = gx - ox, gy - oy, gz - oz
    across = np.sqrt(dx * dx + dy * dy)
    scale = min(1.0, step / max(across, 1e-9), _CLIMB * period / 0.5 / max(abs(dz), 1e-9))
    rx, ry, rz = ox + scale * dx, oy + scale * dy, oz + scale * dz
    lx, ly, lz = rx - x, ry - y, rz - z
    lead = np.sqrt(lx * lx + ly * ly + lz * lz)
    if lead > _LEAD:
        rx, ry, rz = x + lx * _LEAD / lead, y + ly * _LEAD / lead, z + lz * _LEAD / lead
    rz = max(rz, AIR_GATE)
    return inside(rx, w.x_min, w.x_max), inside(ry, w.y_min, w.y_max), inside(rz, w.z_min, w.z_max), psi


@inlined
def water_reference(node, gx, gy, gz, speeds, model, period):
    """Place a carrot ahead of the vehicle toward a point in water: from the state, never from the old reference."""
    w = model.world
    x, y, z, psi = node.state[0], node.state[1], node.state[2], node.state[5]
    dx, dy = gx - x, gy - y
    distance = np.sqrt(dx * dx + dy * dy)
    sine, cosine = sincos(psi)
    along = abs(dx * cosine + dy * sine) / max(distance, 1e-9)  # the vehicle drives both ways
    ahead = speeds.water * _CARROT_TIME if along > _ALIGNED else _CARROT_TURNING
    scale = min(1.0, ahead / max(distance, 1e-9))
    climb = speeds.dive * period * 2.0
    rz = min(z + clamp(gz - z, -climb, climb), -WATER_GATE)
    return (
        inside(x + scale * dx, w.x_min, w.x_max),
        inside(y + scale * dy, w.y_min, w.y_max),
        inside(rz, w.z_min, w.z_max),
        psi,
    )


@inlined
def hover_reference(node, model):
    """Anchor a hover at the vehicle, a little ahead along its velocity: the safety action."""
    w = model.world
    s = node.state
    air = s[2] > 0.0
    ahead = AHEAD_AIR if air else AHEAD_WATER
    psi = node.reference[3] if air else s[5]
    rz = s[2] + ahead * s[8]
    rz = max(rz, AIR_GATE) if air else min(rz, -WATER_GATE)
    return (
        inside(s[0] + ahead * s[6], w.x_min, w.x_max),
        inside(s[1] + ahead * s[7], w.y_min, w.y_max),
        inside(rz, w.z_min, w.z_max),
        psi,
    )
