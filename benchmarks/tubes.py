"""Tubes: makes the ones that planners and the shield promise with, and measures what they cover.

    python -m benchmarks.tubes --make       # measures all, a minute each, and writes planners/tubes.json
    python -m benchmarks.tubes              # coverage on other seeds, in other weather, with noisy senses

The flights are those of a straight line behind the shield, in random missions without obstacles; at each look what was
sent, and the stop after it, are flown to the end.
"""

import json
import math
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from joblib import Parallel, delayed
from numpy.typing import NDArray

from benchmarks.timing import RESULTS, save
from hydrone_gym import HYDRONE
from hydrone_gym.control.laws import LAWS
from hydrone_gym.envs import HydroneEnv
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import row_at
from hydrone_gym.surface import in_air
from hydrone_gym.weather.weather import LEVELS, ROTOR_DRAG
from hydrone_gym.world.world import World
from planners.belief import Belief
from planners.check import AIR_GATE, TUBE_LENGTH, TUBE_STEP, WATER_GATE
from planners.disturbance import Estimator, Sight
from planners.policy import Known, known
from planners.shield import Shield
from planners.straight_line import StraightLine
from planners.tube import FILE, PLACES, Tube, key_of, tube_of

Flight = tuple[NDArray[np.int64], NDArray[np.float64]]
_SHAPE = 0.99  # quantile of the deviations that makes the shape
_LEAST = 0.05  # m: smaller deviations do not matter
_LONGEST = 40  # looks of a flight
SEED = 20_000_000  # of the flights that tubes are made from
_BLOCK = 50  # flights that a process flies in one go
# of noisy senses: m, rad, m/s and rad/s
_NOISE = np.array([*[0.0] * 3, *[np.radians(1.0)] * 3, *[0.05] * 3, *[0.0] * 3])


def deviations(env: Any, shield: Shield, seed: int, noisy: bool) -> Flight:
    """Fly a mission; return the place of each look (n,), an index of `PLACES`, and the deviations after it.

    The latter are (n, TUBE_LENGTH) in m, NaN from where the stop left the box. `noisy` senses are wrong by `_NOISE`.
    """
    observation, state, places, found = env.reset(seed=seed)[0], None, [], []
    every, random = round(TUBE_STEP / shield.belief.period), np.random.default_rng(seed)
    for _ in range(_LONGEST):
        if noisy:
            observation = {**observation, "state": observation["state"] + _NOISE * random.standard_normal(12)}
        sent, state = shield.predict(observation, state)
        stop, now = state.held[0].astype(np.float32), known(observation)
        predicted = _predicted(shield.estimator, now, state.sights[0], sent, stop, every * TUBE_LENGTH)
        z = now.state[2]
        # as `planners.check.place_of`
        places.append(1 if -WATER_GATE < z < AIR_GATE else 0 if in_air(z) else 2)
        found.append(_flown(env, sent, stop, predicted)[every - 1 :: every])
        observation, _, terminated, truncated, _ = env.step(sent)
        if terminated or truncated:
            break
    return np.array(places), np.array(found)


def _predicted(
    estimator: Estimator,
    now: Known,
    sight: Sight | None,
    sent: NDArray[np.float32],
    stop: NDArray[np.float32],
    periods: int,
) -> NDArray[np.float64]:
    """Return where the vehicle is believed to be after each period (periods, 3) of a reference and its stop."""
    row: Any = row_at(now.state, now.goal)
    row["integral"], row["reference"] = now.integral, now.reference
    rollout, places = Rollout(estimator.simulation, np.zeros((0, 4)), estimator.conditions(sight)), []
    for k in range(periods):
        rollout.fly(row, (stop if k else sent).astype(np.float64))
        places.append(row["state"][0, :3].copy())
    return np.array(places)


def _flown(
    env: Any, sent: NDArray[np.float32], stop: NDArray[np.float32], predicted: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Fly them, and go back; return the distance from what was predicted (periods,) in m, NaN once the flight ended."""
    before, distances = env.unwrapped.get_state(), np.full(len(predicted), np.nan)
    for k, place in enumerate(predicted):
        told, _, terminated, truncated, _ = env.step(stop if k else sent)
        if terminated or truncated:
            break
        distances[k] = math.dist(told["state"][:3], place)
    env.unwrapped.set_state(before)
    return distances


def flights_of(belief: Belief, level: int, weather: Any, count: int, seed: int, noisy: bool = False) -> list[Flight]:
    """Return the `deviations` of so many flights in a weather, with a shield that is ready for a level."""
    env = HydroneEnv(
        vehicle=belief.vehicle,
        controller=belief.law,
        period=belief.period,
        vertical_mode=belief.world.vertical_mode,
        weather=weather,
        num_obstacles=0,
        rough_transition="count",
    )
    shield = Shield.for_env(StraightLine.for_env(env), env, level=level)
    return [deviations(env, shield, seed + k, noisy) for k in range(count)]


def tube_from(flown: list[Flight]) -> Tube:
    """Return the tube that flights tell of."""
    places, found = np.concatenate([f[0] for f in flown]), np.concatenate([f[1] for f in flown])
    shape = np.array([np.nanquantile(found[places == place], _SHAPE, axis=0) for place in range(len(PLACES))])
    shape = np.maximum(shape, _LEAST)
    return Tube(shape, np.sort([score(shape, *each) for each in flown]))


def score(shape: NDArray[np.float64], places: NDArray[np.int64], found: NDArray[np.float64]) -> float:
    """Return how many times the shape the worst deviation of a flight is, over all its looks and times."""
    return float(np.nanmax(found / shape[places], initial=0.0))


def covered(tube: NDArray[np.float64], flown: list[Flight], place: int | None = None) -> float:
    """Return the share of flights that stayed in a tube (3, TUBE_LENGTH) after all looks, or those from a place."""
    inside = []
    for places, found in flown:
        of = np.full(len(places), True) if place is None else places == place
        if of.any():
            inside.append(score(tube, places[of], found[of]) <= 1.0)
    return float(np.mean(inside))


def trials(level: int) -> dict[str, tuple[Any, bool]]:
    """Return the weathers, and whether senses are noisy, that a level's tube is tried in."""
    own = LEVELS[level]
    drag = own.spread.rotor_drag or (ROTOR_DRAG, ROTOR_DRAG)
    wrong = replace(own, spread=replace(own.spread, rotor_drag=(1.5 * drag[0], 1.5 * drag[1])))
    found = {
        "other seeds": (level, False),
        "rotor drag half as much again": (wrong, False),
        "noisy senses": (level, True),
    }
    return {**found, f"level {level + 1}": (level + 1, False)} if level + 1 < len(LEVELS) else found


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to measure."""

    make: bool = False
    """Measure all tubes and write them where planners find them."""
    flights: int = 1000
    """Flights of each tube and trial."""
    levels: tuple[int, ...] = (2, 3)
    """Levels whose tubes are tried."""
    laws: tuple[str, ...] = ("robust",)
    """Control laws whose tubes are tried."""
    promises: tuple[float, ...] = (0.9, 0.99)
    """Shares of flights."""
    jobs: int = 1
    """Processes."""
    out: Path = RESULTS
    """Folder of tubes.json, the coverage."""


def fly_all(belief: Belief, level: int, weather: Any, a: Arguments, seed: int, noisy: bool = False) -> list[Flight]:
    """Fly the flights of a tube or a trial, in blocks."""
    blocks = range(0, a.flights, _BLOCK)
    work = (delayed(flights_of)(belief, level, weather, min(_BLOCK, a.flights - k), seed + k, noisy) for k in blocks)
    return [flight for block in Parallel(a.jobs)(work) for flight in block]


def make(a: Arguments) -> None:
    """Measure the tubes of the nominal vehicle under every law at every level, and store them."""
    stored = {}
    for law in LAWS:
        belief = Belief(vehicle=HYDRONE, world=World(), law=law)
        for level in range(1, len(LEVELS)):
            tube = tube_from(fly_all(belief, level, level, a, SEED))
            numbers = {name: np.round(value, 3).tolist() for name, value in tube._asdict().items()}
            stored[key_of(belief, level)] = numbers
            print(key_of(belief, level), f"water after 3 s: {tube.shape[2, 5]:.2f} m", flush=True)
    FILE.write_text("{\n" + ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in stored.items()) + "\n}\n")


def coverage(a: Arguments) -> list[dict[str, Any]]:
    """Return what the stored tubes cover in each trial, and what they would be made of there."""
    rows = []
    for law in a.laws:
        belief = Belief(vehicle=HYDRONE, world=World(), law=law)
        for level in a.levels:
            for name, (weather, noisy) in trials(level).items():
                flown, tube = fly_all(belief, level, weather, a, SEED + 500_000, noisy), tube_of(belief, level)
                own = tube_from(flown)
                for promise in a.promises:
                    at, row = tube.at(promise), {"law": law, "level": level, "trial": name, "promise": promise}
                    row |= {"whole flights": covered(at, flown)}
                    row |= {place: covered(at, flown, k) for k, place in enumerate(PLACES)}
                    row |= {"water after 3 s, m": at[2, 5], "would be": own.at(promise)[2, 5]}
                    rows.append({k: round(v, 3) if isinstance(v, float) else v for k, v in row.items()})
                    print(" | ".join(str(v) for v in rows[-1].values()), flush=True)
    return rows


def main(arguments: Sequence[str] | None = None) -> int:
    given = sys.argv[1:] if arguments is None else list(arguments)
    a = tyro.cli(Arguments, args=given, description=__doc__)
    if a.make:
        make(a)
        return 0
    command = shlex.join(["python", "-m", "benchmarks.tubes", *given])
    print(save("tubes", command, {"flights": a.flights, "rows": coverage(a)}, a.out))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
