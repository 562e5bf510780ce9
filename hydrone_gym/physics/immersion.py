"""What the nominal equations leave out: a hull that is partly under water, moving fluids, rotors that lag.

The nominal model switches from air to water at a point, knows no wind and no current, and turns its rotors at once.
Here s, the submerged share of the hull, goes from 0 to 1 over the hull's height; the equations stay those of
`hydrone_gym.physics` with coefficients between those of the two media, plus forces that vanish in a fluid at rest.

    m'(s) = (1 − s) m'_air + s m'_water                 mass with added mass
    weight, restoring moment, 1/J', ρN/J'               by s
    ρC/m'                                               by the share σ = s m'_water / m'(s): force over mass, exactly
    thrust of aerial rotor i: by 1 − s_i, of aquatic rotor i: by s_i, its own share
    drag on the velocity relative to air and water, by their densities' shares
    + s (ρ a_m + ρ V) u̇                                 the water's acceleration: added mass and displaced water
    − ṁ v_r + ½ (dm'/dz) |v_r|² e_z                     added mass that comes and goes: the equations of a body whose
                                                        kinetic energy is ½ m'(z) |v_r|²
    − Σ k_d Ω_i (v − air, in the rotors' plane)         rotor drag, by 1 − s_i

A hull without height (the default) is in air or in water, as the nominal one is, and its numbers are the nominal
model's bit for bit when nothing moves.
"""

import math
from typing import NamedTuple

from hydrone_gym._jit import inlined, shared
from hydrone_gym.physics.dynamics import BodyAcceleration, acceleration, integrate
from hydrone_gym.physics.kinematics import to_body
from hydrone_gym.physics.parameters import MediumParams
from hydrone_gym.physics.rotors import Wrench, rotor_wrench
from hydrone_gym.surface import is_air
from hydrone_gym.vehicle import AIR_DENSITY, WATER_DENSITY

_RADIANS = 2.0 * math.pi / 60.0  # rad/s in a rpm


class Unmodelled(NamedTuple):
    """The numbers of a vehicle that the nominal equations do not have."""

    mass_air: float  # with added mass, kg
    mass_water: float
    entrained: float  # added mass and displaced water, kg: what the water's acceleration pushes along
    inverse_height: float  # of the hull, 1/m; 0 for an abrupt surface
    keep_air: float  # share of a rotor's error that lag leaves after a physics step
    mean_air: float  # share of it that is left on average in the step
    keep_water: float
    mean_water: float
    rotor_drag: float  # N/(m/s)/rpm of a rotor
    curve_0: float  # thrust of an aquatic rotor: (curve_0 + curve_1 |Ω| + curve_2 Ω²) Ω |Ω|, N
    curve_1: float
    curve_2: float
    near_water_radius: float  # R, m
    medium_delay: float  # s


class Fluid(NamedTuple):
    """Air and water around a vehicle in the middle of a tick, and how they change."""

    air_x: float  # m/s
    air_y: float
    air_z: float
    air_rate_x: float  # m/s^2
    air_rate_y: float
    air_rate_z: float
    water_x: float  # m/s
    water_y: float
    water_z: float
    water_rate_x: float  # m/s^2
    water_rate_y: float
    water_rate_z: float
    elevation: float  # of the surface above its mean, m
    elevation_rate: float  # as the vehicle sees it, m/s
    near_water: float  # factor of thrust in air, that of the near water


class Rotors(NamedTuple):
    """Speeds of the rotors that are driven, rpm; those of the other medium stand still."""

    first: float
    second: float
    third: float
    fourth: float


@shared
def lag(time, dt):
    """Return what a first-order lag of a time constant leaves of an error after a step, and on average in it; s."""
    keep = math.exp(-dt / time) if time > 0.0 else 0.0
    return keep, (1.0 - keep) * time / dt


@shared
def unmodelled_of(hull, dt):
    """Work out the `Unmodelled` of a `Hull` for a physics step (s)."""
    air, water = lag(hull.rotor_lag_air, dt), lag(hull.rotor_lag_water, dt)
    constant = hull.thrust_water_curve_0 == 0.0
    return Unmodelled(
        hull.mass + hull.added_mass * AIR_DENSITY,
        hull.mass + hull.added_mass * WATER_DENSITY,
        (hull.added_mass + hull.volume) * WATER_DENSITY,
        1.0 / hull.height if hull.height > 0.0 else 0.0,
        air[0],
        air[1],
        water[0],
        water[1],
        hull.rotor_drag * _RADIANS,
        WATER_DENSITY * (hull.thrust_water if constant else hull.thrust_water_curve_0),
        WATER_DENSITY * hull.thrust_water_curve_1,
        WATER_DENSITY * hull.thrust_water_curve_2,
        hull.near_water_radius,
        hull.medium_delay,
    )


@inlined
def water_at(fluid, after):
    """Return the water's velocity (x, y, z in m/s) so many seconds from the middle of the tick."""
    return (
        fluid.water_x + after * fluid.water_rate_x,
        fluid.water_y + after * fluid.water_rate_y,
        fluid.water_z + after * fluid.water_rate_z,
    )


@inlined
def elevation_at(fluid, after):
    """Return the surface's elevation (m) so many seconds from the middle of the tick."""
    return fluid.elevation + after * fluid.elevation_rate


@inlined
def submerged_share(height, inverse_height):
    """Return the share of a hull that is under water when its middle is a height (m) above the water."""
    share = 0.5 - height * inverse_height
    share = share if share > 0.0 else 0.0
    share = share if share < 1.0 else 1.0
    abrupt = 0.0 if is_air(height) else 1.0
    return share if inverse_height > 0.0 else abrupt


@inlined
def between(air, water, share):
    """Return what lies between a coefficient in air and in water; exactly one of them at its end."""
    return (1.0 - share) * air + share * water


@inlined
def shares_of(share, real):
    """Return the water's shares of the mass with added mass, and of the density, of a hull with a submerged share."""
    dry, heavy, dense = 1.0 - share, share * real.mass_water, share * WATER_DENSITY
    mass, density = dry * real.mass_air + heavy, dry * AIR_DENSITY + dense
    inverse = 1.0 / (mass * density)  # divisions take most of a physics step: one for both
    return 1.0 if share == 1.0 else heavy * (density * inverse), dense * (mass * inverse)


@inlined
def blended(vehicle, driven, share, mass_share):
    """Return the `MediumParams` of a partly submerged hull; rotors are those of the medium they are driven for."""
    air, water = vehicle.air, vehicle.water
    return MediumParams(
        between(air.weight, water.weight, share),
        between(air.inverse_mass, water.inverse_mass, mass_share),
        between(air.inverse_inertia_x, water.inverse_inertia_x, share),
        between(air.inverse_inertia_y, water.inverse_inertia_y, share),
        between(air.inverse_inertia_z, water.inverse_inertia_z, share),
        between(air.drag_x, water.drag_x, mass_share),
        between(air.drag_y, water.drag_y, mass_share),
        between(air.drag_z, water.drag_z, mass_share),
        between(air.rotational_drag_x, water.rotational_drag_x, share),
        between(air.rotational_drag_y, water.rotational_drag_y, share),
        between(air.rotational_drag_z, water.rotational_drag_z, share),
        between(air.restoring, water.restoring, share),
        air.thrust if driven else water.thrust,
        air.power if driven else water.power,
        air.rotor_min if driven else water.rotor_min,
        air.rotor_max if driven else water.rotor_max,
    )


@inlined
def lagged(rotors, wanted, keep):
    """Return the speeds (rpm) after a lag has left a share of their errors."""
    return Rotors(
        wanted[0] + (rotors.first - wanted[0]) * keep,
        wanted[1] + (rotors.second - wanted[1]) * keep,
        wanted[2] + (rotors.third - wanted[2]) * keep,
        wanted[3] + (rotors.fourth - wanted[3]) * keep,
    )


@inlined
def _dry(height, inverse_height, share):
    """Share of a rotor's disc in air; with an abrupt surface that of the hull, as in the nominal model."""
    return 1.0 - (submerged_share(height, inverse_height) if inverse_height > 0.0 else share)


@inlined
def near_water_factor(height, radius):
    """Return the factor of thrust of rotors of a radius R (m) a height h (m) above the water: 1 + (R / 4h)², h ≥ R."""
    above = height if height > radius else radius
    near = radius / (4.0 * above) if above > 0.0 else 0.0
    return 1.0 + near * near


@inlined
def _rotors(attitude, speeds, height, share, vehicle, real, fluid, driven):
    """Return four thrusts (N), and the sum of speed (rpm) times share in air that rotor drag goes with."""
    pitch = -attitude.c_phi * attitude.s_theta * vehicle.arm
    roll = attitude.s_phi * vehicle.arm
    steep = real.inverse_height
    dry_1, dry_2 = _dry(height + pitch, steep, share), _dry(height + roll, steep, share)
    dry_3, dry_4 = _dry(height - pitch, steep, share), _dry(height - roll, steep, share)
    constant = vehicle.air.thrust * fluid.near_water if driven else real.curve_0
    linear, square = 0.0 if driven else real.curve_1, 0.0 if driven else real.curve_2
    law = (constant, linear, square, driven)
    thrusts = (
        _thrust(speeds[0], dry_1, law),
        _thrust(speeds[1], dry_2, law),
        _thrust(speeds[2], dry_3, law),
        _thrust(speeds[3], dry_4, law),
    )
    in_air = speeds[0] * dry_1 + speeds[1] * dry_2 + speeds[2] * dry_3 + speeds[3] * dry_4
    return thrusts, in_air if driven else 0.0


@inlined
def _thrust(speed, dry, law):
    """Thrust (N) of one rotor of which a share is in air."""
    constant, linear, square, driven = law
    size = abs(speed)
    return (constant + (linear + square * size) * size) * speed * size * (dry if driven else 1.0 - dry)


@inlined
def _water_force(state, fluid, water, share, real):
    """Force (N, world) of the water's acceleration, and of added mass that comes and goes."""
    gained = (real.mass_water - real.mass_air) * real.inverse_height
    gained = gained if share > 0.0 and share < 1.0 else 0.0  # kg/m: −dm'/dz
    x, y, z = state.vx - water[0], state.vy - water[1], state.vz - water[2]
    rise = gained * (state.vz - fluid.elevation_rate)
    pushed = share * real.entrained
    lift = rise * z - 0.5 * gained * (x * x + y * y + z * z)
    return (
        pushed * fluid.water_rate_x + rise * x,
        pushed * fluid.water_rate_y + rise * y,
        pushed * fluid.water_rate_z + lift,
    )


@inlined
def immersed_step(state, attitude, speeds, vehicle, real, fluid, driven, after, dt):
    """Advance the state by dt seconds, `after` seconds from the middle of the tick that `fluid` describes.

    Args:
        state, attitude: of the vehicle.
        speeds: mean rotor speeds over the step, rpm; a fifth is that of all aerial rotors where others are driven.
        vehicle, real: `VehicleParams` and `Unmodelled` of the vehicle as it is.
        fluid: `Fluid`.
        driven: whether the aerial rotors are driven.
        after: s.
        dt: s.

    Returns:
        The new state, and the `MediumParams` it was flown with.
    """
    later = after + 0.5 * dt
    air = (
        fluid.air_x + later * fluid.air_rate_x,
        fluid.air_y + later * fluid.air_rate_y,
        fluid.air_z + later * fluid.air_rate_z,
    )
    water = water_at(fluid, later)
    height = state.z - elevation_at(fluid, after)
    share = submerged_share(height, real.inverse_height)
    mass_share, dense = shares_of(share, real)
    medium = blended(vehicle, driven, share, mass_share)
    thrusts, turning = _rotors(attitude, speeds, height, share, vehicle, real, fluid, driven)
    fx, fy, fz = _water_force(state, fluid, water, share, real)
    wrench = rotor_wrench(vehicle, driven, thrusts)
    beside = 4.0 * vehicle.air.thrust * speeds[4] * speeds[4] * (1.0 - share)
    wrench = Wrench(wrench.fx, wrench.fz + beside, wrench.mx, wrench.my, wrench.mz)
    a = acceleration(state, attitude, wrench, (fx, fy, fz - medium.weight), vehicle, medium)
    around = to_body(
        attitude,
        between(air[0], water[0], dense),
        between(air[1], water[1], dense),
        between(air[2], water[2], dense),
    )
    bx, by, _ = to_body(attitude, state.vx - air[0], state.vy - air[1], state.vz - air[2])
    flapping = real.rotor_drag * turning * medium.inverse_mass
    a = BodyAcceleration(a.x - flapping * bx, a.y - flapping * by, a.z, a.roll, a.pitch, a.yaw)
    return integrate(state, attitude, a, medium, around, dt), medium
