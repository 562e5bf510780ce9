"""The model of the paper, as corrected, in matrix form: slow, obvious, and sharing no line with the kernels.

Everything is a vector or a matrix and every equation is one statement, so it can be read beside the paper. The
functions also compile with plain ``numba.njit``, which `tests/simulation` uses to hand them to SciPy's integrators.
"""

from typing import NamedTuple

import numpy as np

from hydrone_gym.vehicle import Vehicle


class Medium(NamedTuple):
    water: bool
    gravity: float  # m/s^2
    arm: float  # l, m
    yaw_arm_air: float  # m, E4
    dry_mass: float  # kg
    displaced: float  # rho V, kg
    buoyancy_offset: float  # c, m
    restoring_mass_share: float  # E14
    restoring_roll_coupling: float  # E14
    total_mass: float  # m + added mass, kg
    inertia: np.ndarray  # J, (3, 3) kg m^2
    total_inertia: np.ndarray  # J + added inertia, (3, 3) kg m^2
    drag: np.ndarray  # rho C, (3, 3) kg/m
    rotational_drag: np.ndarray  # rho N, (3, 3) kg m^2
    thrust: float  # rho zeta, N/rpm^2


def medium(vehicle: Vehicle, *, water: bool) -> Medium:
    density = 1000.0 if water else 1.293
    inertia = np.diag(vehicle.inertia)
    return Medium(
        water,
        vehicle.gravity,
        vehicle.arm,
        vehicle.yaw_arm_air,
        vehicle.mass,
        density * vehicle.volume if water else 0.0,
        vehicle.buoyancy_offset if water else 0.0,
        vehicle.restoring_mass_share,
        vehicle.restoring_roll_coupling,
        vehicle.mass + density * vehicle.added_mass,
        inertia,
        inertia + density * vehicle.added_inertia * np.eye(3),
        density * np.diag(vehicle.drag),
        density * np.diag(vehicle.rotational_drag),
        density * (vehicle.thrust_water if water else vehicle.thrust_air),
    )


def rotation(phi, theta, psi):
    """R = Rz(psi) Rx(phi) Ry(theta): body to world."""
    rz = np.array([[np.cos(psi), -np.sin(psi), 0.0], [np.sin(psi), np.cos(psi), 0.0], [0.0, 0.0, 1.0]])
    rx = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(phi), -np.sin(phi)], [0.0, np.sin(phi), np.cos(phi)]])
    ry = np.array([[np.cos(theta), 0.0, np.sin(theta)], [0.0, 1.0, 0.0], [-np.sin(theta), 0.0, np.cos(theta)]])
    return rz @ rx @ ry


def skew(a):
    """The matrix of a x ..."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def solve(matrix, right):
    """Cramer's rule for three equations: the cross products of the rows are the columns of the adjugate."""
    a, b, c = matrix[0], matrix[1], matrix[2]
    bc, ca, ab = skew(b) @ c, skew(c) @ a, skew(a) @ b
    return (bc * right[0] + ca * right[1] + ab * right[2]) / (a @ bc)


def rate_matrix(phi, theta):
    """The printed matrix of eqs. 3 and 11: it maps Euler rates to body rates (E3)."""
    return np.array(
        [
            [np.cos(theta), 0.0, -np.cos(phi) * np.sin(theta)],
            [0.0, 1.0, np.sin(phi)],
            [np.sin(theta), 0.0, np.cos(phi) * np.cos(theta)],
        ]
    )


def rotor_force_and_moment(f, m):
    if m.water:
        force = np.array([f[1] + f[3], 0.0, f[0] + f[2]])
        moment = m.arm * np.array([0.0, f[2] - f[0], f[1] - f[3]])
    else:
        force = np.array([0.0, 0.0, f[0] + f[1] + f[2] + f[3]])
        arms = np.array([m.arm, m.arm, m.yaw_arm_air])
        moment = arms * np.array([f[1] - f[3], f[2] - f[0], f[0] - f[1] + f[2] - f[3]])
    return force, moment


def restoring_moment(phi, theta, m):
    """Printed: c (m + rho V) g [sin phi, sin theta, 0]; physical: c rho V g [sin phi, cos phi sin theta, 0] (E14)."""
    weight = (m.restoring_mass_share * m.dry_mass + m.displaced) * m.gravity
    coupling = np.cos(phi) if m.restoring_roll_coupling == 1.0 else 1.0
    return m.buoyancy_offset * weight * np.array([np.sin(phi), coupling * np.sin(theta), 0.0])


def derivative(state, rpm, m):
    """Eqs. 1-4 in air, 9-12 in water, corrected."""
    phi, theta, psi = state[3], state[4], state[5]
    velocity, omega = state[6:9], state[9:12]
    r = rotation(phi, theta, psi)
    force, moment = rotor_force_and_moment(m.thrust * rpm * np.abs(rpm), m)
    seen = r.T @ velocity
    gravity_term = np.array([0.0, 0.0, (m.dry_mass - m.displaced) * m.gravity])
    acceleration = (r @ force - gravity_term - r @ (m.drag @ (np.abs(seen) * seen))) / m.total_mass
    gyroscopic = skew(omega) @ (m.inertia @ omega)
    torque = moment - gyroscopic - restoring_moment(phi, theta, m) - m.rotational_drag @ (np.abs(omega) * omega)
    out = np.empty(12)
    out[0:3] = velocity
    out[3:6] = solve(rate_matrix(phi, theta), omega)
    out[6:9] = acceleration
    out[9:12] = solve(m.total_inertia, torque)
    return out


def state_derivative(state, rpm, vehicle: Vehicle):
    return derivative(state, rpm, medium(vehicle, water=not state[2] > 0.0))
