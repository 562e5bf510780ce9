"""How the robust law comes to rest, and to the surface.

Nobody reaches the surface faster than the crossing may be, sideways, downwards or tilted: who is too fast comes nearer
as fast as braking takes, and waits before it for the rest, and for a lull of the waves.
"""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.reference import clamp
from hydrone_gym.surface import is_air

HOVER_BAND = 0.15  # m above the surface in which a vehicle waits that is too fast to cross
_EVADING = 4.0  # 1/s: how fast a waiting vehicle goes back up there
_FORESEEN = 0.25  # s for which waves go on as they do
_BRAKED = 0.5  # share of the braking that the approach to the surface reckons with
_SMOOTH = 0.65  # share of the lateral speed of a rough crossing above which a vehicle waits
_TILT_BAND = 0.65  # m above that over which tilt is given back


@inlined
def profile(distance, gain, braking):
    """Return the speed (m/s) to come to rest after a distance (m), and how fast it falls with it (1/s)."""
    near = braking / (gain * gain)
    far = np.sqrt(2.0 * braking * max(distance - 0.5 * near, 0.5 * near))
    return (gain * distance, gain) if distance < near else (far, braking / far)


@inlined
def flow_near(now, world):
    """Velocity and its rate (x, y in m/s and m/s^2) of the water for a vehicle in the transition zone, else zero."""
    water, near = now.surface, abs(now.state.z) <= world.zone
    return (
        water.vx if near else 0.0,
        water.vy if near else 0.0,
        water.ax if near else 0.0,
        water.ay if near else 0.0,
    )


@inlined
def way_left(now, gains):
    """Return how far (m) a vehicle is from where it waits for the surface, and how many seconds it needs there."""
    height = max(abs(now.state.z - now.surface.elevation) - HOVER_BAND, 0.0)
    return height, height / max(abs(now.state.vz), gains.zone_speed_limit)


@inlined
def too_fast(now, gains, flow, seconds, world):
    """Return by how much (m/s) the lateral speed through the water will exceed that of a smooth crossing."""
    soon = min(seconds + HOVER_BAND / gains.zone_speed_limit, _FORESEEN)
    vx, vy = now.state.vx - flow[0] - soon * flow[2], now.state.vy - flow[1] - soon * flow[3]
    return np.sqrt(vx * vx + vy * vy) - _SMOOTH * world.rough_speed


@inlined
def surface_limits(now, gains, flow, world):
    """Return limits above the water: lateral speed (m/s), descent (m/s), and tangent of the tilt.

    Nobody reaches the surface faster than the crossing may be, sideways or downwards: who is too fast comes down as
    fast as braking takes, and waits above the water for the rest, going up again where the surface rises. A little too
    fast is a little slower down: a hull that waits half in the water is tipped over.
    """
    height, seconds = way_left(now, gains)
    excess = too_fast(now, gains, flow, seconds, world)
    smooth = gains.crossing_share * world.rough_speed
    fastest = np.sqrt(gains.zone_speed_limit * gains.zone_speed_limit + 2.0 * gains.zone_braking * height)
    descent, braking = min(fastest, gains.descent_limit), _BRAKED * gains.braking
    below = HOVER_BAND - (now.state.z - now.surface.elevation)
    share = 1.0 - excess / ((1.0 - _SMOOTH) * world.rough_speed)
    nearby = share * fastest if share > 0.0 else -_EVADING * below
    slower = height * gains.braking / excess if below < 0.0 else nearby
    descent = min(descent, slower) if excess > 0.0 else descent
    stays = is_air(now.reference.z)
    limit = gains.speed_limit if stays else min(gains.speed_limit, smooth + braking * seconds)
    cosine = world.rough_cos_tilt
    level = gains.level_share * np.sqrt(1.0 - cosine * cosine) / cosine
    share = clamp(height / _TILT_BAND, 0.0, 1.0)
    return 0.0 if now.vertical else limit, descent, level + (gains.tilt_limit - level) * share
