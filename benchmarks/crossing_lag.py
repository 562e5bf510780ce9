"""Does it come through at all? Crossings in still air against the rotors' lag and how late the medium is noticed.

    python -m benchmarks.crossing_lag                        the paper's law, some seconds
    python -m benchmarks.crossing_lag --controllers paper    the same; other laws by their names

Each through an abrupt surface, and with a hull of 0.1 m. Writes benchmarks/results/crossing_lag-LAW.json and the tables
of docs/crossings.md.
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


@dataclass(frozen=True, kw_only=True)
class Settings:
    controllers: tuple[Literal[tuple(LAWS)], ...] = ("paper",)
    """control laws to fly"""
    flights: int = 64
    """flights a setting"""


def fly(law: str, direction: str, hull: float, lag: float, delay: float, flights: int) -> Flights:
    """Fly a setting: from rest 2 m on one side of the surface to 2 m on the other, all the time there is."""
    vehicle = replace(HYDRONE, height=hull, rotor_lag_air=lag, rotor_lag_water=lag, medium_delay=delay)
    start = STARTS[direction]
    return fly_column(vehicle, Column(start=start, end=-start, limit=LIMIT, flights=flights, stop=False), law=law)


def setting(law: str, direction: str, hull: float, lag: float, delay: float, flights: int) -> dict[str, Any]:
    """Measure a setting: a flight comes through that is beyond the zone for good a period before time is up."""
    flown = fly(law, direction, hull, lag, delay, flights)
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
    for law in settings.controllers:
        every = product(STARTS, HULLS, LAGS, DELAYS)
        measured = {"law": law, "settings": [setting(law, *where, settings.flights) for where in every]}
        print(save(f"crossing_lag-{law}", f"python -m benchmarks.crossing_lag --controllers {law}", measured))
    crossings_page.write()


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
