"""How fast can it cross? Success, acceleration, tilt and time through the surface against speed, waves and wind.

    python -m benchmarks.crossings                        every law, about a minute each
    python -m benchmarks.crossings --controllers paper    one of them

Writes benchmarks/results/crossings-LAW.json, docs/images/crossing-speeds-LAW.png and the tables of docs/crossings.md.
The flights of every cell begin alike: same places, same directions, same phase of the waves.
"""

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal, NamedTuple

import numpy as np
import tyro
from numpy.typing import NDArray
from tqdm import tqdm

from benchmarks import crossings_page
from benchmarks.columns import WORLD, Column, Flights, fly_column
from benchmarks.timing import save
from hydrone_gym.control.laws import LAWS
from hydrone_gym.evaluation.statistics import percentiles, wilson_interval
from hydrone_gym.simulation.outcome import RUNNING
from hydrone_gym.vehicle import HYDRONE_2021, Vehicle
from hydrone_gym.weather import Weather
from hydrone_gym.weather.weather import LEVELS, ROTOR_DRAG

SPEEDS = (0.2, 0.5, 1.0, 1.5, 2.0, 3.0)  # m/s, of the reference and of the law's limits
HEIGHTS = (0.0, 0.1, 0.3, 0.5)  # m
WINDS = (0.0, 2.0, 5.0, 10.0)  # m/s
STARTS = {"entry": 2.0, "exit": -2.0}  # m, within half a metre
PERIODS = {level.wave_height: level.wave_period for level in LEVELS}  # s
PATIENCE, WAY = 10.0, 4.0  # s and m: a flight has PATIENCE and the time of WAY at its speed
SETTLING = 5.0  # s at the start's height, in the wind


class Limits(NamedTuple):
    """What an aggressive crossing may be."""

    lateral: float  # m/s at the surface, relative to the water
    tilt: float  # degrees in the zone
    acceleration: float  # m/s^2 in the zone


AGGRESSIVE = Limits(1.0, 15.0, 25.0)


@dataclass(frozen=True, kw_only=True)
class Settings:
    controllers: tuple[Literal[tuple(LAWS)], ...] = tuple(LAWS)
    """control laws to fly"""
    flights: int = 2048
    """flights a cell"""


def limited(speed: float) -> Vehicle:
    """The authors' vehicle of 2021, its rotors in the wind, with laws that are limited to a vertical speed (m/s)."""
    air = replace(HYDRONE_2021.air_gains, zone_speed_limit=speed, vertical_speed_limit=speed)
    water = replace(HYDRONE_2021.water_gains, vertical_speed_limit=speed)
    names = ("zone_speed_limit", "descent_limit", "climb_limit", "dive_limit", "rise_limit")
    robust = replace(HYDRONE_2021.robust_gains, **dict.fromkeys(names, speed))
    return replace(HYDRONE_2021, air_gains=air, water_gains=water, robust_gains=robust, rotor_drag=ROTOR_DRAG)


def column(start: float, speed: float, flights: int) -> Column:
    """A reference so far beyond the zone that the law's limit, and nothing else, sets the speed all the way."""
    end = -math.copysign(min(WORLD.zone + 0.2 + speed, 4.0), start)
    return Column(start=start, end=end, hold=SETTLING, limit=PATIENCE + WAY / speed, flights=flights)


def smooth(flown: Flights) -> NDArray[np.bool_]:
    """Whether each came through without a rough crossing, by the environment's rule."""
    calm = (flown.lateral <= WORLD.rough_speed) & (flown.surface_tilt <= WORLD.rough_tilt)
    return came_through(flown) & calm


def aggressive(flown: Flights) -> NDArray[np.bool_]:
    """Whether each came through within the limits of an aggressive crossing."""
    upright = np.degrees(flown.tilt) <= AGGRESSIVE.tilt
    gentle = (flown.lateral <= AGGRESSIVE.lateral) & (flown.acceleration <= AGGRESSIVE.acceleration)
    return came_through(flown) & upright & gentle


def came_through(flown: Flights) -> NDArray[np.bool_]:
    """Whether each came out of the zone on the other side, in time."""
    return np.isfinite(flown.through) & (flown.outcome == RUNNING)


def rate(good: NDArray[np.bool_]) -> list[float]:
    """Share, and both ends of its Wilson interval."""
    return [float(good.mean()), *wilson_interval(int(good.sum()), good.size)]


def cell(law: str, direction: str, speed: float, height: float, wind: float, flights: int) -> dict[str, Any]:
    """Fly a cell. Peaks, medians and 95th percentiles, are of the flights that came through."""
    weather = Weather(wind=wind, wave_height=height, wave_period=PERIODS[height])
    flown = fly_column(limited(speed), column(STARTS[direction], speed, flights), weather, law)
    through = came_through(flown)
    quantities = {
        "acceleration": flown.acceleration,
        "tilt": np.degrees(flown.tilt),
        "seconds": flown.through - flown.began,
        "lateral": flown.lateral,
        "vertical": flown.vertical,
    }
    where = {"direction": direction, "speed": speed, "height": height, "wind": wind, "flights": through.size}
    rates = {"through": rate(through), "smooth": rate(smooth(flown)), "aggressive": rate(aggressive(flown))}
    return {**where, **rates, **{name: percentiles(value[through], (50.0, 95.0)) for name, value in quantities.items()}}


def measure(law: str, flights: int) -> list[dict[str, Any]]:
    """Fly all cells under a law."""
    every = list(product(STARTS, SPEEDS, HEIGHTS, WINDS))
    return [cell(law, *where, flights) for where in tqdm(every, desc=law, unit="cell")]


def main(settings: Settings) -> None:
    for law in settings.controllers:
        measured = {"law": law, "limits": AGGRESSIVE._asdict(), "cells": measure(law, settings.flights)}
        command = f"python -m benchmarks.crossings --controllers {law}"
        print(save(f"crossings-{law}", command, measured))
    crossings_page.write()


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
