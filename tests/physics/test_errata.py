"""What the paper prints and what is built: each misprint that changes a flight, shown as printed and as built."""

import dataclasses

import numpy as np
import pytest

from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from tests.physics import oracle
from tests.physics.open_loop import steps

STILL = np.zeros(4)


def swimming(psi=0.0, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0), angles=(0.0, 0.0)):
    return np.array([0.0, 0.0, -2.0, *angles, psi, *velocity, *rates])


def flying(**changes):
    state = swimming(**changes)
    state[2] = 2.0
    return state


@pytest.mark.parametrize("psi", np.radians([100.0, 135.0, 180.0, -135.0]))
def test_e1_printed_drag_pumps_energy_in(psi):
    velocity = np.array([1.0, 0.7, 0.0])
    m = oracle.medium(HYDRONE, water=True)
    printed = -oracle.rotation(0.0, 0.0, psi) @ m.drag @ (np.abs(velocity) * velocity)
    assert velocity @ printed > 0.0
    built = state_derivative(swimming(psi, velocity), STILL, HYDRONE)[6:9]
    assert velocity @ built < 0.0


def test_e2_turning_does_not_accelerate_the_vehicle():
    velocity = (1.0, -2.0, 0.5)
    for state in (swimming, flying):
        calm = state_derivative(state(velocity=velocity), STILL, HYDRONE)[6:9]
        turning = state_derivative(state(velocity=velocity, rates=(1.0, 2.0, 3.0)), STILL, HYDRONE)[6:9]
        np.testing.assert_array_equal(turning, calm)


@pytest.mark.parametrize("angles", [(0.4, -0.3), (-0.7, 0.9), (1.0, 1.0)])
def test_e3_rates_turn_the_rotation_matrix(angles):
    """dR/dt = R [omega]x holds for the built rates, and not for the printed ones."""
    omega, psi, h = np.array([0.3, -0.8, 0.5]), 0.6, 1e-6
    skew = np.array([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    expected = oracle.rotation(*angles, psi) @ skew

    def turned(rates):
        ahead, behind = np.array([*angles, psi]) + h * rates, np.array([*angles, psi]) - h * rates
        return (oracle.rotation(*ahead) - oracle.rotation(*behind)) / (2 * h)

    built = state_derivative(swimming(psi, rates=omega, angles=angles), STILL, HYDRONE)[3:6]
    np.testing.assert_allclose(turned(built), expected, atol=1e-9)
    assert np.abs(turned(oracle.rate_matrix(*angles) @ omega) - expected).max() > 0.05


def test_e4_yaw_moment_in_air_is_sixty_times_smaller_in_the_physical_set():
    rpm = HYDRONE.hover_speed + np.array([100.0, -100.0, 100.0, -100.0])
    yaw = [state_derivative(flying(), rpm, v)[11] * v.inertia[2] for v in (HYDRONE, HYDRONE_PHYSICAL)]
    assert yaw[0] / yaw[1] == pytest.approx(0.27 / 0.0125, rel=1e-3)
    assert yaw[0] == pytest.approx(0.27 * 1.293 * 2.45e-7 * 2 * ((rpm[0]) ** 2 - rpm[1] ** 2), rel=1e-3)


def test_e5_e6_drag_per_density():
    fast, spin = swimming(velocity=(1.0, 0.0, 0.0)), swimming(rates=(0.0, 0.0, 1.0))
    assert state_derivative(fast, STILL, HYDRONE)[6] == pytest.approx(-12.5 / 1.9301, rel=1e-4)
    assert state_derivative(spin, STILL, HYDRONE)[11] == pytest.approx(-49.9 / 1.6584e-2, rel=1e-9)
    swapped = HYDRONE_PHYSICAL.inertia[2] + 1.174e-3
    assert state_derivative(spin, STILL, HYDRONE_PHYSICAL)[11] == pytest.approx(-0.06 / swapped, rel=1e-9)


def test_e7_axes_do_not_couple():
    """The tabled matrices have off-diagonal entries; here a pitching moment does not roll the vehicle."""
    for state in (flying(), swimming()):
        assert state_derivative(state, np.array([0.0, 0.0, 500.0, 0.0]), HYDRONE)[9] == 0.0


def test_e8_largest_inertia_is_about_the_vertical_in_the_physical_set():
    assert max(HYDRONE_PHYSICAL.inertia) == HYDRONE_PHYSICAL.inertia[2]
    assert HYDRONE.inertia == (HYDRONE_PHYSICAL.inertia[0], HYDRONE_PHYSICAL.inertia[2], HYDRONE_PHYSICAL.inertia[1])


def test_e9_thrust_is_signed():
    """With the printed square both signs would lift; without reverse the vehicle cannot dive or turn in place."""
    down = state_derivative(swimming(), np.array([-2000.0, 0.0, -2000.0, 0.0]), HYDRONE)
    up = state_derivative(swimming(), np.array([2000.0, 0.0, 2000.0, 0.0]), HYDRONE)
    buoyant = state_derivative(swimming(), STILL, HYDRONE)[8]
    assert down[8] < 0.0 < up[8]
    assert up[8] - buoyant == pytest.approx(buoyant - down[8], rel=1e-12)


def test_e10_printed_hover_term_does_not_hover():
    printed = np.sqrt(HYDRONE.mass * HYDRONE.gravity / (4.0 * 1.0 * HYDRONE.thrust_air))
    thrust = 4.0 * 1.293 * HYDRONE.thrust_air * printed**2
    assert thrust / (HYDRONE.mass * HYDRONE.gravity) == pytest.approx(1.293)
    assert HYDRONE.hover_speed == pytest.approx(printed / np.sqrt(1.293))


@pytest.mark.parametrize(("vehicle", "share"), [(HYDRONE, (1.286 + 1.6) / 1.6), (HYDRONE_PHYSICAL, 1.0)])
def test_e14_restoring_moment(vehicle, share):
    """Only buoyancy acts away from the centre of mass; the printed moment is 1.8 times too stiff."""
    roll, pitch = 0.3, 0.4
    lift = vehicle.volume * 1000.0 * vehicle.gravity * vehicle.buoyancy_offset
    moment = state_derivative(swimming(angles=(roll, pitch)), STILL, vehicle)[9:11] * (
        np.array(vehicle.inertia[:2]) + 1.174e-3
    )
    cosine = 1.0 if vehicle is HYDRONE else np.cos(roll)
    np.testing.assert_allclose(moment, -lift * share * np.array([np.sin(roll), cosine * np.sin(pitch)]), rtol=1e-12)
    force = oracle.rotation(roll, pitch, 0.0).T @ [0.0, 0.0, vehicle.volume * 1000.0 * vehicle.gravity]
    geometric = np.cross([0.0, 0.0, vehicle.buoyancy_offset], force)[:2]
    assert np.allclose(moment, geometric, rtol=1e-12) == (vehicle is HYDRONE_PHYSICAL)


def test_e15_buoyancy():
    for vehicle, share in ((HYDRONE, 0.24), (HYDRONE_PHYSICAL, 0.05)):
        assert vehicle.volume * 1000.0 / vehicle.mass - 1.0 == pytest.approx(share, abs=0.005)


def test_the_sets_differ_only_where_the_paper_contradicts_physics():
    fields = [spec.name for spec in dataclasses.fields(HYDRONE)]
    different = {name for name in fields if getattr(HYDRONE, name) != getattr(HYDRONE_PHYSICAL, name)}
    assert different == {
        "name",
        "yaw_arm_air",
        "rotational_drag",
        "inertia",
        "restoring_mass_share",
        "restoring_roll_coupling",
        "volume",
        "air_gains",
    }


def test_as_printed_drag_would_fly_apart():
    """E1 as printed, stepped explicitly at 1 ms from 1 m/s at 135 degrees of yaw: faster than 50 m/s in 0.6 s."""
    m = oracle.medium(HYDRONE, water=True)
    matrix = oracle.rotation(0.0, 0.0, np.radians(135.0)) @ m.drag
    velocity = np.array([1.0, 1.0, 0.0])
    for _ in range(600):
        velocity = velocity - 1e-3 * matrix @ (np.abs(velocity) * velocity) / m.total_mass
        if np.linalg.norm(velocity) > 50.0:
            break
    assert np.linalg.norm(velocity) > 50.0
    start = swimming(np.radians(135.0), (1.0, 1.0, 0.0))
    assert np.linalg.norm(steps(start, STILL, HYDRONE, 1e-3, 600)[6:8]) < 0.5
