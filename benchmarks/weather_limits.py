"""What no law can do in the weather of each level, by the balance of forces alone: the table of docs/promise.md.

    python -m benchmarks.weather_limits

Nothing is flown. Every figure follows from the numbers of vehicle, world and weather that simulations use too.
"""

import math
from collections.abc import Callable

import numpy as np
import tyro
from rich.console import Console

from benchmarks.tables import Sheet
from hydrone_gym.physics.immersion import unmodelled_of
from hydrone_gym.physics.parameters import hull_of, vehicle_params
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL, Vehicle
from hydrone_gym.weather import Weather
from hydrone_gym.weather.current import current_params
from hydrone_gym.weather.waves import sea_params, wave_number
from hydrone_gym.weather.weather import DEPTH, LEVELS, ROTOR_DRAG
from hydrone_gym.weather.wind import dryden
from hydrone_gym.world.world import World
from planners import refusal

WORLD = World()
STRONG = 2.0  # standard deviations above the mean
WALL = 1.0  # m: how near a wall Experiment 2 starts
_STEP = 0.01  # s; nothing steady depends on it
Pair = tuple[float, float]
Rows = dict[str, Callable[[Weather], str]]


def winds(weather: Weather) -> Pair:
    """Mean wind and a strong gust along it, m/s."""
    return weather.wind, weather.wind + STRONG * weather.turbulence * dryden(weather.wind)[0]


def currents(weather: Weather) -> Pair:
    """Mean current and a strong one, m/s."""
    current = current_params(weather.current, weather.current_variation, _STEP)
    return current.speed, current.speed + STRONG * current.deviation


def holding_tilt(wind: float, rotor_drag: float = ROTOR_DRAG, vehicle: Vehicle = HYDRONE) -> float:
    """Tilt (rad) whose lateral lift balances the drag of rotors at hover and of the hull in a wind (m/s)."""
    hull = hull_of(vehicle)._replace(rotor_drag=rotor_drag)
    rotors = 4.0 * unmodelled_of(hull, _STEP).rotor_drag * vehicle.hover_speed * wind
    return refusal.holding_tilt(vehicle, wind, rotors)


def full_thrust(vehicle: Vehicle) -> float:
    """Thrust of one rotor under water at its greatest speed, N."""
    water = vehicle_params(vehicle).water
    return water.thrust * water.rotor_max**2


def surge(vehicle: Vehicle = HYDRONE) -> float:
    """Speed through the water (m/s) at which drag is as great as the thrust of both driving rotors."""
    water = vehicle_params(vehicle).water
    return math.sqrt(2.0 * full_thrust(vehicle) * water.inverse_mass / water.drag_x)


def turning_time(vehicle: Vehicle, angle: float = 0.5 * math.pi) -> float:
    """Time (s) of a turn (rad) from rest under water with all of the differential thrust.

    The rate r obeys ṙ = a − n r², so the angle turned is log(cosh(√(a n) t)) / n.
    """
    nominal = vehicle_params(vehicle)
    a = 2.0 * nominal.arm * full_thrust(vehicle) * nominal.water.inverse_inertia_z
    n = nominal.water.rotational_drag_z
    grown = angle * n  # acosh(e^grown), which would overflow
    return (grown + math.log1p(math.sqrt(-math.expm1(-2.0 * grown)))) / math.sqrt(a * n)


def carried(current: float, time: float, vehicle: Vehicle = HYDRONE) -> float:
    """Way (m) that a vehicle side on to a current (m/s) is carried in a time (s), from rest.

    Its speed relative to the water, u at first, obeys u̇ = −c u².
    """
    c = vehicle_params(vehicle).water.drag_y
    return current * time - math.log1p(c * current * time) / c


def orbital_speed(height: float, period: float, depth: float = 0.0) -> float:
    """Greatest horizontal speed (m/s) of the water a depth (m) below a wave of a height (m) and a period (s)."""
    sea = sea_params(height, period, False, DEPTH)
    k = wave_number(sea.peak, sea.depth)
    return sea.first * sea.peak * math.cosh(k * (sea.depth - depth)) / math.sinh(k * sea.depth)


def share_below(limit: float, greatest: float) -> float:
    """Share of time in which a speed that swings as a cosine stays within a limit (both m/s)."""
    return 2.0 / math.pi * math.asin(min(limit / greatest, 1.0)) if greatest else 1.0


def verdict(values: Pair, limit: float, unit: str, strong: str) -> str:
    """Whether a mean and a strong value keep a limit, and by which figure (of a unit) they do not."""
    mean, most = values
    if mean > limit:
        return f"impossible: {mean:.2g}{unit}"
    return f"impossible {strong}: {most:.2g}{unit}" if most > limit else "possible"


def tilts(weather: Weather) -> Pair:
    """Tilt (degrees) that holds the vehicle in the mean wind and in a strong gust, with the mean rotor drag."""
    drag = float(np.mean(weather.spread.rotor_drag or HYDRONE.rotor_drag))
    mean, gust = (math.degrees(holding_tilt(wind, drag)) for wind in winds(weather))
    return mean, gust


def headings(weather: Weather) -> Pair:
    """Angle (degrees) off a wall at which full thrust just keeps a mean and a strong current from carrying to it."""
    mean, strong = (math.degrees(math.asin(min(current / surge(), 1.0))) for current in currents(weather))
    return mean, strong


def ways(weather: Weather, vehicle: Vehicle, turns: Pair = (90.0, 90.0)) -> Pair:
    """Way (m) that a mean and a strong current carry a vehicle while it turns from side on (degrees)."""
    times = (turning_time(vehicle, math.radians(turn)) for turn in turns)
    mean, strong = (carried(current, time, vehicle) for current, time in zip(currents(weather), times, strict=True))
    return mean, strong


def orbits(weather: Weather) -> Pair:
    """Greatest speed (m/s) of the water in waves, at the surface and where the zone ends."""
    height, period = weather.wave_height, weather.wave_period
    return orbital_speed(height, period), orbital_speed(height, period, WORLD.zone)


def pair(values: Pair) -> str:
    return " / ".join(f"{round(value, 2):.2g}" for value in values)


def wind_rows() -> Rows:
    def held(limit: float) -> Callable[[Weather], str]:
        return lambda weather: verdict(tilts(weather), math.degrees(limit), "°", "in gusts")

    air, robust = HYDRONE.air_gains, HYDRONE.robust_gains
    named = {
        f"still at the surface, within {math.degrees(WORLD.rough_tilt):.0f}°, else rough": WORLD.rough_tilt,
        f"still in the zone, paper's law, {math.degrees(air.vertical_tilt_limit):.0f}°": air.vertical_tilt_limit,
        f"still elsewhere in air, paper's law, {math.degrees(air.tilt_limit):.0f}°": air.tilt_limit,
        f"the same, robust law, {math.degrees(robust.tilt_limit):.0f}°": robust.tilt_limit,
    }
    return {
        "wind, mean / gust (m/s)": lambda weather: pair(winds(weather)),
        "tilt that holds it (°)": lambda weather: pair(tilts(weather)),
        **{demand: held(limit) for demand, limit in named.items()},
    }


def current_rows() -> Rows:
    def kept(limit: float) -> Callable[[Weather], str]:
        return lambda weather: verdict(currents(weather), limit, " m/s", "when strong")

    paper, physical = turning_time(HYDRONE), turning_time(HYDRONE_PHYSICAL)
    return {
        "current, mean / strong (m/s)": lambda weather: pair(currents(weather)),
        f"in place under water, facing it, {surge():.2f} m/s at full thrust": kept(surge()),
        f"entry still over ground, within {WORLD.rough_speed:g} m/s of the water, else rough": kept(WORLD.rough_speed),
        f"carried in a quarter turn, Table 1, {paper:.1f} s (m)": lambda weather: pair(ways(weather, HYDRONE)),
        f"carried, physical set, {physical:.1f} s (m)": lambda weather: pair(ways(weather, HYDRONE_PHYSICAL)),
        f"turned to face it before a wall {WALL:g} m away, Table 1": lambda weather: verdict(
            ways(weather, HYDRONE), WALL, " m", "when strong"
        ),
        "off the wall that suffices at full thrust (°)": lambda weather: pair(headings(weather)),
        "carried while turning that far, Table 1 (m)": lambda weather: pair(ways(weather, HYDRONE, headings(weather))),
    }


def wave_rows() -> Rows:
    rough = WORLD.rough_speed

    def moments(weather: Weather) -> str:
        speed = orbits(weather)[0]
        return "possible" if speed <= rough else f"impossible: {speed:.2g} m/s"

    return {
        f"water in waves, surface / {WORLD.zone:g} m below (m/s)": lambda weather: pair(orbits(weather)),
        f"time within {rough:g} m/s there (%)": lambda weather: " / ".join(
            f"{100.0 * share_below(rough, speed):.0f}" for speed in orbits(weather)
        ),
        "entry still over ground at any moment, without current": moments,
    }


def sheet() -> Sheet:
    """The table: a row for each demand, a column for each level."""
    rows = [
        (demand, *(answer(weather) for weather in LEVELS))
        for demand, answer in {**wind_rows(), **current_rows(), **wave_rows()}.items()
    ]
    return Sheet("What forces allow", ("level", *map(str, range(len(LEVELS)))), rows)


def main() -> None:
    """Print the table."""
    Console().print(sheet().markdown(), soft_wrap=True, markup=False)


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
