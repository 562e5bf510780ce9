"""The flat structs that physics kernels read: a `Vehicle` with everything that depends on the medium worked out."""

import math
from typing import NamedTuple

from hydrone_gym.vehicle import AIR_DENSITY, WATER_DENSITY, Vehicle


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


def _medium_params(vehicle: Vehicle, density: float, *, water: bool) -> MediumParams:
    mass = vehicle.mass + vehicle.added_mass * density
    inertia = [entry + vehicle.added_inertia * density for entry in vehicle.inertia]
    # The paper gives buoyancy and the restoring moment for water only; in air both are below 0.2 % of the weight.
    displaced = density * vehicle.volume if water else 0.0
    restoring = vehicle.buoyancy_offset * (vehicle.restoring_mass_share * vehicle.mass + displaced) * vehicle.gravity
    values = (
        (vehicle.mass - displaced) * vehicle.gravity,
        1.0 / mass,
        *(1.0 / entry for entry in inertia),
        *(density * entry / mass for entry in vehicle.drag),
        *(density * drag / entry for drag, entry in zip(vehicle.rotational_drag, inertia, strict=True)),
        restoring if water else 0.0,
        density * (vehicle.thrust_water if water else vehicle.thrust_air),
        density * (vehicle.torque_water if water else vehicle.torque_air) * 2.0 * math.pi / 60.0,
        -vehicle.rotor_limit_water if water else 0.0,
        vehicle.rotor_limit_water if water else vehicle.rotor_limit_air,
    )
    return MediumParams._make(values)


def vehicle_params(vehicle: Vehicle) -> VehicleParams:
    """Work out the kernels' coefficients of a vehicle in both media (E5, E7, E10, E14)."""
    return VehicleParams(
        vehicle.arm,
        vehicle.yaw_arm_air,
        *vehicle.inertia,
        vehicle.restoring_roll_coupling,
        vehicle.hover_speed,
        vehicle.radius,
        _medium_params(vehicle, AIR_DENSITY, water=False),
        _medium_params(vehicle, WATER_DENSITY, water=True),
    )
