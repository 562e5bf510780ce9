"""Flights saved as numbers: written, read back, and flown again from their references."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.evaluation.flight import Flight, trace_of
from hydrone_gym.evaluation.statistics import percentiles
from hydrone_gym.simulation.conditions import CONDITIONS
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import STILL, Simulation
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.world.scenario import Scenario, weather_of

FORMAT = "hydrone_gym flights"
VERSION = 1
_SAME = 1e-6  # m, rad, m/s: another processor may round otherwise, another model flies elsewhere


def flight_record(flight: Flight) -> dict[str, Any]:
    """Return a flight as numbers, strings, lists and dicts: SI units, angles in rad, planning times in ms.

    Every number is finite; what is not, such as the clearance in a world without obstacles, is None.
    """
    p50, p99 = percentiles(flight.decision_ms, (50.0, 99.0))
    measured = ("time", "transitions", "clearance", "length", "energy", "episode_return")
    scenario = {name: getattr(flight.scenario, name) for name in ("name", "start", "goal", "obstacles")}
    if flight.scenario.weather is not None:
        scenario["weather"] = asdict(flight.scenario.weather)
    return plain(
        {
            "scenario": scenario,
            "outcome": flight.outcome.name,
            "success": flight.outcome is Outcome.GOAL,
            **{name: getattr(flight, name) for name in measured},
            "planning_ms": {"p50": p50, "p99": p99},
            **{name: getattr(flight, name) for name in ("references", "states", "detected")},
            **({"conditions": flight.trace.conditions[0]} if flight.trace.conditions.size else {}),
        }
    )


def plain(value: Any) -> Any:
    """Turn arrays, tuples and NumPy scalars into what JSON has, with None for numbers that are not finite."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


@dataclass(frozen=True, kw_only=True, eq=False)
class SavedFlight:
    """A flight in a file of `hydrone fly`."""

    name: str  # what the file calls it
    policy: str  # option it was flown with, as the next three
    seed: int
    vehicle: str
    weather: int
    scenario: Scenario  # what was flown
    references: NDArray[np.float64]  # (K, 4) a period: m, m, m, rad
    states: NDArray[np.float64]  # (K + 1, 12) at the start and after each period
    detected: NDArray[np.float64]  # (k, 4) spheres in order of detection, m
    conditions: NDArray[np.float64]  # (1, CONDITIONS) at the start, empty without weather
    record: dict[str, Any]  # everything the file says of it, see `flight_record`


def read_flights(path: str | Path) -> list[SavedFlight]:
    """Read the flights that `hydrone fly` saved in its flight.json.

    Raises ValueError for another kind of file or a damaged one, naming the file and what is wrong.
    """
    content = Path(path).read_bytes()
    try:
        document = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not complete JSON: {error}") from None
    found = (document.get("format"), document.get("version")) if isinstance(document, dict) else (None, None)
    if found != (FORMAT, VERSION):
        raise ValueError(f'{path}: must be a file "{FORMAT}" of version {VERSION}, got {found[0]!r}, {found[1]!r}')
    try:
        flights = [_flight(record, document) for record in document["flights"]]
    except (KeyError, ValueError, TypeError, AttributeError, OverflowError) as error:
        lacks = "lacks " if isinstance(error, KeyError) else ""
        raise ValueError(f"{path}: damaged: {lacks}{error}") from None
    if not flights:
        raise ValueError(f"{path}: holds no flight")
    return flights


def _flight(record: dict[str, Any], document: dict[str, Any]) -> SavedFlight:
    """Turn one record into a flight; any error says what is wrong with it."""
    references = _rows("references", record["references"], 4)
    states = _rows("states", record["states"], 12)
    if not len(references) or len(states) != len(references) + 1:
        raise ValueError(f"there must be one state more than references, got {len(states)} and {len(references)}")
    if record["outcome"] not in Outcome.__members__:
        raise ValueError(f"unknown outcome {record['outcome']!r}")
    named_vehicle(document["vehicle"])
    return SavedFlight(
        name=str(record["name"]),
        policy=str(document["policy"]),
        seed=int(document["seed"]),
        vehicle=document["vehicle"],
        weather=int(document.get("weather", 0)),
        scenario=_scenario(record["scenario"]),
        references=references,
        states=states,
        detected=_rows("detected", record["detected"], 4),
        conditions=_rows("conditions", [record["conditions"]], CONDITIONS) if "conditions" in record else STILL,
        record={**record, **{name: float(record[name]) for name in ("time", "energy", "length", "episode_return")}},
    )


def _scenario(content: dict[str, Any]) -> Scenario:
    """Return a saved scenario, with its weather if it carries one."""
    return Scenario(**content | ({"weather": weather_of(content["weather"])} if "weather" in content else {}))


def _rows(name: str, rows: Any, width: int) -> NDArray[np.float64]:
    """Return rows of finite numbers; ValueError for anything else."""
    table = np.array(rows, dtype=np.float64).reshape((-1, width) if not rows else np.shape(rows))
    if table.ndim != 2 or table.shape[1] != width or not np.isfinite(table).all():
        raise ValueError(f"{name} must be rows of {width} finite numbers, got shape {table.shape}")
    return table


def restore(saved: SavedFlight, simulation: Simulation) -> Flight:
    """Fly the references of a saved flight again, tick by tick: the same kernel, so the same flight bit for bit.

    `simulation` is that of an environment with the flight's vehicle and otherwise the defaults, which `hydrone fly`
    uses. Times of decisions and interventions of a shield are not saved and stay empty.

    Raises ValueError for references that lead elsewhere, as with another version of the model.
    """
    flown = simulation.flown_in(saved.conditions.size > 0)
    trace = trace_of(flown, saved.scenario, saved.states[0], saved.references, saved.conditions)
    last, ends = len(trace.times) - 1, simulation.ticks * np.arange(len(saved.states))
    apart = float(np.abs(trace.states[np.minimum(ends, last)] - saved.states).max())
    if not ends[-2] < last <= ends[-1] or apart > _SAME:
        raise ValueError(
            f"{saved.name}: its references no longer lead where they led, {apart:.2g} (m, rad, m/s) apart: "
            "it was flown with another version or was changed"
        )
    record, clearance = saved.record, saved.record["clearance"]
    return Flight(
        obstacles=len(saved.scenario.obstacles),
        scenario=saved.scenario,
        outcome=Outcome[record["outcome"]],
        clearance=np.inf if clearance is None else float(clearance),
        **{name: record[name] for name in ("time", "energy", "transitions", "length", "episode_return")},
        references=saved.references,
        states=saved.states,
        detected=saved.detected,
        decision_ms=np.zeros(0),
        interventions=None,
        zone_speed=trace.zone_speed(simulation.world.zone),
        trace=trace,
    )
