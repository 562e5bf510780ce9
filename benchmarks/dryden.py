"""Dryden gusts as the specification has them and as they come: this project's beside RotorPy's.

    python -m benchmarks.dryden                  the table, with RotorPy's gusts as last measured
    pip install rotorpy torch
    python -m benchmarks.dryden --measure-peer   measure RotorPy's again, some minutes

Both are asked for the intensities of MIL-F-8785C at 20 ft, for the same mean wind and time step. A gust's time is how
long its autocorrelation takes to fall to 1/e: L/W along the wind, 0.626 L/W across and upwards.
"""

import json
import math
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray
from rich.console import Console
from scipy.optimize import brentq

from benchmarks.tables import Sheet, number
from benchmarks.timing import RESULTS, save
from hydrone_gym._jit import kernel
from hydrone_gym.weather import wind as winds
from hydrone_gym.weather.noise import Key, kicks

SPEEDS = (3.0, 8.0)  # m/s
STEPS = (0.002, 0.01)  # s: RotorPy's default, and that of its environments
AXES = ("along", "across", "upwards")
BETWEEN = 0.1  # s between samples
PEER_TIME, PEER_LEFT_OUT = 10_000.0, 500.0  # s; its gusts begin at zero
STREAMS, TIME = 64, 6_000.0  # of ours, s


@kernel
def blow(wind, direction, every, out):
    """Velocities (3, streams, samples) of streams that begin as an episode does, a sample every so many steps."""
    _, streams, samples = out.shape
    for i in range(streams):
        key = Key(float(i), 1.0)
        gusts = winds.first_gusts(key, 0.0)
        n = 3.0
        for j in range(samples):
            out[0, i, j], out[1, i, j], out[2, i, j] = winds.velocity(gusts, wind, direction, 1.0)
            for _ in range(every):
                a, b = kicks(key, n)
                c, d = kicks(key, n + 1.0)
                e, _ = kicks(key, n + 2.0)
                gusts = winds.next_gusts(gusts, wind, (a, b, c, d, e))
                n += 3.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    measure_peer: bool = False
    """measure RotorPy, which must be installed, and write benchmarks/results/dryden.json"""


def specified(speed: float) -> list[tuple[float, float]]:
    """Deviation (m/s) and time (s) of each axis."""
    sigma, up, length, rising = winds.dryden(speed)
    share = float(brentq(lambda x: math.exp(-x) * (1.0 - 0.5 * x) - math.exp(-1.0), 0.0, 2.0))
    return [(sigma, length / speed), (sigma, share * length / speed), (up, share * rising / speed)]


def found(gust: NDArray[np.float64]) -> tuple[float, float]:
    """Deviation (m/s) and time (s) of samples (streams, n) `BETWEEN` apart."""
    gust = gust - gust.mean()
    n = gust.shape[1]
    power = np.abs(np.fft.rfft(gust, 2 * n, axis=1)) ** 2
    correlation = np.fft.irfft(power.mean(0))[:n] / (n - np.arange(n)) / gust.var()
    late = int(np.argmax(correlation < math.exp(-1.0)))
    lags = np.interp(-math.exp(-1.0), -correlation[late - 1 : late + 1], [late - 1.0, late])
    return float(gust.std()), float(lags) * BETWEEN


def ours(speed: float, dt: float) -> list[tuple[float, float]]:
    out = np.empty((3, STREAMS, round(TIME / BETWEEN)))
    blow(winds.wind_params(speed, 1.0, False, dt), (1.0, 0.0), round(BETWEEN / dt), out)
    return [found(gust) for gust in out]


def peers(dt: float) -> list[tuple[float, float]]:
    """RotorPy's gusts at unit intensity: they scale with it, and their filters take no wind speed."""
    from rotorpy.wind.dryden_winds import DrydenGust

    np.random.seed(0)  # noqa: NPY002  the stream that RotorPy draws from
    wind = DrydenGust(dt, np.zeros(3), np.ones(3), winds.REFERENCE_HEIGHT)
    every = round(BETWEEN / dt)
    out = np.empty((round(PEER_TIME / BETWEEN), 3))
    for sample in out:
        for _ in range(every):
            sample[:] = wind.update(0.0, None)  # it keeps its own time, and is the same everywhere
    return [found(gust[None]) for gust in out[round(PEER_LEFT_OUT / BETWEEN) :].T]


def sheet(measured: dict[str, Any]) -> Sheet:
    """The table; RotorPy's columns from what was measured."""
    rows = []
    for speed in SPEEDS:
        for dt in STEPS:
            asked, here, unit = specified(speed), ours(speed, dt), measured["rows"][f"{1000 * dt:g} ms"]
            for axis, one, other, (scale, time) in zip(AXES, asked, here, unit, strict=True):
                deviations, times = (one[0], other[0], scale * one[0]), (one[1], other[1], time)
                rows.append((f"{speed:g}", f"{1000 * dt:g}", axis, *map(number, deviations), *map(number, times)))
    return Sheet(
        "Dryden gusts, asked for and given",
        ("wind (m/s)", "step (ms)", "axis", "σ (m/s)", "here", "RotorPy", "time (s)", "here", "RotorPy"),
        rows,
        [
            f"RotorPy {measured['version']}. Time: until the autocorrelation has fallen to 1/e. Measured figures are "
            "good to 2 % here and to 20 % of RotorPy."
        ],
    )


def main(settings: Settings) -> None:
    if settings.measure_peer:
        rows = {f"{1000 * dt:g} ms": peers(dt) for dt in STEPS}
        save("dryden", "python -m benchmarks.dryden --measure-peer", {"version": version("rotorpy"), "rows": rows})
    measured = json.loads((RESULTS / "dryden.json").read_text(encoding="utf-8"))
    Console().print(sheet(measured).markdown(), soft_wrap=True, markup=False)


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
