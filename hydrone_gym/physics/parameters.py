"""The flat structs that physics kernels read: a `Vehicle` with everything that depends on the medium worked out.

The same arithmetic serves Python, for the nominal vehicle, and kernels, for the vehicle of an episode.
"""

import math
from typing import NamedTuple

from hydrone_gym._jit import shared
from hydrone_gym.vehicle import AIR_DENSITY, WATER_DENSITY, Vehicle


class Hull(NamedTuple):
    """A `Vehicle` as numbers; units are there."""

    mass: float
    gravity: float
    arm: float
    yaw_arm_air: float
    inertia_x: float
    inertia_y: float
    inertia_z: float
    volume: float
    buoyancy_offset: float
    restoring_mass_share: float
    restoring_roll_coupling: float
    added_mass: float
    added_inertia: float
    drag_x: float
    drag_y: float
    drag_z: float
    rotational_drag_x: float
    rotational_drag_y: float
    rotational_drag_z: float
    thrust_air: float
    thrust_water: float
    torque_air: float
    torque_water: float
    rotor_limit_air: float
    rotor_limit_water: float
    radius: float
    height: float
    rotor_lag_air: float
    rotor_lag_water: float
    rotor_drag: float
    thrust_water_curve_0: float
    thrust_water_curve_1: float
    thrust_water_curve_2: float
    near_water_radius: float
    medium_delay: float
    hover_speed: float


class MediumParams(NamedTuple):
    """Coefficients of the equations of motion in one medium; both media use the same equations."""

    weight: float  # net downward force, N: m g in air, (m - rho V) g in water
    inverse_mass: float  # 1 / (m + added mass), 1/kg
    inverse_inertia_x: float  # 1 / (J + added inertia), 1/(kg m^2)
    inverse_inertia_y: float
    inverse_inertia_z: float
    drag_x: float  # rho C / total mass, 1/m
    drag_y: float
    drag_z: float
    rotational_drag_x: float  # rho N / total inertia, 1
    rotational_drag_y: float
    rotational_drag_z: float
    restoring: float  # moment a radian of tilt, N m; zero in air
    thrust: float  # rho zeta, N/rpm^2
    power: float  # rho eta 2 pi / 60, W/rpm^3
    rotor_min: float  # rpm
    rotor_max: float  # rpm


class VehicleParams(NamedTuple):
    """What the kernels know of the vehicle."""

    arm: float  # l, m
    yaw_arm_air: float  # deviation E4, m
    inertia_x: float  # J, kg m^2 (gyroscopic term; the isotropic added inertia drops out of it)
    inertia_y: float
    inertia_z: float
    restoring_roll_coupling: float
    hover_speed: float  # rpm
    radius: float  # m
    air: MediumParams
    water: MediumParams


@shared
def _medium_params(hull, density, water):
    mass = hull.mass + hull.added_mass * density
    inertia_x = hull.inertia_x + hull.added_inertia * density
    inertia_y = hull.inertia_y + hull.added_inertia * density
    inertia_z = hull.inertia_z + hull.added_inertia * density
    # The paper gives buoyancy and the restoring moment for water only; in air both are below 0.2 % of the weight.
    displaced = density * hull.volume if water else 0.0
    restoring = hull.buoyancy_offset * (hull.restoring_mass_share * hull.mass + displaced) * hull.gravity
    return MediumParams(
        (hull.mass - displaced) * hull.gravity,
        1.0 / mass,
        1.0 / inertia_x,
        1.0 / inertia_y,
        1.0 / inertia_z,
        density * hull.drag_x / mass,
        density * hull.drag_y / mass,
        density * hull.drag_z / mass,
        density * hull.rotational_drag_x / inertia_x,
        density * hull.rotational_drag_y / inertia_y,
        density * hull.rotational_drag_z / inertia_z,
        restoring if water else 0.0,
        density * (hull.thrust_water if water else hull.thrust_air),
        density * (hull.torque_water if water else hull.torque_air) * 2.0 * math.pi / 60.0,
        -hull.rotor_limit_water if water else 0.0,
        hull.rotor_limit_water if water else hull.rotor_limit_air,
    )


@shared
def params_of(hull):
    """Work out the kernels' coefficients of a `Hull` in both media (E5, E7, E10, E14)."""
    return VehicleParams(
        hull.arm,
        hull.yaw_arm_air,
        hull.inertia_x,
        hull.inertia_y,
        hull.inertia_z,
        hull.restoring_roll_coupling,
        hull.hover_speed,
        hull.radius,
        _medium_params(hull, AIR_DENSITY, False),
        _medium_params(hull, WATER_DENSITY, True),
    )


def hull_of(vehicle: Vehicle) -> Hull:
    """Return the numbers of a vehicle."""
    numbers: dict[str, float] = {}
    for name in ("inertia", "drag", "rotational_drag", "thrust_water_curve"):
        axes = ("0", "1", "2") if name == "thrust_water_curve" else ("x", "y", "z")
        numbers |= {f"{name}_{axis}": value for axis, value in zip(axes, getattr(vehicle, name), strict=True)}
    return Hull(*(numbers[name] if name in numbers else getattr(vehicle, name) for name in Hull._fields))


def vehicle_params(vehicle: Vehicle) -> VehicleParams:
    """Work out the kernels' coefficients of a vehicle."""
    return params_of(hull_of(vehicle))
