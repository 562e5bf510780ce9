"""What a vehicle goes on with that holds a reference, because nothing else is safe or because it is at the surface.

Rest under water does not last, so what is held is verified again, and given up for a retreat when it is not safe any
more. In weather a crossing that has begun goes on: who turns back is carried about by waves.
"""

import numpy as np

from hydrone_gym._jit import inlined, routine
from hydrone_gym._memory import shifted
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.storage import VESSEL
from hydrone_gym.surface import is_air
from planners.check import AIR_GATE, WATER_GATE, careless, copy_vessel, inside, single, state_of
from planners.stop_check import COMMITTED, LOOK_AHEAD, can_hover, gets_away, rests, room_after

HELD = -1  # what was verified last goes on
RETREAT = -2  # nor is that safe any more: the vehicle turns under water and swims against its drift
_RETREAT_AHEAD = 10.0  # s that a retreat is simulated for: a quarter turn takes five
_RETREAT = 1.0  # m against the drift: beyond the hold radius, within which nobody drives
_TURNS = (0.0, 0.6, -0.6, 1.2, -1.2)  # rad from the direction against the drift, tried in this order
_BETTER = 0.1  # m farther from everything: worth a change of mind
_AFLOAT = 0.3  # m/s sideways: who is faster does not get under water, and climbs out again


@inlined
def crosses(check, vessel, held):
    """Whether a vehicle in weather is so near the surface that what it does there goes on."""
    near = check.lane.weathered > 0 and abs(state_of(vessel).z) < COMMITTED
    return near and (held[2] >= AIR_GATE or held[2] <= -WATER_GATE)


@inlined
def dips(check, vessel, hover):
    """Return the hover of a vehicle in air; in weather, of one that is already at the surface on its way down, below.

    Whether that one is smooth is not asked: waves decide that by now, and who turns back is carried about by them.
    """
    s = state_of(vessel)
    down = check.lane.weathered > 0 and is_air(s.z) and s.z < COMMITTED and not is_air(check.goal.z)
    return (hover[0], hover[1], -WATER_GATE if down else hover[2], hover[3])


@routine
def _held_in_air(check, vessel, held):
    """Return what a vehicle goes on with that is in air, or on its way there: what it holds, or a hover where it is.

    What was verified for a vehicle that comes out of the water somewhere may be the wrong thing where it came out.
    """
    s = state_of(vessel)
    if not is_air(s.z):
        return held
    slow = s.vx * s.vx + s.vy * s.vy < _AFLOAT * _AFLOAT
    if s.z < COMMITTED and not is_air(held[2]) and (slow or s.vz <= 0.0):
        return held
    came_out = s.vz > 0.0 and not is_air(held[2])
    spare = shifted(check.scratch, VESSEL)
    copy_vessel(vessel, spare)
    if not came_out and rests(check, spare, held, LOOK_AHEAD, 0.0):
        return held
    hovers, hover = can_hover(check, vessel, 0.0)
    return hover if hovers else held


@routine
def goes_on(check, vessel, held):
    """Return (HELD or RETREAT, the reference to go on with) for a vehicle that holds a reference.

    Under water a hover drifts, so what was safe when it was verified may no longer be; then the vehicle swims against
    the drift, as nearly as is free, in a current also obliquely to it, ahead or astern, which needs no turn first.
    While it turns it may come nearer to spheres than the margin. In weather who has begun to rise out of the water is
    not called back: at the surface current and waves carry it along.
    """
    s, spare = state_of(vessel), shifted(check.scratch, VESSEL)
    if check.lane.weathered > 0 and (is_air(s.z) or is_air(held[2])):
        return HELD, _held_in_air(check, vessel, held)
    if is_air(s.z):
        return HELD, held
    copy_vessel(vessel, spare)
    if rests(check, spare, held, _RETREAT_AHEAD, 0.0):
        return HELD, held
    near = careless(check)
    if check.lane.weathered > 0:
        room = room_after(near, vessel, held, 0.0) + _BETTER  # who changes its mind stays where it is
        away_safely, away = gets_away(near, vessel, held, room, 0.0)
        if away_safely:
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


__all__ = ["HELD", "RETREAT", "crosses", "dips", "goes_on"]
