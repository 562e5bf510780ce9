"""A tick of weather in a loop over sixteen lanes: as one lane has it bit for bit, and side by side in machine code."""

import platform
import re

import llvmlite.binding
import numpy as np
import pytest

from hydrone_gym import _jit
from hydrone_gym._jit import inlined, kernel
from hydrone_gym.control.laws import LAWS
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.weather import current as currents
from hydrone_gym.weather import waves
from hydrone_gym.weather import wind as winds
from hydrone_gym.weather.current import Eddies
from hydrone_gym.weather.noise import Key, derived, kicks, normals
from hydrone_gym.weather.weather import LEVELS
from hydrone_gym.weather.wind import Gusts
from hydrone_gym.world.world import World
from tests.simulation.test_rows import equal, mission
from tests.weather.outdoors import conditions_for, play_in_weather

LANES = 16
WIND = winds.wind_params(6.0, 1.0, True, 0.05)
CURRENT = currents.current_params(0.3, 0.4, 0.05)
SEA = waves.sea_params(0.3, 2.0, True, 5.0)
NUMBERS = 12  # of a lane: key, count, place and time, states of gusts and eddies
LIBM = ("sin", "cos", "sincos", "exp", "log", "pow", "fmod")


@kernel
def wave_of(key):
    return waves.draw_sea(SEA, (0.6, 0.8), key, 3.0).third


WAVE = wave_of(Key(1.0, 2.0))


@inlined
def tick(given, made, i, lanes):
    key = derived(Key(given[i], given[lanes + i]), given[2 * lanes + i])
    n = given[2 * lanes + i]
    z, time = given[3 * lanes + i], given[4 * lanes + i]
    gusts = Gusts(
        given[5 * lanes + i], given[6 * lanes + i], given[7 * lanes + i], given[8 * lanes + i], given[9 * lanes + i]
    )
    eddies = Eddies(given[10 * lanes + i], given[11 * lanes + i])
    a, b = kicks(key, n)
    c, d = kicks(key, n + 1.0)
    e, f = normals(key, n + 2.0)
    gusts = winds.next_gusts(gusts, WIND, (a, b, c, d, e))
    eddies = currents.next_eddies(eddies, CURRENT, (f, a))
    x, y, up = winds.velocity(gusts, WIND, (0.6, 0.8), winds.shear_profile(z, 1.0))
    flow_x, flow_y = currents.velocity(eddies, CURRENT, (0.0, 1.0))
    swell = waves.add_wave(waves.calm(), WAVE, (x, y, z), (a, b), time)
    made[i], made[lanes + i], made[2 * lanes + i] = x, y, up
    made[3 * lanes + i], made[4 * lanes + i] = flow_x, flow_y
    made[5 * lanes + i], made[6 * lanes + i] = swell.elevation, swell.rate
    made[7 * lanes + i], made[8 * lanes + i], made[9 * lanes + i] = swell.u, swell.v, swell.w
    made[10 * lanes + i], made[11 * lanes + i] = swell.ax, swell.az


def side_by_side(given, made):
    for i in range(LANES):
        tick(given, made, i, LANES)


@kernel
def one(given, made):
    tick(given, made, 0, 1)


def given(rng):
    numbers = rng.normal(0.0, 1.0, (NUMBERS, LANES))
    numbers[:3] = np.floor(rng.uniform(0.0, 2.0**31, (3, LANES)))
    numbers[3] = rng.uniform(-5.0, 8.0, LANES)
    numbers[4] = rng.uniform(0.0, 200.0, LANES)
    return numbers


def test_lanes_are_equal_to_one():
    together, rng = kernel(side_by_side), np.random.default_rng(6)
    for _ in range(200):
        numbers = given(rng)
        expected, found = np.empty((NUMBERS, LANES)), np.empty(NUMBERS * LANES)
        for i in range(LANES):
            made = np.empty(NUMBERS)
            one(numbers[:, i].copy(), made)
            expected[:, i] = made
        together(numbers.ravel(), found)
        np.testing.assert_array_equal(found.reshape(NUMBERS, LANES), expected)
        assert np.isfinite(found).all()


@pytest.mark.parametrize("law", LAWS)
def test_sixteen_rows_in_weather_equal_one(law):
    rows, references, spheres = mission(np.random.default_rng(8), count=40, periods=8)
    flown = {}
    for lanes in (1, LANES):
        conditions = conditions_for(rows, lanes, LEVELS[3])
        simulation = Simulation(HYDRONE, World(), lanes=lanes, law=law, weathered=True)
        flown[lanes] = play_in_weather(simulation, rows, references, conditions, spheres)
    equal(flown[1][0], flown[LANES][0])
    equal(flown[1][1], flown[LANES][1])


@pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or not llvmlite.binding.get_host_cpu_features().get("avx2"),
    reason="reads the names of x86-64 instructions, and needs AVX2",
)
def test_lanes_run_side_by_side(monkeypatch):
    """The loop is there twice, packed and, for arrays that overlap, scalar; nothing calls the C library."""
    monkeypatch.setattr(_jit, "cache_root", lambda: None)
    compiled = kernel(side_by_side)
    compiled(given(np.random.default_rng(7)).ravel(), np.empty(NUMBERS * LANES))
    (assembly,) = compiled.inspect_asm().values()
    instructions = [line for line in assembly.splitlines() if re.match(r"^\s+[a-z]", line)]
    called = {name for line in instructions for name in LIBM if re.search(rf"[\s$]{name}(@\w+)?(,|\s|$)", line)}
    assert not called
    assert not re.findall(r"^(\S*hydrone_gym\S*):", assembly, re.MULTILINE)
    for operation in ("mul", "(?:add|sub)", "sqrt", "div"):
        packed, scalar = (len(re.findall(rf"^\s+v?{operation}{kind}\s", assembly, re.M)) for kind in ("pd", "sd"))
        assert packed >= scalar > 0, f"{operation}: {packed} packed, {scalar} scalar"
