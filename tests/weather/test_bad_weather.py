"""Weather, spreads and vehicles that cannot be are refused by name, rule and unit."""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest

from hydrone_gym import HYDRONE, HYDRONE_2021, Scenario, Spread, Vehicle, Weather
from hydrone_gym.weather.disturbance import MOST, register
from tests.envs.missions import make
from tests.envs.test_vector_env import native

NAN, INF = float("nan"), float("inf")


class Unknown(NamedTuple):
    """A disturbance that nobody registered."""

    speed: float


class Numbers(NamedTuple):
    """One that is."""

    speed: float


register(Numbers, lambda numbers, chance, place, time: ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))

BOUNDED = {
    "wind": (r"between 0 and 20 \(m/s", -1.0, 20.5),
    "turbulence": (r"between 0 and 3 \(1", -0.1, 3.5),
    "current": (r"between 0 and 2 \(m/s", -0.1, 2.5),
    "current_variation": (r"between 0 and 1 \(1", -0.1, 1.5),
    "wave_height": (r"between 0 and 3 \(m;", -0.1, 3.5),
    "wave_period": (r"between 0\.3 and 20 \(s", 0.0, 21.0),
}
NO_NUMBERS = [NAN, INF, True, "2.0", None, [1.0], np.array([1.0]), 1j]


@pytest.mark.parametrize("name", BOUNDED)
def test_numbers_of_weather(name):
    rule, low, high = BOUNDED[name]
    for value in (low, high, *NO_NUMBERS):
        with pytest.raises(ValueError, match=rf"^Weather\.{name} must lie {rule}.*got ") as refused:
            Weather(**{name: value})
        assert repr(value) in str(refused.value)
    whole = getattr(Weather(**{"wave_period": 5, name: 1}), name)
    assert whole == 1.0
    assert isinstance(whole, float)


@pytest.mark.parametrize("name", ["wind_direction", "current_direction", "wave_direction"])
def test_directions_of_weather(name):
    for value in (NAN, INF, True, "north", [0.0]):
        with pytest.raises(ValueError, match=rf"^Weather\.{name} must be a finite number \(rad\) or None, got "):
            Weather(**{name: value})
    assert getattr(Weather(**{name: -9.0}), name) == -9.0


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"shear": 1}, r"Weather\.shear must be True or False, got 1"),
        ({"sea": "rough"}, r"Weather\.sea must be one of 'regular', 'jonswap', got 'rough'"),
        ({"sea": None}, r"Weather\.sea must be one of"),
        ({"spread": 0.1}, r"Weather\.spread must be a Spread, got 0\.1"),
        ({"name": 3}, r"Weather\.name must be a string, got 3"),
        (
            {"extra": Unknown(1.0)},
            r"Weather\.extra must be a registered disturbance \(known: .*Numbers.*\), got Unknown",
        ),
        ({"extra": (1.0,)}, r"Weather\.extra must be a registered disturbance"),
        ({"extra": Numbers(NAN)}, r"Weather\.extra\.speed must be a finite number, got nan"),
        ({"extra": Numbers(True)}, r"Weather\.extra\.speed must be a finite number, got True"),
        ({"extra": Numbers("1")}, r"Weather\.extra\.speed must be a finite number, got '1'"),
        (
            {"wave_height": 1.0, "wave_period": 1.0},
            r"Weather\.wave_height must be at most 0\.221 m for a period of 1 s: a wave 1\.56 m long breaks beyond "
            r"0\.142 of its length, got 1\.0 m",
        ),
        (
            {"wave_height": 0.1, "wave_period": 0.3},
            r"Weather\.wave_height must be at most 0\.0199 m for a period of 0\.3 s",
        ),
    ],
)
def test_other_fields_of_weather(fields, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        Weather(**fields)


def test_a_wave_may_be_as_steep_as_they_come():
    Weather(wave_height=0.22, wave_period=1.0)


@pytest.mark.parametrize("name", ["mass", "thrust", "inertia", "drag"])
def test_shares_of_spread(name):
    for value in (-0.1, 0.95, *NO_NUMBERS):
        with pytest.raises(
            ValueError, match=rf"^Spread\.{name} must lie between 0 and 0\.9, a share of the nominal value, got"
        ):
            Spread(**{name: value})


@pytest.mark.parametrize(
    ("name", "unit", "most"),
    [
        ("rotor_lag_air", "s", 1.0),
        ("rotor_lag_water", "s", 1.0),
        ("rotor_drag", r"N s/\(m rad/s\)", 0.01),
        ("height", "m", 1.0),
    ],
)
def test_ranges_of_spread(name, unit, most):
    bad = [
        (-0.1, 0.1 * most),
        (0.5 * most, 0.2 * most),
        (0.0, 2 * most),
        (NAN, most),
        (0.0, INF),
        (0.0,),
        (0.0, 0.0, 0.0),
    ]
    for value in (*bad, 0.005, "ab", (True, most), ("0", "1"), {0.0: 1.0, 0.1: 1.0}):
        with pytest.raises(
            ValueError, match=rf"^Spread\.{name} must be \(least, greatest\) between 0 and [\d.]+ \({unit}\), got"
        ):
            Spread(**{name: value})
    assert getattr(Spread(**{name: [0.5 * most, 1 * most]}), name) == (0.5 * most, most)


def test_a_hull_that_a_step_would_skip():
    for value in ((0.0, 0.2), (0.001, 0.001)):
        with pytest.raises(ValueError, match=r"^Spread\.height must begin at 0\.0025 m or be \(0, 0\), got"):
            Spread(height=value)
    assert Spread(height=(0, 0)).height == (0.0, 0.0)


@pytest.mark.parametrize("makes", [make, lambda **options: native(2, **options)], ids=["single", "vector"])
def test_options(makes):
    for level in (6, -1, 17, "6", "gale"):
        with pytest.raises(ValueError, match=rf"^weather must be a level from 0 to 5 or a Weather, got {level!r}"):
            makes(weather=level)
    for value in (True, 2.0, None, [1], {"wind": 1.0}, np.float64(3.0)):
        with pytest.raises(TypeError, match=r"^weather must be a level from 0 to 5 or a hydrone_gym\.Weather, got "):
            makes(weather=value)
    for value in (True, "0.1", [0.1], NAN):
        with pytest.raises(TypeError, match=r"^vehicle_spread must be a hydrone_gym\.Spread, a number or None, got "):
            makes(vehicle_spread=value)
    for value in (-0.1, 1.0):
        with pytest.raises(ValueError, match=r"^Spread\.mass must lie between 0 and 0\.9"):
            makes(vehicle_spread=value)
    with pytest.raises(ValueError, match=r"^Scenario\.weather must be a Weather or None, got 3"):
        Scenario(start=(0.0, 0.0, 3.0, 0.0), goal=(5.0, 0.0, 3.0), obstacles=[], weather=3)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("height", "m"),
        ("rotor_lag_air", "s"),
        ("rotor_lag_water", "s"),
        ("rotor_drag", r"N s/\(m rad/s\)"),
        ("near_water_radius", "m"),
        ("medium_delay", "s"),
    ],
)
def test_new_fields_of_vehicles(name, unit):
    with pytest.raises(ValueError, match=rf"^Vehicle\.{name} must be not negative \({unit}\), got -0\.1"):
        dataclasses.replace(HYDRONE, **{name: -0.1})
    for value in (NAN, INF, True, "0.1", None):
        with pytest.raises(ValueError, match=rf"^Vehicle\.{name} must be a finite number \({unit}\), got "):
            dataclasses.replace(HYDRONE, **{name: value})


def test_curves_of_thrust():
    for value in (1e-9, (1e-9, 0.0), (1e-9, 0.0, 0.0, 0.0)):
        with pytest.raises(ValueError, match=r"^Vehicle\.thrust_water_curve must hold 3 numbers \(m\^4/rpm\^2, "):
            Vehicle(thrust_water_curve=value)
    with pytest.raises(ValueError, match=r"^Vehicle\.thrust_water_curve must be a finite number"):
        Vehicle(thrust_water_curve=(1e-9, NAN, 0.0))


@pytest.mark.parametrize("curve", [(-1e-9, 0.0, 0.0), (1e-9, -1e-12, 0.0), (0.0, 1e-13, 0.0)])
def test_curves_that_do_not_pull_are_refused(curve):
    """Negative anywhere up to the rotors' limit, or zero at rest but not beyond it."""
    with pytest.raises(ValueError, match=r"^Vehicle\.thrust_water_curve must "):
        Vehicle(thrust_water_curve=curve)
    assert HYDRONE_2021.thrust_water_curve[0] > 0.0


def test_a_vehicle_thinner_than_a_step():
    with pytest.raises(ValueError, match=r"^Vehicle\.height must be 0 or at least 0\.0025 m"):
        Vehicle(height=0.001)


def test_registering():
    class Crowd(NamedTuple("Crowd", [(f"n{k}", float) for k in range(MOST + 1)])):
        """Too many."""

    for kind in (Crowd, dict, int):
        with pytest.raises(TypeError, match=r"^a disturbance must be a NamedTuple of at most 12 numbers, got"):
            register(kind, lambda numbers, chance, place, time: None)
