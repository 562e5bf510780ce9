"""The conditions a lane flies in: the vehicle as it is, and the weather around it.

They lie beside the lanes like the obstacles do, number k of lane i at ``k * lanes + i``, and only the kernel for
weather reads them, see `in_weather`. `begin_conditions` draws those of an episode from its key.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym._memory import gather, offsets_of, packed, pointer, scatter, size_of, unpacked
from hydrone_gym.physics.immersion import Fluid, Rotors, Unmodelled, unmodelled_of
from hydrone_gym.physics.parameters import Hull, VehicleParams, hull_of, params_of
from hydrone_gym.simulation.clock import DT, TICK
from hydrone_gym.surface import is_air
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.weather import current as currents
from hydrone_gym.weather import waves
from hydrone_gym.weather import wind as winds
from hydrone_gym.weather.current import CurrentParams, Eddies
from hydrone_gym.weather.disturbance import MOST
from hydrone_gym.weather.noise import Key, derived, uniforms
from hydrone_gym.weather.spread import SpreadParams, draw_hull, spread_params
from hydrone_gym.weather.waves import Sea, SeaParams
from hydrone_gym.weather.weather import Spread, Weather
from hydrone_gym.weather.wind import Gusts, WindParams

# Which pairs of an episode's key are for what.
_DIRECTIONS, _VEHICLE, _GUSTS, _EDDIES, _WAVES, _CHANCES, TICKS_FROM = 0.0, 2.0, 10.0, 13.0, 14.0, 20.0, 64.0
A_TICK = 4.0  # pairs that a tick takes
_WEATHER = 1  # the child of a seed that is for weather


class Heading(NamedTuple):
    """Where something runs to: cosine and sine of its direction, from +x to +y."""

    cosine: float
    sine: float


class Headings(NamedTuple):
    """Where wind, current and waves run to."""

    wind: Heading
    current: Heading
    waves: Heading


class Noticed(NamedTuple):
    """Which medium the vehicle is in, and which one its controller takes it to be in; 1 for air."""

    air: float
    driven: float
    waited: float  # s that they have differed
    spun: float  # rpm of the aerial rotors that turn beside the aquatic ones, before a water exit


class Chances(NamedTuple):
    """What a disturbance draws an episode with: even between 0 and 1."""

    chance_0: float
    chance_1: float
    chance_2: float
    chance_3: float


class Conditions(NamedTuple):
    """The conditions of one lane."""

    vehicle: VehicleParams
    real: Unmodelled
    rotors: Rotors
    noticed: Noticed
    fluid: Fluid
    gusts: Gusts
    eddies: Eddies
    key: Key
    wind: WindParams
    current: CurrentParams
    headings: Headings
    sea: Sea
    chances: Chances
    disturbed: float  # 1 where there is a disturbance, whose numbers come after


class Climate(NamedTuple):
    """What the conditions of episodes are drawn from: a vehicle, its spread, and a weather."""

    hull: Hull
    spread: SpreadParams
    wind: WindParams
    current: CurrentParams
    sea: SeaParams
    wind_direction: float  # rad; not a number if it is drawn
    current_direction: float
    wave_direction: float
    disturbed: float  # 1 if a disturbance's numbers come after


AT = offsets_of(Conditions)
DRIVEN = AT.noticed + offsets_of(Noticed).driven
EXTRA = size_of(Conditions)  # a disturbance's numbers
CONDITIONS = EXTRA + MOST
_EXTRA_OF_CLIMATE = size_of(Climate)
_FLUID = offsets_of(Fluid)
_HEADINGS = AT.headings + np.arange(4)  # of wind and current
_WEIGHTS = np.array([AT.vehicle + getattr(offsets_of(VehicleParams), medium) for medium in ("air", "water")])


def climate_of(vehicle: Vehicle, weather: Weather, spread: Spread, depth: float) -> np.ndarray:
    """Pack what episodes of a vehicle in a weather are drawn from, over water of a depth (m)."""
    given = weather.wind_direction, weather.current_direction, weather.wave_direction
    to_wind, to_current, to_waves = (math.nan if direction is None else direction for direction in given)
    numbers = packed(
        Climate(
            hull_of(vehicle),
            spread_params(spread, vehicle),
            winds.wind_params(weather.wind, weather.turbulence, weather.shear, TICK),
            currents.current_params(weather.current, weather.current_variation, TICK),
            waves.sea_params(weather.wave_height, weather.wave_period, weather.sea == "jonswap", depth),
            to_wind,
            to_current,
            to_waves,
            float(weather.extra is not None),
        )
    )
    extra = np.zeros(MOST)
    extra[: len(weather.extra or ())] = weather.extra or ()
    return np.concatenate([numbers, extra])


@inlined
def _heading(direction, share):
    """The heading of a direction (rad), drawn by a uniform number if it is not a number."""
    angle = 2.0 * math.pi * share if math.isnan(direction) else direction
    return Heading(math.cos(angle), math.sin(angle))


@inlined
def _begin(memory, i, lanes, row, numbers, key):
    """Draw the conditions of the episode with a key that lane i begins."""
    climate = gather(numbers, 0, 0, 1, Climate)
    for k in range(MOST):
        memory[(EXTRA + k) * lanes + i] = numbers[_EXTRA_OF_CLIMATE + k]
    scatter(memory, AT.disturbed, i, lanes, climate.disturbed)
    scatter(memory, AT.key, i, lanes, key)
    hull = draw_hull(climate.hull, climate.spread, key, _VEHICLE)
    vehicle = params_of(hull)
    scatter(memory, AT.vehicle, i, lanes, vehicle)
    scatter(memory, AT.real, i, lanes, unmodelled_of(hull, DT))
    to_wind, to_current = uniforms(key, _DIRECTIONS)
    to_waves, _ = uniforms(key, _DIRECTIONS + 1.0)
    scatter(memory, AT.chances, i, lanes, Chances(*uniforms(key, _CHANCES), *uniforms(key, _CHANCES + 1.0)))
    headings = Headings(
        _heading(climate.wind_direction, to_wind),
        _heading(climate.current_direction, to_current),
        _heading(climate.wave_direction, to_waves),
    )
    scatter(memory, AT.headings, i, lanes, headings)
    scatter(memory, AT.wind, i, lanes, climate.wind)
    scatter(memory, AT.current, i, lanes, climate.current)
    scatter(memory, AT.gusts, i, lanes, winds.first_gusts(key, _GUSTS))
    scatter(memory, AT.eddies, i, lanes, currents.first_eddies(key, _EDDIES))
    sea = waves.draw_sea(climate.sea, headings.waves, key, _WAVES)
    scatter(memory, AT.sea, i, lanes, sea)
    place = (row.state[0], row.state[1], row.state[2])
    swell = add_rest(waves.add_wave(waves.calm(), sea.first, place, (0.0, 0.0), 0.0), sea, place, (0.0, 0.0), 0.0)
    gusts, profile = gather(memory, AT.gusts, i, lanes, Gusts), winds.shear_profile(place[2], climate.wind.shear)
    wind = winds.velocity(gusts, climate.wind, headings.wind, profile)
    eddies = gather(memory, AT.eddies, i, lanes, Eddies)
    flow = currents.velocity(eddies, climate.current, headings.current)
    scatter(memory, AT.fluid, i, lanes, fluid_of(wind, wind, flow, flow, swell, 1.0))
    air = 1.0 if is_air(place[2] - swell.elevation) else 0.0
    scatter(memory, AT.noticed, i, lanes, Noticed(air, air, 0.0, 0.0))
    # its rotors hold it already: four in air, the two that lift in water
    lifting = vehicle.hover_speed if air > 0.0 else -np.sqrt(abs(vehicle.water.weight) / (2.0 * vehicle.water.thrust))
    driving = lifting if air > 0.0 else 0.0
    scatter(memory, AT.rotors, i, lanes, Rotors(lifting, driving, lifting, driving))


@inlined
def add_rest(swell, sea, place, velocity, time):
    """Add all components of a sea but the first."""
    swell = waves.add_wave(swell, sea.second, place, velocity, time)
    swell = waves.add_wave(swell, sea.third, place, velocity, time)
    return waves.add_wave(swell, sea.fourth, place, velocity, time)


def key_of(generator: np.random.Generator) -> tuple[float, float]:
    """Return the key of all episodes of a generator's seed: what is drawn from the generator does not change it."""
    seed: Any = generator.bit_generator.seed_seq
    child = np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, _WEATHER))
    low, high = child.generate_state(2).tolist()
    return float(low), float(high)


class Steady(NamedTuple):
    """A disturbance that does not change: what planners believe in."""

    wind_x: float  # of the air, m/s
    wind_y: float
    push_air: float  # upward force on the vehicle in air, N
    water_x: float  # of the water, m/s
    water_y: float
    push_water: float  # the same in water


def still_conditions(vehicle: Vehicle) -> NDArray[np.float64]:
    """Return the conditions (CONDITIONS,) of one lane in which a vehicle flies in still air and flat water.

    Its rotors follow at once and the medium is noticed at once, whatever the vehicle's are: what a flight would have to
    remember of them is not in its state.
    """
    hull = hull_of(vehicle)._replace(rotor_lag_air=0.0, rotor_lag_water=0.0, medium_delay=0.0)
    none = unpacked(Conditions, np.zeros(EXTRA))
    wind, current = none.wind._replace(speed=1.0), none.current._replace(speed=1.0)  # times headings of no length
    still = none._replace(vehicle=params_of(hull), real=unmodelled_of(hull, DT), wind=wind, current=current)
    return np.concatenate([packed(still), np.zeros(MOST)])


def steady_conditions(still: NDArray[np.float64], steady: Steady) -> NDArray[np.float64]:
    """Return conditions from `still_conditions` under a `Steady` disturbance."""
    conditions = still.copy()
    conditions[_HEADINGS] = steady.wind_x, steady.wind_y, steady.water_x, steady.water_y
    conditions[_WEIGHTS] -= steady.push_air, steady.push_water
    return conditions


def weather_at(conditions: NDArray[np.float64], lanes: int, count: int) -> dict[str, NDArray[np.float64]]:
    """Return what moves around rows [0, count): `wind` (n, 3) and `water` (n, 3) in m/s, `elevation` (n,) in m."""
    blocks = conditions.reshape(len(conditions), CONDITIONS, lanes)
    air, water, elevation = AT.fluid + _FLUID.air_x, AT.fluid + _FLUID.water_x, AT.fluid + _FLUID.elevation
    return {
        "wind": blocks[:, air : air + 3].transpose(0, 2, 1).reshape(-1, 3)[:count],
        "water": blocks[:, water : water + 3].transpose(0, 2, 1).reshape(-1, 3)[:count],
        "elevation": blocks[:, elevation].reshape(-1)[:count],
    }


def conditions_of(conditions: NDArray[np.float64], lanes: int, row: int) -> Conditions:
    """Return the conditions of a row."""
    block = conditions[row // lanes].reshape(CONDITIONS, lanes)[:, row % lanes]
    return unpacked(Conditions, block)


@kernel
def begin_conditions(conditions, lanes, rows, order, streams, climates, which):
    """Draw the conditions of episodes that begin.

    Args:
        conditions: (blocks, CONDITIONS * lanes), updated.
        lanes: rows a block.
        rows: (n,) dtype `ROW`, placed already.
        order: (k,) which rows, int64.
        streams: (n, 3) the key of all episodes of a row, two numbers, and which of them this one is.
        climates: (m, numbers) from `climate_of`.
        which: (k,) which of them each flies in, int64.
    """
    for k in range(order.size):
        n = order[k]
        key = derived(Key(streams[n, 0], streams[n, 1]), streams[n, 2])
        _begin(pointer(conditions[n // lanes]), n % lanes, lanes, rows[n], climates[which[k]], key)


@inlined
def fluid_of(air, next_air, flow, next_flow, swell, near_water):
    """Put air, current and waves together: velocities at both ends of a tick (m/s), and a `Swell`."""
    rate = 1.0 / TICK
    return Fluid(
        0.5 * (air[0] + next_air[0]),
        0.5 * (air[1] + next_air[1]),
        0.5 * (air[2] + next_air[2]),
        rate * (next_air[0] - air[0]),
        rate * (next_air[1] - air[1]),
        rate * (next_air[2] - air[2]),
        0.5 * (flow[0] + next_flow[0]) + swell.u,
        0.5 * (flow[1] + next_flow[1]) + swell.v,
        swell.w,
        swell.ax,
        swell.ay,
        swell.az,
        swell.elevation,
        swell.rate,
        near_water,
    )
