"""Weather and spreads as users write them: what is still, the named levels, and bounds that physics sets."""

import math
from dataclasses import fields, replace
from itertools import pairwise

import pytest

from hydrone_gym import HYDRONE, HYDRONE_2021, HYDRONE_PHYSICAL, Spread, Weather
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.weather import named_weather
from hydrone_gym.weather.waves import wave_number
from hydrone_gym.weather.weather import DEPTH, LEVELS

HUGE = 10**400  # an integer that no float holds


def steepest(period):
    """Michell's and Miche's height (m) of a wave that is about to break."""
    k = wave_number(2.0 * math.pi / period, DEPTH)
    return 0.142 * math.tanh(k * DEPTH) * 2.0 * math.pi / k


def spreads(name):
    """Least and greatest value of a range of `Spread` at each level above 0."""
    return [getattr(weather.spread, name) for weather in LEVELS[1:]]


def grows(values):
    return all(before < after for before, after in pairwise(values))


def test_nothing_given_is_still():
    assert Weather().still
    assert LEVELS[0].still
    assert Weather(wind_direction=1.0, turbulence=2.0, wave_period=5.0, sea="jonswap", name="calm").still


@pytest.mark.parametrize(
    "change",
    [{"wind": 0.1}, {"current": 0.1}, {"wave_height": 0.01}]
    + [{"spread": Spread(**{name: 0.01})} for name in ("mass", "thrust", "inertia", "drag")]
    + [
        {"spread": Spread(**{name: (0.0, 0.0)})}
        for name in ("rotor_lag_air", "rotor_lag_water", "rotor_drag", "height")
    ],
)
def test_whatever_moves_or_is_not_known_is_not_still(change):
    assert not Weather(**change).still


@pytest.mark.parametrize("name", ["wind", "current", "wave_height", "wave_period"])
def test_levels_of_weather_grow(name):
    assert grows([getattr(weather, name) for weather in LEVELS[name == "wave_period" :]])


@pytest.mark.parametrize("name", ["mass", "thrust", "inertia", "drag"])
def test_levels_of_error_grow(name):
    assert grows([getattr(weather.spread, name) for weather in LEVELS])


def test_levels_of_lag_grow():
    for name in ("rotor_lag_air", "rotor_lag_water"):
        low, high = zip(*spreads(name), strict=True)
        assert grows(low)
        assert grows(high)
        assert grows([b - a for a, b in spreads(name)])
    assert spreads("rotor_lag_air")[0] == pytest.approx((0.005, 0.015))
    assert spreads("rotor_lag_air")[-1] == pytest.approx((0.02, 0.05))
    assert spreads("rotor_lag_water")[-1] == pytest.approx((1.0 / 30.0, 0.1))


def test_rotor_drag_of_levels_lies_around_that_of_a_known_vehicle():
    for weather, (low, high) in zip(LEVELS[1:], spreads("rotor_drag"), strict=True):
        assert 0.5 * (low + high) == pytest.approx(1.19e-4)
        assert high / low == pytest.approx((1.0 + weather.spread.drag) / (1.0 - weather.spread.drag))
    assert spreads("height") == [(0.135, 0.2)] * 5


def test_levels_as_they_are_told():
    told = [(w.wind, w.current, w.wave_height, w.wave_period, w.spread.mass) for w in LEVELS[1:]]
    assert told == [
        (1.0, 0.1, 0.05, 1.2, 0.01),
        (2.0, 0.2, 0.1, 1.5, 0.02),
        (3.0, 0.3, 0.2, 2.0, 0.04),
        (5.0, 0.4, 0.3, 2.5, 0.07),
        (8.0, 0.5, 0.5, 3.0, 0.1),
    ]
    assert {(w.turbulence, w.sea, w.wind_direction) for w in LEVELS} == {(1.0, "regular", None)}


def test_a_level_has_two_spellings():
    for level, weather in enumerate(LEVELS):
        assert named_weather(level) is named_weather(str(level)) is named_weather(weather) is weather


@pytest.mark.parametrize("value", [-1, 6, HUGE, "6", "-1", "03", " 3", "calm", ""])
def test_unknown_levels_are_refused(value):
    with pytest.raises(ValueError, match=r"^weather must be a level from 0 to 5 or a Weather, got "):
        named_weather(value)


@pytest.mark.parametrize("value", [True, 3.0, None, [3], Spread()])
def test_what_is_no_level_is_refused(value):
    with pytest.raises(TypeError, match=r"^weather must be a level from 0 to 5 or a hydrone_gym\.Weather, got "):
        named_weather(value)


def test_a_number_is_a_spread_of_what_is_measured():
    assert Spread.of(0.1) == Spread(mass=0.1, thrust=0.1, inertia=0.1, drag=0.1)
    assert Spread.of(None) == Spread.of(0) == Spread()
    own = Spread(mass=0.2)
    assert Spread.of(own) is own


def test_whole_numbers_and_lists_take_one_form():
    made = Weather(wind=3, wind_direction=1, current=1, current_direction=-2, wave_direction=0, spread=Spread(drag=0))
    assert made == Weather(wind=3.0, wind_direction=1.0, current=1.0, current_direction=-2.0, wave_direction=0.0)
    assert not any(type(getattr(made, spec.name)) is int for spec in fields(Weather))
    assert hash(replace(made, spread=Spread(height=[1, 1]))) == hash(replace(made, spread=Spread(height=(1.0, 1.0))))


@pytest.mark.parametrize(
    "name", ["wind", "turbulence", "current", "current_variation", "wave_height", "wave_period", "wave_direction"]
)
def test_integers_beyond_floats_are_refused_like_any_number(name):
    for value in (HUGE, -HUGE):
        with pytest.raises(ValueError, match=rf"^Weather\.{name} must .*, got -?1000"):
            Weather(**{name: value})


@pytest.mark.parametrize(
    ("kind", "change", "message"),
    [
        (Weather, {"wave_height": -0.1}, r"Weather\.wave_height must lie between 0 and 3 \(m; .*\), got -0\.1"),
        (Weather, {"wave_period": 0}, r"Weather\.wave_period must lie between 0\.3 and 20 \(s; .*\), got 0"),
        (Weather, {"wind": math.nan}, r"Weather\.wind must lie between 0 and 20 \(m/s; .*\), got nan"),
        (Weather, {"current": True}, r"Weather\.current must lie between 0 and 2 \(m/s; .*\), got True"),
        (Weather, {"wave_direction": math.inf}, r"Weather\.wave_direction must be a finite number \(rad\) .*, got inf"),
        (Spread, {"drag": -0.1}, r"Spread\.drag must lie between 0 and .*, a share of the nominal value, got -0\.1"),
        (
            Spread,
            {"rotor_lag_air": (0.2, 0.1)},
            r"Spread\.rotor_lag_air must be \(least, greatest\) .* \(s\), got \(0\.2",
        ),
    ],
)
def test_bad_values_are_refused_by_name_rule_and_unit(kind, change, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        kind(**change)


def test_integers_beyond_floats_are_refused_in_spreads():
    with pytest.raises(ValueError, match=r"^Spread\.mass must lie between 0 and "):
        Spread(mass=HUGE)
    with pytest.raises(ValueError, match=r"^Spread\.height must be \(least, greatest\) between 0 and 1 \(m\), got "):
        Spread(height=(0.1, HUGE))


@pytest.mark.parametrize(("period", "share"), [(0.5, "0.142"), (1.0, "0.142"), (3.0, "0.139"), (4.0, "0.126")])
def test_waves_may_be_as_steep_as_they_break(period, share):
    """In shallow water they break earlier than the 0.142 of their length of deep water."""
    highest = steepest(period)
    assert Weather(wave_height=0.999 * highest, wave_period=period).wave_period == period
    too_high = 1.001 * highest
    length = 2.0 * math.pi / wave_number(2.0 * math.pi / period, DEPTH)
    message = (
        rf"^Weather\.wave_height must be at most {highest:.3g} m for a period of {period:g} s: "
        rf"a wave {length:.3g} m long breaks beyond {share} of its length, got {too_high!r} m$"
    )
    with pytest.raises(ValueError, match=message):
        Weather(wave_height=too_high, wave_period=period)


def test_ideal_vehicles_are_those_of_the_paper():
    assert HYDRONE.ideal
    assert HYDRONE_PHYSICAL.ideal
    assert not HYDRONE_2021.ideal
    assert named_vehicle("hydrone-2021") is HYDRONE_2021
    for name in ("height", "rotor_lag_air", "rotor_lag_water", "rotor_drag", "near_water_radius", "medium_delay"):
        assert not replace(HYDRONE, **{name: 0.1}).ideal
    assert not replace(HYDRONE, thrust_water_curve=(1e-9, 0.0, 0.0)).ideal
