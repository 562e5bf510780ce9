"""A partly submerged hull in moving fluids: what takes energy, what conserves it, and what does not jump."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hydrone_gym.vehicle import HYDRONE, HYDRONE_2021, HYDRONE_PHYSICAL, Vehicle
from tests.physics.immersed import flowing, immersed_path
from tests.physics.test_invariants import numbers

DT = 0.01
HEIGHT = 0.2  # m
TALL = dataclasses.replace(HYDRONE, name="custom", height=HEIGHT, rotor_drag=1.19e-4)
VEHICLES = pytest.mark.parametrize(
    "vehicle", [TALL, HYDRONE, HYDRONE_PHYSICAL, HYDRONE_2021], ids=["tall", "paper", "physical", "2021"]
)
NEUTRAL = dataclasses.replace(HYDRONE, name="custom", volume=HYDRONE.mass / 1000.0 * (1.0 + 1e-12))
FREE = dataclasses.replace(TALL, drag=(0.0, 0.0, 0.0), rotational_drag=(0.0, 0.0, 0.0))


def at(z, velocity=(0.0, 0.0, 0.0), angles=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    return np.array([0.0, 0.0, z, *angles, *velocity, *rates])


def share(z, height):
    return np.clip(0.5 - z / height, 0.0, 1.0)


def mass_at(z, vehicle):
    """Mass with the added mass of the submerged share, kg."""
    s = share(z, vehicle.height) if vehicle.height else float(z <= 0.0)
    return vehicle.mass + vehicle.added_mass * (s * 1000.0 + (1.0 - s) * 1.293)


velocities = st.tuples(numbers(5.0), numbers(5.0), numbers(5.0))
angles = st.tuples(numbers(1.4), numbers(1.4), numbers(np.pi))


@VEHICLES
@settings(max_examples=150, deadline=None)
@given(velocity=velocities, angles=angles, flow=velocities, z=st.sampled_from([2.0, 0.07, 0.0, -0.05, -2.0]))
def test_drag_takes_energy_relative_to_the_fluid(vehicle, velocity, angles, flow, z):
    """One step with drag against one without: what drag changes takes kinetic energy relative to the fluid."""
    fluid = flowing(air=flow, water=flow)
    rpm = np.full(4, 3000.0 if z > 0.0 else 0.0)
    dragging, gliding = (
        immersed_path(at(z, velocity, angles), each, DT, 1, fluid=fluid, rpm=rpm, driven=z > 0.0)[0, 6:9]
        for each in (vehicle, dataclasses.replace(vehicle, drag=(0.0, 0.0, 0.0), rotor_drag=0.0))
    )
    before, after = np.linalg.norm(gliding - flow), np.linalg.norm(dragging - flow)
    assert after <= before * (1.0 + 1e-12) + 1e-12


@VEHICLES
@pytest.mark.parametrize("z", [2.0, -2.0])
def test_drag_does_nothing_to_a_vehicle_that_moves_with_the_fluid(vehicle, z):
    flow = (1.2, -0.7, 0.3)
    fluid, start = flowing(air=flow, water=flow), at(z, flow, (0.2, -0.1, 1.0))
    free = dataclasses.replace(vehicle, drag=(0.0, 0.0, 0.0), rotor_drag=0.0)
    rpm, driven = np.full(4, 3000.0), z > 0.0
    rpm = rpm if driven else 0.0 * rpm
    dragged, glided = (
        immersed_path(start, v, 1e-4, 1, fluid=fluid, rpm=rpm, driven=driven)[0] for v in (vehicle, free)
    )
    # drag is implicit: it sees the velocity that gravity has made of the fluid's after 0.1 ms
    np.testing.assert_allclose(dragged, glided, rtol=0, atol=1e-4 * 9.78e-4 * 70.0)


def test_at_rest_in_a_current_it_ends_up_with_the_current():
    """|v_r| falls as 1 / (1/U + k t) against quadratic drag of k = ρC/m' = 6.48 1/m."""
    flow = np.array([0.3, 0.0, 0.0])
    path = immersed_path(at(-2.0), NEUTRAL, DT, 12_000, fluid=flowing(water=flow))
    k, times = 12.5 / 1.9301, DT * np.arange(1, 12_001)
    np.testing.assert_allclose(flow[0] - path[:, 6], 1.0 / (1.0 / 0.3 + k * times), rtol=0.02)
    assert abs(path[-1, 6] - 0.3) < 0.0015
    np.testing.assert_allclose(path[-1, 7:9], 0.0, atol=1e-9)
    np.testing.assert_allclose(path[-1, 1:6], [0.0, -2.0, 0.0, 0.0, 0.0], atol=1e-6)


@VEHICLES
@pytest.mark.parametrize(
    ("z", "rpm"), [(30.0, (3100.0, 3160.0, 3140.0, 3180.0)), (-30.0, (-900.0, 600.0, -950.0, 700.0))]
)
def test_galilean_invariance_in_a_steady_flow(vehicle, z, rpm):
    """Open loop, seen from the moving fluid, nothing differs from a fluid at rest."""
    flow = np.array([0.5, -0.3, 0.0])
    start = at(z, (0.3, 0.2, -0.1), (0.1, -0.05, 0.7), (0.2, 0.1, -0.3))
    moving = start.copy()
    moving[6:9] += flow
    rest = immersed_path(start, vehicle, DT, 300, rpm=rpm, driven=z > 0.0)
    carried = immersed_path(moving, vehicle, DT, 300, rpm=rpm, driven=z > 0.0, fluid=flowing(air=flow, water=flow))
    times = DT * np.arange(1, 301)
    np.testing.assert_allclose(carried[:, :3], rest[:, :3] + times[:, None] * flow, rtol=0, atol=1e-9)
    np.testing.assert_allclose(carried[:, 3:6], rest[:, 3:6], rtol=0, atol=1e-9)
    np.testing.assert_allclose(carried[:, 6:9], rest[:, 6:9] + flow, rtol=0, atol=1e-9)
    np.testing.assert_allclose(carried[:, 9:], rest[:, 9:], rtol=0, atol=1e-9)
    assert np.linalg.norm(np.ptp(rest[:, :3], axis=0)) > 0.5


def energy(state, vehicle):
    """Kinetic energy with added mass, and the potential of weight and buoyancy; J."""
    z, h = state[:, 2], vehicle.height
    weight, lift = vehicle.mass * vehicle.gravity, 1000.0 * vehicle.volume * vehicle.gravity
    # the integral of the share over z, from where all of the hull is in air
    below = np.where(z >= h / 2, 0.0, np.where(z <= -h / 2, -z, (h / 2 - z) ** 2 / (2 * h)))
    return 0.5 * mass_at(z, vehicle) * np.sum(state[:, 6:9] ** 2, axis=1) + weight * z + lift * below


@pytest.mark.parametrize(
    "velocity", [(0.0, 0.0, -1.0), (0.4, -0.3, -0.5), (1.5, 0.0, 0.0)], ids=["drop", "oblique", "skim"]
)
def test_energy_is_conserved_through_the_surface(velocity):
    """No drag, no rotors: the error of the energy after two seconds of bobbing halves with the step."""
    start = at(0.15, velocity)
    first = energy(start[None], FREE)[0]
    errors, shares = [], None
    for steps in (1, 2, 4, 8):
        path = immersed_path(start, FREE, 2e-3 / steps, 1000 * steps)
        errors.append(np.abs(energy(path, FREE) - first).max())
        shares = share(path[:, 2], HEIGHT)
    assert ((shares > 0.0) & (shares < 1.0)).mean() > 0.05
    assert shares.min() == 0.0
    assert shares.max() == 1.0
    assert errors[-1] < 0.01 * 12.6 * 0.5
    for coarse, fine in itertools.pairwise(errors):
        assert 1.7 < coarse / fine < 2.4, errors


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.3, -0.4)])
def test_forces_are_continuous_in_height(tilt):
    """Acceleration over ± 0.5 m in steps of 0.1 mm: no jump, with rotors of either medium and moving fluids.

    The vehicle moves with the water: added mass that comes and goes pushes by ½ dm'/dz |v_r|², which begins at once.
    """
    heights = np.linspace(0.5, -0.5, 10_001)
    fluid = flowing(air=(2.0, 1.0, 0.2), water=(-0.3, 0.2, 0.1), water_rate_x=0.5, water_rate_z=-0.3)
    for driven, rpm in ((True, (3000.0, 3100.0, 3200.0, 3050.0)), (False, (-900.0, 1200.0, -800.0, 1100.0))):
        gained = []
        for z in heights:
            state = at(z, (-0.3, 0.2, 0.1), (*tilt, 0.5), (0.1, 0.2, 0.3))
            after = immersed_path(state, TALL, 1e-6, 1, fluid=fluid, rpm=rpm, driven=driven)[0]
            gained.append((after[6:] - state[6:]) / 1e-6)
        jumps = np.abs(np.diff(gained, axis=0)).max(axis=0)
        # buoyancy grows by 78 N/m over 1.3 kg: 0.01 m/s^2 in 0.1 mm; turning accelerations by up to 30 times that
        assert (jumps[:3] < 0.02).all(), jumps
        assert (jumps[3:] < 0.2).all(), jumps
        assert np.ptp(gained, axis=0)[2] > 1.0


def test_velocity_does_not_jump_at_the_layers_edges():
    """With speed through the layer the force of growing added mass begins and ends abruptly, the velocity does not."""
    path = immersed_path(at(0.2, (0.5, 0.0, -3.0)), TALL, 1e-4, 8000)
    assert share(path[:, 2], HEIGHT).max() > 0.95  # drag stops it within decimetres
    steps = np.abs(np.diff(path[:, 6:9], axis=0)).max(axis=0)
    assert (steps < 1e-4 * 110.0).all(), steps  # drag of 49.9 v²/m' and all


@pytest.mark.parametrize("vz", [-2.0, 2.0])
def test_abrupt_surface_changes_no_velocity(vz):
    start = at(-np.sign(vz) * 0.01, (0.4, -0.2, vz))
    path = immersed_path(start, HYDRONE, 1e-4, 200)
    assert (path[:, 2] > 0.0).any()
    assert (path[:, 2] <= 0.0).any()
    assert (np.abs(np.diff(path[:, 6:9], axis=0)) < 1e-4 * 110.0).all()  # drag and gravity at 2 m/s


def floating(vehicle: Vehicle):
    return HEIGHT * (0.5 - vehicle.mass / (1000.0 * vehicle.volume))


def test_it_floats_where_it_displaces_its_mass():
    path = immersed_path(at(floating(TALL)), TALL, DT, 1000)
    np.testing.assert_allclose(path[:, 2], floating(TALL), atol=1e-9)
    np.testing.assert_allclose(path[:, 6:9], 0.0, atol=1e-9)


def test_aerial_rotors_pull_by_their_share_in_air_and_aquatic_ones_by_theirs_in_water():
    """Rolled, rotor 2 is above the layer and rotor 4 below it."""
    roll = 0.5
    state = at(0.0, angles=(roll, 0.0, 0.0))
    assert HYDRONE.arm * np.sin(roll) > HEIGHT / 2
    for driven, rpm in ((True, 3000.0), (False, 1000.0)):
        turned = [
            (immersed_path(state, FREE, 1e-6, 1, rpm=np.eye(4)[k] * rpm, driven=driven)[0, 6:] - state[6:]) / 1e-6
            for k in range(4)
        ]
        nothing = (immersed_path(state, FREE, 1e-6, 1, driven=driven)[0, 6:] - state[6:]) / 1e-6
        pulls = np.linalg.norm(np.array(turned) - nothing, axis=1)
        dead, alive = (3, 1) if driven else (1, 3)
        assert pulls[dead] < 1e-6
        assert pulls[alive] > 0.5
        assert pulls[0] == pytest.approx(pulls[2], rel=1e-6)
