"""The one stop check: can a reference be followed to rest in known free space, and if not, what can instead.

CL-RRT, the shield, and training behind the shield ask here, with one set of constants. A stop is verified when the
vehicle comes to rest: slow, level, outside the transition zone, and under water not carried into anything by what is
left of its sway. What a vehicle goes on with when nothing is verified is in `planners.hold`.
"""

import math

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import gather, shifted, view
from hydrone_gym.physics.immersion import Fluid
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.conditions import AT as CONDITIONS_AT
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rollout import propagate
from hydrone_gym.simulation.storage import REFERENCE, VESSEL, Pose
from hydrone_gym.surface import is_air
from planners.check import (
    AIR_GATE,
    WATER_GATE,
    Check,
    copy_vessel,
    from_walls,
    inside,
    keeps_room,
    margin_after,
    room_to_cross,
    sensed,
    single,
    state_of,
)
from planners.clearance import clearance_between

LOOK_AHEAD = 6.0  # s that a stop is simulated for: from 2 m/s in air it takes 4.5, out of the water 5.5
_OBLIQUELY = tuple((along, turn) for turn in (0.35, -0.35, 0.8, -0.8) for along in (1.9, -1.9))  # m, rad off the bow
_SMOOTH = 0.5  # share of a rough crossing's speed that one may have in weather, where waves add to it
_RISING = 0.12  # m/s through the water that a vehicle may have sideways when it begins to rise out of it
COMMITTED = 0.4  # m from the surface: nearer, a crossing goes on
_REST = 0.03  # m/s: slower than this is rest, but for the drift under water
_LEVEL = 0.02  # rad and rad/s: who is tilted more stands still for a moment only
_DRIFT = 12.0  # s: sway is unactuated in water, so what is left of it at the end of a stop goes on for a while
_CARRIED = 2.0  # s: the same in a current, which moves on what has been looked at for as long as a stop is


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
    most = check.world.rough_speed * (_SMOOTH if check.lane.weathered > 0 else 1.0)
    smooth = flown.lateral_speed <= most and flown.cos_tilt >= check.world.rough_cos_tilt
    arrives = flown.outcome == GOAL
    on = flown.outcome == RUNNING or arrives
    seconds += check.period
    apart = flown.clearance >= margin_after(check, seconds) and keeps_room(check, end)
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
def room_after(check, vessel, reference, after):
    """How far (m) from the nearest wall or known obstacle a vessel comes to rest at a reference, -inf if not safely.

    The vessel stays as it is.
    """
    spare = shifted(check.scratch, VESSEL)
    copy_vessel(vessel, spare)
    if not rests(check, spare, reference, LOOK_AHEAD, after):
        return -math.inf
    s = state_of(spare)
    clearance = clearance_between((s.x, s.y, s.z), (s.x, s.y, s.z), check.lane, 0, check.radius)
    return min(clearance, from_walls(check.world, s) - check.radius)


@routine
def gets_away(check, vessel, held, room, after):
    """Return (whether a vessel in a current gets away from where it is, the reference); the vessel stays as it is.

    Who turns against a current first is carried along meanwhile; obliquely to it full thrust takes effect at once. Of
    the ways that are safe it takes the one that ends farthest from everything, and what it holds unless one ends
    farther than `room` (m), -inf if that is not safe.
    """
    s, best, farthest = state_of(vessel), held, room
    for along, turn in _OBLIQUELY:
        sine, cosine = sincos(s.psi + turn)
        x, y, z = inside(check, s.x + along * cosine, s.y + along * sine, min(s.z, -WATER_GATE))
        away = single(x, y, z, s.psi)
        there = room_after(check, vessel, away, after)
        best, farthest = (away, there) if there > farthest else (best, farthest)
    return farthest > -math.inf, best


@routine
def can_hover(check, vessel, after):
    """Return (whether a vessel can hover to rest on its side of the surface, the hover); the vessel stays as it is."""
    spare, hover = shifted(check.scratch, VESSEL), hover_reference(check, vessel)
    copy_vessel(vessel, spare)
    if rests(check, spare, hover, LOOK_AHEAD, after):
        return True, hover
    if check.lane.weathered > 0 and not is_air(state_of(vessel).z):
        return gets_away(check, vessel, hover, -math.inf, after)
    return False, hover


@routine
def can_stop(check, vessel, after):
    """Return (whether a vessel can come to rest, the hover that does it); the vessel is left as it is.

    Near the surface there are two ways to stop: go back to the side one is on, or finish the crossing. The second one
    is for those who have no plan of crossings: a planner that counted on it would enter the zone anywhere.
    """
    s, spare = state_of(vessel), shifted(check.scratch, VESSEL)
    if check.lane.weathered > 0 and abs(s.z) < check.world.zone:  # who turns back is carried about at the surface
        hover = hover_reference(check, vessel)
        hover = single(hover[0], hover[1], AIR_GATE if s.vz > 0.0 else -WATER_GATE, hover[3])
        copy_vessel(vessel, spare)
        if rests(check, spare, hover, LOOK_AHEAD, after):
            return True, hover
    stops, hover = can_hover(check, vessel, after)
    if stops or abs(state_of(vessel).z) > AIR_GATE:
        return stops, hover
    hover = single(hover[0], hover[1], -WATER_GATE if is_air(hover[2]) else AIR_GATE, hover[3])
    copy_vessel(vessel, spare)
    return rests(check, spare, hover, LOOK_AHEAD, after), hover


@inlined
def _nears_surface(check, vessel, end):
    """Whether a vehicle goes on toward the surface inside the transition zone, and need not yet."""
    z, to_z = state_of(vessel).z, state_of(end).z
    return abs(z) > COMMITTED and abs(to_z) < check.world.zone and abs(to_z) < abs(z)


@inlined
def _sideways(check, s):
    """Lateral speed (m/s) through the water that is believed to be around a vehicle that was just flown."""
    fluid = gather(check.lane.weather, CONDITIONS_AT.fluid, 0, 1, Fluid)
    vx, vy = s.vx - fluid.water_x, s.vy - fluid.water_y
    return np.sqrt(vx * vx + vy * vy)


@routine
def verify(check, vessel, reference):
    """Return (whether a reference can be followed to rest, the hover that does it); the vessel is left as it is."""
    end = check.scratch
    safe, arrives, _ = follow(check, vessel, end, reference, 0.0)
    if safe and check.lane.weathered > 0 and _nears_surface(check, vessel, end):
        s = state_of(end)
        safe = room_to_cross(check, s.x, s.y) and (is_air(s.z) or _sideways(check, s) < _RISING)
    if arrives or not safe:
        return safe, hover_reference(check, end)
    return can_stop(check, end, check.period)


__all__ = ["Check", "can_hover", "can_stop", "follow", "gets_away", "rests", "room_after", "verify"]
