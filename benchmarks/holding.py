"""What each law promises, how it holds its place in one disturbance at a time, and how it follows a circle: tables.

    python -m benchmarks.holding
    python -m benchmarks.holding --controllers robust

Sixteen flights from headings all round begin at rest at the reference, 5 m above the water or 3 m below it, and have to
stay there for half a minute: the worst of them. The law, as always, knows the nominal vehicle in still weather, and
what disturbs begins with the flight.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.control.laws import LAWS, envelope_of
from hydrone_gym.simulation.conditions import CONDITIONS, begin_conditions, climate_of
from hydrone_gym.simulation.simulation import LANES, Simulation
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.vehicle import HYDRONE, Vehicle
from hydrone_gym.weather import Spread, Weather
from hydrone_gym.weather.weather import ROTOR_DRAG
from hydrone_gym.world.world import World

WORLD = World(lower=(-500.0, -500.0, -5.0), upper=(500.0, 500.0, 50.0), rough_transition="count")
AIR, WATER = 5.0, -3.0  # m
SECONDS, LATE = 30.0, 10.0  # s of a flight, and those that are its end
STILL = Weather()
UNITS = {"cruise": "m/s", "climb": "m/s", "surge": "m/s", "dive": "m/s", "zone": "m/s", "stop_time": "s"}
UNITS |= {"hold_radius": "m", "flight_power": "W", "swim_power": "W"}


@dataclass(frozen=True, kw_only=True)
class Factor:
    """What disturbs, where it can."""

    name: str
    weather: Weather = STILL
    vehicle: Vehicle = HYDRONE  # as it really is
    heights: tuple[float, ...] = (AIR, WATER)


def _breeze(wind: float, turbulence: float = 0.0) -> Factor:
    """Wind along x on a vehicle whose rotors drag on the air and lag."""
    weather = Weather(wind=wind, wind_direction=0.0, turbulence=turbulence)
    vehicle = replace(HYDRONE, rotor_drag=ROTOR_DRAG, rotor_lag_air=0.033)
    name = f"{'gusty wind' if turbulence else 'wind'} {wind:g} m/s"
    return Factor(name=name, weather=weather, vehicle=vehicle, heights=(AIR,))


def _current(speed: float) -> Factor:
    """Current along x, without eddies."""
    weather = Weather(current=speed, current_direction=0.0, current_variation=0.0)
    return Factor(name=f"current {speed:g} m/s", weather=weather, heights=(WATER,))


def _heavier(share: float) -> Factor:
    """A vehicle of another mass."""
    return Factor(name=f"mass {100 * share:+g} %", vehicle=replace(HYDRONE, mass=(1.0 + share) * HYDRONE.mass))


def _stronger(share: float) -> Factor:
    """Rotors of another thrust at a speed."""
    air, water = (1.0 + share) * HYDRONE.thrust_air, (1.0 + share) * HYDRONE.thrust_water
    return Factor(name=f"thrust {100 * share:+g} %", vehicle=replace(HYDRONE, thrust_air=air, thrust_water=water))


def _lagging(seconds: float) -> Factor:
    """Rotors that follow late."""
    vehicle = replace(HYDRONE, rotor_lag_air=seconds, rotor_lag_water=seconds)
    return Factor(name=f"rotor lag {1000 * seconds:g} ms", vehicle=vehicle)


FACTORS = (
    Factor(name="nothing"),
    *map(_breeze, (3.0, 5.0, 8.0)),
    _breeze(5.0, turbulence=1.0),
    *map(_current, (0.1, 0.2, 0.3, 0.5)),
    Factor(name="waves of 0.3 m", weather=Weather(wave_height=0.3, wave_period=2.5), heights=(WATER,)),
    *(make(share) for make in (_heavier, _stronger) for share in (-0.1, 0.1)),
    *map(_lagging, (0.033, 0.1)),
)


def _conditions(rows: np.ndarray, factor: Factor) -> NDArray[np.float64]:
    """Return the conditions of a block of rows."""
    conditions, streams = np.zeros((1, CONDITIONS * LANES)), np.zeros((LANES, 3))
    streams[:, 0] = np.arange(LANES)
    climates = climate_of(factor.vehicle, factor.weather, Spread(), -WORLD.lower[2])[None]
    begin_conditions(conditions, LANES, rows, np.arange(LANES), streams, climates, np.zeros(LANES, np.int64))
    return conditions


def fly(law: str, factor: Factor, path: NDArray[np.float64], around: bool = False) -> NDArray[np.float64]:
    """Follow references (K, 4) from rest at the first; return the states (ticks, LANES, 12).

    `around` turns the flights to headings all round; otherwise all begin at that of the first reference.
    """
    rows = new_rows(LANES)
    rows["state"][:, :3], rows["state"][:, 5] = path[0, :3], path[0, 3]
    if around:
        rows["state"][:, 5] = np.linspace(-np.pi, np.pi, LANES, endpoint=False)
    rows["reference"][:, :3], rows["reference"][:, 3] = path[0, :3], rows["state"][:, 5]
    rows["goal"], rows["clearance"] = np.inf, np.inf
    simulation = Simulation(HYDRONE, WORLD, lanes=LANES, law=law, weathered=True)
    conditions, nothing, states = _conditions(rows, factor), np.zeros((1, 0)), []
    for reference in path:
        sent = np.tile(reference, (LANES, 1))
        sent[:, 3] = rows["reference"][:, 3] if around else reference[3]
        for tick in range(simulation.ticks):
            simulation.advance(rows, sent, nothing, nothing, 0, tick, tick + 1, weather=conditions)
            states.append(rows["state"].copy())
    if rows["outcome"].any():
        raise RuntimeError(f"{law}, {factor.name}: a flight ended early")
    return np.array(states)


def hold(law: str, factor: Factor, height: float, seconds: float = SECONDS) -> NDArray[np.float64]:
    """Hold a place from headings all round; return the states (ticks, LANES, 12), the place being x = y = 0."""
    return fly(law, factor, np.tile([0.0, 0.0, height, 0.0], (round(seconds / 0.5), 1)), around=True)


def offsets(states: NDArray[np.float64], height: float) -> NDArray[np.float64]:
    """Return how far (m) the worst flight is from its place, (2, 2): across, and in height; in the end, and ever."""
    away = np.array([np.hypot(states[..., 0], states[..., 1]), np.abs(states[..., 2] - height)])
    return np.column_stack([away[:, -round(LATE / 0.05) :].max(axis=(1, 2)), away.max(axis=(1, 2))])


def circle(law: str, factor: Factor, radius: float, speed: float) -> float:
    """Follow a circle in air; return the mean distance (m) to the moving reference in the second turn."""
    angles = speed / radius * 0.5 * np.arange(1 + round(4.0 * np.pi * radius / speed / 0.5))
    path = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), *np.tile([[AIR], [0.0]], len(angles))])
    states, share = fly(law, factor, path)[10:, 0, :3], np.arange(1, 11)[:, None] / 10.0
    ramp = np.concatenate([a + share * (b - a) for a, b in zip(path[:-1, :3], path[1:, :3], strict=True)])
    return float(np.linalg.norm(states - ramp, axis=1)[len(ramp) // 2 :].mean())


def _cells(laws: Sequence[str], factor: Factor) -> list[str]:
    """Offsets under each law in both media, a dash where the factor disturbs nothing."""
    cells = []
    for law in laws:
        for height in (AIR, WATER):
            if height not in factor.heights:
                cells += ["–", "–"]
                continue
            cells += [f"{late:.2f} ({ever:.2f})" for late, ever in offsets(hold(law, factor, height), height)]
    return cells


def envelopes(laws: Sequence[str]) -> str:
    """Markdown table of what each law publishes of its limits."""
    found = [envelope_of(HYDRONE, law) for law in laws]
    lines = [f"| `Envelope` | {' | '.join(laws)} |", f"|---|{'---:|' * len(laws)}"]
    for name, unit in UNITS.items():
        lines.append(f"| {name}, {unit} | {' | '.join(f'{getattr(envelope, name):.3g}' for envelope in found)} |")
    return "\n".join(lines)


def table(laws: Sequence[str]) -> str:
    """Markdown tables of all factors, and of the circles."""
    heads = [f"{law}: {where}" for law in laws for where in ("air across", "height", "water across", "depth")]
    lines = [
        f"| m from the place in the last 10 s, in brackets ever | {' | '.join(heads)} |",
        f"|---|{'---:|' * len(heads)}",
    ]
    lines += [f"| {factor.name} | {' | '.join(_cells(laws, factor))} |" for factor in FACTORS]
    heads = [f"{law}: m to the reference" for law in laws]
    lines += ["", f"| circle in air | {' | '.join(heads)} |", f"|---|{'---:|' * len(laws)}"]
    for factor in (FACTORS[0], *map(_lagging, (0.033, 0.1))):
        for radius, speed in ((2.0, 1.0), (3.0, 2.0)):
            name = f"radius {radius:g} m at {speed:g} m/s" + ("" if factor is FACTORS[0] else f", {factor.name}")
            lines.append(f"| {name} | {' | '.join(f'{circle(law, factor, radius, speed):.2f}' for law in laws)} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", nargs="+", choices=tuple(LAWS), default=list(LAWS), help="control laws")
    laws = parser.parse_args().controllers
    print(envelopes(laws), table(laws), sep="\n\n")


if __name__ == "__main__":
    main()
