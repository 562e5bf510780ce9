"""What every stop is checked with, and what it keeps from spheres and walls."""

from typing import Any, NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym._memory import view
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.kinematics import State
from hydrone_gym.simulation.rollout import Lane
from hydrone_gym.simulation.storage import REFERENCE, VESSEL, Pose
from hydrone_gym.surface import is_air
from planners.clearance import clearance_between

OF_DRIFT = 0.5  # share of the drift that spheres are kept at: they are smaller than walls
AIR_GATE = 1.1  # m above the surface: crossings begin or end here; from 1.4 m the exit would lie beyond sensing
WATER_GATE = 1.0  # m below the surface
MARGIN = 0.05  # m of clearance that a stop keeps: what an estimate of the position may be wrong by
GIVE = 0.002  # m: how much nearer than now a vehicle within the margin may come; more would add up
LEAST_MARGIN = 0.005  # m
_WALL = 0.1  # m: references keep this far inside the box
TUBE_STEP = 0.5  # s
TUBE_LENGTH = 14  # steps: a period, the stop after it, and latency


class Check(NamedTuple):
    """What every stop of a vehicle is checked with; pointers and numbers, made in a kernel."""

    lane: Lane
    goal: Any  # view of a `Point`
    eye: Any  # the same: where the obstacles were last sensed from
    world: Any  # view of a `WorldParams`
    envelope: Any  # view of an `Envelope`
    radius: float  # of the vehicle, m
    margin: float  # clearance to keep, m, of a vehicle that is where it is believed to be
    near: float  # clearance it has now, m, less `GIVE`: who is nearer than the margin keeps that
    room: float  # m that a vehicle keeps from the walls, and its references more by `_WALL`
    wall: float  # m that it is from the walls: who is nearer than `room` comes no nearer
    drift: float  # m from the walls, and half as far from spheres, where crossings begin: a current carries it along
    tube: Any  # pointer to how far it may be from where it is believed to be, m, every `TUBE_STEP` after the look
    since: float  # s since that look
    period: float  # s
    scratch: Any  # pointer to room for two vessels


@inlined
def inside(check, x, y, z):
    """Keep the place of a reference inside the box."""
    w, wall = check.world, _WALL + check.room
    return (
        clamp(x, w.x_min + wall, w.x_max - wall),
        clamp(y, w.y_min + wall, w.y_max - wall),
        clamp(z, w.z_min + wall, w.z_max - wall),
    )


@inlined
def place_of(z):
    """Return where a look is from, by height (m): 0 in air, 1 near the surface, 2 in water."""
    return 1 if -WATER_GATE < z < AIR_GATE else 0 if is_air(z) else 2


@inlined
def astray(check, seconds):
    """How far (m) a vehicle may be from where it is believed to be, some time after it began to fly."""
    k = int(np.ceil((check.since + seconds) / TUBE_STEP - 1e-9)) - 1
    return check.tube[max(0, min(k, TUBE_LENGTH - 1))]


@inlined
def margin_after(check, seconds):
    """The clearance (m) to keep some time after a vehicle began to fly."""
    return max(min(check.margin + astray(check, seconds), check.near), LEAST_MARGIN)


@inlined
def from_walls(w, s):
    """Distance (m) of a place from the nearest wall."""
    across = min(min(s.x - w.x_min, w.x_max - s.x), min(s.y - w.y_min, w.y_max - s.y))
    return min(across, min(s.z - w.z_min, w.z_max - s.z))


@inlined
def keeps_room(check, vessel):
    """Whether a vehicle keeps its distance from the walls; in still weather that is for the outcome to say."""
    if check.lane.weathered == 0:
        return True
    return from_walls(check.world, state_of(vessel)) >= min(check.room, check.wall)


@inlined
def single(x, y, z, psi):
    """Round a reference to the precision of the action space: what is checked is what is flown."""
    return (
        np.float64(np.float32(x)),
        np.float64(np.float32(y)),
        np.float64(np.float32(z)),
        np.float64(np.float32(psi)),
    )


@inlined
def state_of(vessel):
    """Look at the `State` of a vessel."""
    return view(vessel, 0, State)


@inlined
def reference_of(vessel):
    """Read the reference in force of a vessel, (x, y, z, psi)."""
    r = view(vessel, REFERENCE, Pose)
    return r.x, r.y, r.z, r.psi


@inlined
def copy_vessel(source, target):
    """Copy a vehicle with its reference."""
    for k in range(VESSEL):
        target[k] = source[k]


@inlined
def clearance_left(vessel, lane, radius):
    """Clearance (m) that a vehicle has now, less `GIVE`.

    Who is nearer to an obstacle than the margin keeps this instead: a vehicle that drifted or stopped within the margin
    could never move again.
    """
    p = state_of(vessel)
    return clearance_between((p.x, p.y, p.z), (p.x, p.y, p.z), lane, 0, radius) - GIVE


@inlined
def sensed(check, vessel):
    """Whether a vehicle is in space sensed from the eye: nothing unknown can be in the way there."""
    s, eye = state_of(vessel), check.eye
    dx, dy, dz = s.x - eye.x, s.y - eye.y, s.z - eye.z
    reach = check.world.sensor_range - check.radius
    return dx * dx + dy * dy + dz * dz <= reach * reach


@inlined
def near_walls(check, x, y, share):
    """Whether a current could carry a vehicle that crosses somewhere into a wall before it swims, or while it rises."""
    w, away = check.world, share * check.drift
    return x - w.x_min < away or w.x_max - x < away or y - w.y_min < away or w.y_max - y < away


@inlined
def room_to_cross(check, x, y):
    """Whether a vertical path through the zone keeps away from walls and from every known obstacle."""
    near = clearance_between((x, y, AIR_GATE), (x, y, -WATER_GATE), check.lane, 0, check.radius)
    return near >= check.margin + OF_DRIFT * check.drift and not near_walls(check, x, y, 1.0)


@inlined
def careless(check):
    """The same check, but for margins: nothing may be touched."""
    c, tight = check, LEAST_MARGIN
    around = (c.lane, c.goal, c.eye, c.world, c.envelope, c.radius)
    return Check(*around, tight, tight, 0.0, 0.0, 0.0, c.tube, c.since, c.period, c.scratch)
