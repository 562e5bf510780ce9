"""The one stop check: can a reference be followed to rest in known free space, and if not, what can instead.

CL-RRT, the shield, and training behind the shield ask here, with one set of constants. A stop is verified when the
vehicle comes to rest: slow, level, outside the transition zone, and under water not carried into anything by what is
left of its sway. Rest under water does not last, so what is held is verified again, and given up for a retreat when it
is not safe any more.
"""

from typing import Any, NamedTuple

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import shifted, view
from hydrone_gym.control.reference import clamp
from hydrone_gym.physics.kinematics import State
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rollout import Lane, propagate
from hydrone_gym.simulation.storage import REFERENCE, VESSEL, Pose
from hydrone_gym.surface import is_air
from planners.clearance import clearance_between

AIR_GATE = 1.1  # m above the surface: crossings begin or end here; from 1.4 m the exit would lie beyond sensing
WATER_GATE = 1.0  # m below the surface

HELD = -1  # what was verified last goes on
RETREAT = -2  # nor is that safe any more: the vehicle turns under water and swims against its drift
MARGIN = 0.05  # m of clearance that a stop keeps: what an estimate of the position may be wrong by
GIVE = 0.002  # m: how much nearer than now a vehicle within the margin may come; more would add up
LEAST_MARGIN = 0.005  # m
LOOK_AHEAD = 6.0  # s that a stop is simulated for: from 2 m/s in air it takes 4.5, out of the water 5.5
_RETREAT_AHEAD = 10.0  # s that a retreat is simulated for: a quarter turn takes five
_RETREAT = 1.0  # m against the drift: beyond the hold radius, within which nobody drives
_TURNS = (0.0, 0.6, -0.6, 1.2, -1.2)  # rad from the direction against the drift, tried in this order
_OBLIQUELY = ((2.3, 0.35), (2.3, -0.35), (-2.3, 0.35), (-2.3, -0.35))  # m ahead or astern, rad off the bow
_REST = 0.03  # m/s: slower than this is rest, but for the drift under water
_LEVEL = 0.02  # rad and rad/s: who is tilted more stands still for a moment only
_DRIFT = 12.0  # s: sway is unactuated in water, so what is left of it at the end of a stop goes on for a while
_CARRIED = 2.0  # s: the same in a current, which moves on what has been looked at for as long as a stop is
_WALL = 0.1  # m: references keep this far inside the box
_NEARER = 0.5  # share of its distance from the walls that a vehicle near one may use up
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
    wall: float  # m that it may come near to the walls, whatever it should keep
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
def _from_walls(w, s):
    """Distance (m) of a place from the nearest wall."""
    across = min(min(s.x - w.x_min, w.x_max - s.x), min(s.y - w.y_min, w.y_max - s.y))
    return min(across, min(s.z - w.z_min, w.z_max - s.z))


@inlined
def keeps_room(check, vessel, seconds):
    """Whether a vehicle keeps its distance from the walls; in still weather that is for the outcome to say."""
    if check.lane.weathered == 0:
        return True
    return _from_walls(check.world, state_of(vessel)) >= min(check.room + astray(check, seconds), check.wall)


@inlined
def wall_near(vessel, world):
    """How near to the walls (m) a vehicle may come, whatever it should keep: who is near must be free to move."""
    return _NEARER * _from_walls(world, state_of(vessel))


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
def hover_reference(check, vessel):
    """Anchor a hover at the vehicle, a little ahead along its velocity: the safety action."""
    s = state_of(vessel)
    air = is_air(s.z)
    ahead = check.envelope.ahead_air if air else check.envelope.ahead_water
    psi = view(vessel, REFERENCE, Pose).psi if air else s.psi
    z = s.z + ahead * s.vz
    z = max(z, AIR_GATE) if air else min(z, -WATER_GATE)
    x, y, z = inside(check, s.x + ahead * s.vx, s.y + ahead * s.vy, z)
    return single(x, y, z, psi)


@routine
def follow(check, start, end, reference, seconds):
    """Fly a vessel toward a reference for one period, some time after it began to fly.

    Returns (whether that is safe, arrives, passes the surface).
    """
    flown = propagate(check.lane, start, end, check.goal, reference)
    smooth = flown.lateral_speed <= check.world.rough_speed and flown.cos_tilt >= check.world.rough_cos_tilt
    arrives = flown.outcome == GOAL
    on = flown.outcome == RUNNING or arrives
    seconds += check.period
    apart = flown.clearance >= margin_after(check, seconds) and keeps_room(check, end, seconds)
    safe = on and apart and smooth and sensed(check, end)
    return safe, arrives, flown.crossings > 0.0


@inlined
def _slow(s):
    return s.vx * s.vx + s.vy * s.vy + s.vz * s.vz < _REST * _REST


@inlined
def _resting(check, s, hover, was_slow):
    """Whether a state that a hover has been flown to for a period stays: slow, level, not about to drive.

    In wind a vehicle at rest leans as much as the wind pushes. There it is level enough if it did not gain speed.
    """
    dx, dy, hold = hover[0] - s.x, hover[1] - s.y, check.envelope.hold_radius
    tilt2 = s.phi * s.phi + s.theta * s.theta
    tilt2 = 0.0 if check.lane.weathered > 0 and was_slow else tilt2
    level = tilt2 + s.p * s.p + s.q * s.q < _LEVEL * _LEVEL
    return _slow(s) and level and abs(s.z) > check.world.zone and (is_air(s.z) or dx * dx + dy * dy < hold * hold)


@routine
def rests(check, vessel, hover, seconds, after):
    """Whether a vessel comes to rest safely at a hover within some time; it is flown in place.

    `after` is how long it has been flying (s).

    It passes the surface only if the hover lies on the other side. In a current nothing rests under water: there it is
    enough that the vehicle is safe all that time and, carried on, for a while after.
    """
    resting, stays = False, is_air(state_of(vessel).z) == is_air(hover[2])
    for _ in range(int(np.ceil(seconds / check.period))):
        was_slow = _slow(state_of(vessel))
        safe, arrives, crosses = follow(check, vessel, vessel, hover, after)
        after += check.period
        if arrives or not safe or (crosses and stays):
            return safe and not (crosses and stays)
        resting = _resting(check, state_of(vessel), hover, was_slow)
        if resting:
            break
    s, w = state_of(vessel), check.world
    if is_air(s.z):
        return resting
    drift = _DRIFT if resting or check.lane.weathered == 0 else _CARRIED
    x, y = s.x + drift * s.vx, s.y + drift * s.vy
    if not (w.x_min < x < w.x_max and w.y_min < y < w.y_max):
        return False
    near = clearance_between((s.x, s.y, s.z), (x, y, s.z), check.lane, 0, check.radius)
    return near >= margin_after(check, after)


@routine
def _gets_away(check, vessel, seconds, after):
    """Return (whether a vessel in a current gets away ahead or astern, the reference); the vessel stays as it is.

    Who turns against a current first is carried along meanwhile; obliquely to it full thrust takes effect at once.
    """
    s, spare = state_of(vessel), shifted(check.scratch, VESSEL)
    away = single(s.x, s.y, s.z, s.psi)
    for along, turn in _OBLIQUELY:
        sine, cosine = sincos(s.psi + turn)
        x, y, z = inside(check, s.x + along * cosine, s.y + along * sine, min(s.z, -WATER_GATE))
        away = single(x, y, z, s.psi)
        copy_vessel(vessel, spare)
        if rests(check, spare, away, seconds, after):
            return True, away
    return False, away


@routine
def can_hover(check, vessel, after):
    """Return (whether a vessel can hover to rest on its side of the surface, the hover); the vessel stays as it is."""
    spare, hover = shifted(check.scratch, VESSEL), hover_reference(check, vessel)
    copy_vessel(vessel, spare)
    if rests(check, spare, hover, LOOK_AHEAD, after):
        return True, hover
    if check.lane.weathered > 0 and not is_air(state_of(vessel).z):
        return _gets_away(check, vessel, LOOK_AHEAD, after)
    return False, hover


@routine
def can_stop(check, vessel, after):
    """Return (whether a vessel can come to rest, the hover that does it); the vessel is left as it is.

    Near the surface there are two ways to stop: go back to the side one is on, or finish the crossing. The second one
    is for those who have no plan of crossings: a planner that counted on it would enter the zone anywhere.
    """
    spare = shifted(check.scratch, VESSEL)
    stops, hover = can_hover(check, vessel, after)
    if stops or abs(state_of(vessel).z) > AIR_GATE:
        return stops, hover
    hover = single(hover[0], hover[1], -WATER_GATE if is_air(hover[2]) else AIR_GATE, hover[3])
    copy_vessel(vessel, spare)
    return rests(check, spare, hover, LOOK_AHEAD, after), hover


@routine
def verify(check, vessel, reference):
    """Return (whether a reference can be followed to rest, the hover that does it); the vessel is left as it is."""
    end = check.scratch
    safe, arrives, _ = follow(check, vessel, end, reference, 0.0)
    if arrives or not safe:
        return safe, hover_reference(check, end)
    return can_stop(check, end, check.period)


@inlined
def _careless(check):
    """The same check, but for margins: nothing may be touched."""
    c, tight = check, LEAST_MARGIN
    return Check(
        c.lane, c.goal, c.eye, c.world, c.envelope, c.radius, tight, tight, 0.0, 0.0, c.tube, c.since, c.period, c.scratch
    )


@routine
def goes_on(check, vessel, held):
    """Return (HELD or RETREAT, the reference to go on with) for a vehicle that holds a reference.

    Under water a hover drifts, so what was safe when it was verified may no longer be; then the vehicle swims against
    the drift, as nearly as is free, in a current also obliquely to it, ahead or astern, which needs no turn first.
    While it turns it may come nearer to spheres than the margin. In weather who has begun to rise out of the water is
    not called back: at the surface current and waves carry it along.
    """
    s, spare = state_of(vessel), shifted(check.scratch, VESSEL)
    if is_air(s.z) or (check.lane.weathered > 0 and is_air(held[2])):
        return HELD, held
    copy_vessel(vessel, spare)
    if rests(check, spare, held, _RETREAT_AHEAD, 0.0):
        return HELD, held
    near = _careless(check)
    if check.lane.weathered > 0:
        gets_away, away = _gets_away(near, vessel, _RETREAT_AHEAD, 0.0)
        if gets_away:
            return RETREAT, away
    scale = -_RETREAT / max(np.sqrt(s.vx * s.vx + s.vy * s.vy), 1e-9)
    for turn in _TURNS:
        sine, cosine = sincos(turn)
        x, y = s.x + scale * (cosine * s.vx - sine * s.vy), s.y + scale * (sine * s.vx + cosine * s.vy)
        x, y, z = inside(check, x, y, min(s.z, -WATER_GATE))
        back = single(x, y, z, s.psi)
        copy_vessel(vessel, spare)
        if rests(near, spare, back, _RETREAT_AHEAD, 0.0):
            return RETREAT, back
    return HELD, held


__all__ = ["HELD", "RETREAT", "Check", "can_hover", "can_stop", "follow", "goes_on", "rests", "verify"]
