"""The integrator at constant rotor speeds: first order, unconditionally stable, exact at rest and in steady state."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from tests.physics import oracle
from tests.physics.open_loop import steps

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)


def at_rest(height, psi=0.0):
    return np.array([0.0, 0.0, height, 0.0, 0.0, psi, *np.zeros(6)])


def exact(state, rpm, vehicle, duration):
    m = oracle.medium(vehicle, water=state[2] <= 0.0)
    solution = solve_ivp(
        lambda t, y: oracle.derivative(y, rpm, m), (0.0, duration), state, method="Radau", rtol=1e-9, atol=1e-11
    )
    return solution.y[:, -1]


@VEHICLES
@pytest.mark.parametrize("height", [8.0, -3.0], ids=["air", "water"])
def test_error_falls_in_proportion_to_the_step(vehicle, height):
    rng = np.random.default_rng(4)
    state = at_rest(height)
    state[3:6], state[6:9], state[9:12] = rng.normal(0, 0.2, 3), rng.normal(0, 1, 3), rng.normal(0, 0.5, 3)
    base = vehicle.hover_speed if height > 0 else 0.0
    rpm = base + np.array([-8.0, 5.0, 6.0, -4.0]) * (1.0 if height > 0 else 40.0)
    reference = exact(state, rpm, vehicle, 0.5)
    errors = [
        np.linalg.norm((steps(state, rpm, vehicle, dt, round(0.5 / dt)) - reference)[:9])
        for dt in 0.01 / 2 ** np.arange(5)
    ]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders[-1] == pytest.approx(1.0, abs=0.15), (errors, orders)


@VEHICLES
@pytest.mark.parametrize("dt", [0.001, 0.01, 0.1, 1.0])
def test_stiff_drag_never_overshoots(vehicle, dt):
    """Explicit schemes blow up at 0.08 rad/s of yaw rate and 10 ms; here any step only slows the vehicle."""
    state = at_rest(-3.0)
    state[6:9] = 5.0, -4.0, 0.0
    state[11] = 20.0
    speeds = np.array([vehicle.neutral_speed, 0.0, vehicle.neutral_speed, 0.0])
    before = state
    for _ in range(20):
        after = steps(before, speeds, vehicle, dt, 1)
        assert 0.0 <= after[11] <= before[11]
        assert np.hypot(after[6], after[7]) <= np.hypot(before[6], before[7])
        assert np.isfinite(after).all()
        before = after


@pytest.mark.parametrize(
    ("rpm", "entry", "value"),
    [
        ((-972.7, 2000, -972.7, 2000), 6, 1.02),  # surge
        ((-972.7, -2000, -972.7, -2000), 6, -1.02),
        ((2000, 0, 2000, 0), 8, 0.57),  # up
        ((-2000, 0, -2000, 0), 8, -0.45),  # down
        ((-972.7, 2000, -972.7, -2000), 11, 0.265),  # yaw in place
        ((0, 0, 0, 0), 8, 0.248),  # passive rise
    ],
)
def test_steady_speeds_in_water(rpm, entry, value):
    """Exact in steady state: a step of 10 ms gives the speeds that thrust and drag balance at."""
    start = at_rest(-100.0)
    assert steps(start, rpm, HYDRONE, 0.01, 1000)[entry] == pytest.approx(value, abs=0.005)


@pytest.mark.parametrize("rpm", [500.0, 1000.0, 2000.0, 2500.0])
def test_turn_radius_with_one_thruster(rpm):
    """3.85 m whatever the speed: more than the 3 m of sensing, so under water the vehicle must stop and turn."""
    start = at_rest(-100.0)
    end = steps(start, (HYDRONE.neutral_speed, rpm, HYDRONE.neutral_speed, 0.0), HYDRONE, 0.01, 10_000)
    assert np.hypot(end[6], end[7]) / end[11] == pytest.approx(3.85, abs=0.15)


def test_coasting_in_water():
    """0.36 m from 0.5 to 0.05 m/s."""
    state = at_rest(-3.0)
    state[6] = 0.5
    while state[6] > 0.05:
        state = steps(state, (HYDRONE.neutral_speed, 0.0, HYDRONE.neutral_speed, 0.0), HYDRONE, 0.01, 1)
    assert state[0] == pytest.approx(0.36, abs=0.01)


def test_air_hardly_drags():
    """80 s from 1 m/s to a half: in air only the reference limits speed."""
    state = at_rest(5.0)
    state[6] = 1.0
    assert steps(state, np.full(4, HYDRONE.hover_speed), HYDRONE, 0.01, 8000)[6] == pytest.approx(0.5, abs=0.01)


@VEHICLES
def test_equilibria_stay_put(vehicle):
    hover = steps(at_rest(5.0, 1.0), np.full(4, vehicle.hover_speed), vehicle, 0.01, 10_000)
    np.testing.assert_allclose(hover, at_rest(5.0, 1.0), atol=1e-9)
    speeds = (vehicle.neutral_speed, 0.0, vehicle.neutral_speed, 0.0)
    np.testing.assert_allclose(steps(at_rest(-2.0, 1.0), speeds, vehicle, 0.01, 10_000), at_rest(-2.0, 1.0), atol=1e-9)
