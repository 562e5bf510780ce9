"""What forces allow in weather, by hand, and docs/promise.md says it."""

import math

import pytest

from benchmarks import weather_limits as limits
from benchmarks.timing import ROOT
from hydrone_gym._jit import kernel
from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.weather import waves
from hydrone_gym.weather.noise import Key
from hydrone_gym.weather.weather import DEPTH, LEVELS


def test_tilt_balances_the_drag_of_rotors_at_hover_and_of_the_hull():
    # 0.157 u + 0.0162 u^2 N, a C of 1.25e-2 m^2 in air of 1.293 kg/m^3, against 1.286 kg * 9.78 m/s^2
    assert [round(math.degrees(limits.holding_tilt(wind)), 1) for wind in (0.0, 3.0, 5.0)] == [0.0, 2.8, 5.4]
    rotors = 4.0 * 1.19e-4 * 3150.5 * 2.0 * math.pi / 60.0
    by_hand = math.atan((rotors * 8.0 + 1.293 * 1.25e-2 * 64.0) / (1.286 * 9.78))
    assert limits.holding_tilt(8.0) == pytest.approx(by_hand, rel=1e-4)
    assert limits.holding_tilt(8.0, 0.0) < 0.5 * by_hand


@pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL])
def test_at_full_thrust_nothing_accelerates_at_the_speed_of_surge(vehicle):
    assert limits.surge(vehicle) == pytest.approx(1.2, abs=0.1)
    full = vehicle.rotor_limit_water
    moving = [0.0, 0.0, -3.0, 0.0, 0.0, 0.0, limits.surge(vehicle), *[0.0] * 5]
    assert state_derivative(moving, [0.0, full, 0.0, full], vehicle)[6] == pytest.approx(0.0, abs=1e-9)


def test_a_turn_takes_what_the_differential_equation_says():
    thrust = 1000.0 * 1.623e-9 * 2500.0**2
    steady = math.sqrt(0.27 * 2.0 * thrust / (1000.0 * 4.99e-2))  # rad/s
    assert steady == pytest.approx(0.33, abs=0.005)
    assert limits.turning_time(HYDRONE) == pytest.approx(0.5 * math.pi / steady, rel=1e-3)
    time, turned, rate = limits.turning_time(HYDRONE_PHYSICAL), 0.0, 0.0
    for _ in range(2000):
        state = [0.0, 0.0, -3.0, *[0.0] * 8, rate]
        rate += time / 2000 * state_derivative(state, [0.0, 2500.0, 0.0, -2500.0], HYDRONE_PHYSICAL)[11]
        turned += time / 2000 * rate
    assert turned == pytest.approx(0.5 * math.pi, rel=2e-3)


def test_a_current_carries_a_vehicle_at_rest_up_to_its_own_speed():
    time, place, speed = 4.0, 0.0, 0.0
    for _ in range(4000):
        speed += 1e-3 * 12.5 / (1.286 + 0.6441) * (0.3 - speed) ** 2
        place += 1e-3 * speed
    assert limits.carried(0.3, time) == pytest.approx(place, rel=2e-3)


def test_driving_obliquely_at_full_thrust_keeps_a_current_from_carrying_to_the_wall():
    mean, strong = limits.headings(LEVELS[3])  # 0.3 and 0.42 m/s against 1.27 m/s
    assert (round(mean, 1), round(strong, 1)) == (13.6, 19.2)
    assert max(limits.ways(LEVELS[3], HYDRONE, (mean, strong))) < 0.3


@kernel
def swell_below(sea, key, depth, time):
    drawn = waves.draw_sea(sea, (1.0, 0.0), key, 0.0)
    return waves.add_wave(waves.calm(), drawn.first, (0.0, 0.0, -depth), (0.0, 0.0), time).u


def test_water_in_waves_moves_as_the_simulation_has_it():
    assert limits.orbital_speed(0.2, 2.0) == pytest.approx(0.31, abs=0.005)
    sea, times = waves.sea_params(0.5, 3.0, False, DEPTH), [0.003 * k for k in range(1000)]
    speeds = [abs(swell_below(sea, Key(1.0, 2.0), 0.8, time)) for time in times]
    greatest = limits.orbital_speed(0.5, 3.0, 0.8)
    assert max(speeds) == pytest.approx(greatest, rel=1e-4)
    below = sum(speed < 0.2 for speed in speeds) / len(speeds)
    assert limits.share_below(0.2, greatest) == pytest.approx(below, abs=0.005)
    assert limits.share_below(0.2, 0.0) == limits.share_below(0.2, 0.2) == 1.0


def test_a_verdict_names_what_is_too_much():
    assert limits.verdict((1.0, 2.0), 2.0, "°", "in gusts") == "possible"
    assert limits.verdict((1.0, 2.1), 2.0, "°", "in gusts") == "impossible in gusts: 2.1°"
    assert limits.verdict((2.04, 3.0), 2.0, " m", "in gusts") == "impossible: 2 m"


def test_the_page_has_the_table(capsys):
    limits.main()
    table = [line for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    assert len(table) == 19
    assert "\n".join(table) in (ROOT / "docs" / "promise.md").read_text(encoding="utf-8")
