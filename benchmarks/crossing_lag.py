"""Does it come through at all? Crossings in still air against the rotors' lag and how late the medium is noticed.

    python -m benchmarks.crossing_lag                        every law, some seconds each
    python -m benchmarks.crossing_lag --controllers paper    one of them

Each through an abrupt surface, and with a hull of 0.1 m. "paper-pre-spin" is the paper's law with aerial rotors that
turn before they are out of the water. Writes benchmarks/results/crossing_lag-LAW.json and the tables of
docs/crossings.md.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any, Literal

import numpy as np
import tyro

from benchmarks import crossings_page
from benchmarks.columns import PERIOD, Column, Flights, fly_column
from benchmarks.timing import save
from hydrone_gym.control.laws import LAWS
from hydrone_gym.evaluation.statistics import percentiles
from hydrone_gym.simulation.outcome import RUNNING
from hydrone_gym.vehicle import HYDRONE

LAGS = (0.0, 0.033, 0.1)  # s, of the rotors in both media
DELAYS = (0.0, 0.05, 0.1, 0.2)  # s until the controller notices the medium
HULLS = (0.0, 0.1)  # m
STARTS = {"entry": 2.0, "exit": -2.0}  # m, within half a metre
LIMIT = 12.0  # s
PRE_SPIN = 0.15  # m
SPINNING = replace(HYDRONE, air_gains=replace(HYDRONE.air_gains, pre_spin=PRE_SPIN))
FLYERS = {**{law: (law, HYDRONE) for law in LAWS}, "paper-pre-spin": ("paper", SPINNING)}


@dataclass(frozen=True, kw_only=True)
class Settings:
    controllers: tuple[Literal[tuple(FLYERS)], ...] = tuple(FLYERS)
    """control laws to fly"""
    flights: int = 64
    """flights a setting"""


def fly(name: str, direction: str, hull: float, lag: float, delay: float, flights: int) -> Flights:
    """Fly a setting: from rest 2 m on one side of the surface to 2 m on the other, all the time there is."""
    law, vehicle = FLYERS[name]
    vehicle = replace(vehicle, height=hull, rotor_lag_air=lag, rotor_lag_water=lag, medium_delay=delay)
    start = STARTS[direction]
    return fly_column(vehicle, Column(start=start, end=-start, limit=LIMIT, flights=flights, stop=False), law=law)


def setting(name: str, direction: str, hull: float, lag: float, delay: float, flights: int) -> dict[str, Any]:
    """Measure a setting: a flight comes through that is beyond the zone for good a period before time is up."""
    flown = fly(name, direction, hull, lag, delay, flights)
    stays = (flown.outcome == RUNNING) & (flown.within < LIMIT - PERIOD)
    return {
        "direction": direction,
        "hull": hull,
        "lag": lag,
        "delay": delay,
        "flights": stays.size,
        "through": int(stays.sum()),
        "at_once": int((stays & (flown.crossings == 1.0)).sum()),
        "crossings": float(np.median(flown.crossings)),
        "seconds": percentiles(flown.within[stays], (50.0,))[0],
    }


def main(settings: Settings) -> None:
    for name in settings.controllers:
        every = product(STARTS, HULLS, LAGS, DELAYS)
        measured = {"law": name, "settings": [setting(name, *where, settings.flights) for where in every]}
        print(save(f"crossing_lag-{name}", f"python -m benchmarks.crossing_lag --controllers {name}", measured))
    crossings_page.write()


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
