"""The vehicle of an episode: how it is drawn around the nominal one."""

from typing import NamedTuple

from hydrone_gym._jit import inlined
from hydrone_gym.physics.parameters import Hull
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.weather.noise import uniforms
from hydrone_gym.weather.weather import Spread


class SpreadParams(NamedTuple):
    """`Spread` as numbers: relative half-widths, and ranges."""

    mass: float
    thrust: float
    inertia: float
    drag: float
    lag_air_low: float
    lag_air_high: float
    lag_water_low: float
    lag_water_high: float
    rotor_drag_low: float
    rotor_drag_high: float
    height_low: float
    height_high: float


def spread_params(spread: Spread, vehicle: Vehicle) -> SpreadParams:
    """Return the numbers of a spread; what it leaves to the vehicle is the vehicle's own."""
    own = vehicle.rotor_lag_air, vehicle.rotor_lag_water, vehicle.rotor_drag, vehicle.height
    given = spread.rotor_lag_air, spread.rotor_lag_water, spread.rotor_drag, spread.height
    ranges = [end for value, pair in zip(own, given, strict=True) for end in (pair or (value, value))]
    return SpreadParams(spread.mass, spread.thrust, spread.inertia, spread.drag, *ranges)


@inlined
def _factor(width, share):
    return 1.0 + width * (2.0 * share - 1.0)


@inlined
def _within(low, high, share):
    return low + (high - low) * share


@inlined
def draw_hull(hull, spread, key, n):
    """Draw the `Hull` of an episode from the nominal one, with pairs n to n + 5 of a key."""
    mass, air = uniforms(key, n)
    water, inertia_x = uniforms(key, n + 1.0)
    inertia_y, inertia_z = uniforms(key, n + 2.0)
    drag, turning = uniforms(key, n + 3.0)
    lag_air, lag_water = uniforms(key, n + 4.0)
    flapping, height = uniforms(key, n + 5.0)
    in_air, in_water = _factor(spread.thrust, air), _factor(spread.thrust, water)
    moving, rotating = _factor(spread.drag, drag), _factor(spread.drag, turning)
    return Hull(
        hull.mass * _factor(spread.mass, mass),
        hull.gravity,
        hull.arm,
        hull.yaw_arm_air,
        hull.inertia_x * _factor(spread.inertia, inertia_x),
        hull.inertia_y * _factor(spread.inertia, inertia_y),
        hull.inertia_z * _factor(spread.inertia, inertia_z),
        hull.volume,
        hull.buoyancy_offset,
        hull.restoring_mass_share,
        hull.restoring_roll_coupling,
        hull.added_mass * moving,
        hull.added_inertia * rotating,
        hull.drag_x * moving,
        hull.drag_y * moving,
        hull.drag_z * moving,
        hull.rotational_drag_x * rotating,
        hull.rotational_drag_y * rotating,
        hull.rotational_drag_z * rotating,
        hull.thrust_air * in_air,
        hull.thrust_water * in_water,
        hull.torque_air * in_air,
        hull.torque_water * in_water,
        hull.rotor_limit_air,
        hull.rotor_limit_water,
        hull.radius,
        _within(spread.height_low, spread.height_high, height),
        _within(spread.lag_air_low, spread.lag_air_high, lag_air),
        _within(spread.lag_water_low, spread.lag_water_high, lag_water),
        _within(spread.rotor_drag_low, spread.rotor_drag_high, flapping),
        hull.thrust_water_curve_0 * in_water,
        hull.thrust_water_curve_1 * in_water,
        hull.thrust_water_curve_2 * in_water,
        hull.near_water_radius,
        hull.medium_delay,
        hull.hover_speed,
    )
