"""Why a flight failed, in plain words and numbers.

A contact is judged by the *last chance*: the last decision at which the shield's check (`planners.shield`) still found
a reference that a safe stop can follow. If the sphere was known then, it was seen in time; if not, the vehicle was too
fast for what it could know. Inside the transition zone the vertical mode ignores lateral references: who enters it
fast slides on, and who rises or sinks in it cannot step aside. Contacts there have causes of their own.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agents.failures.flights import FailedFlight
from hydrone_gym.evaluation.flight import Flight
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import gaps_along
from hydrone_gym.world.world import World

AIR_LEG, FROM_AIR, FROM_WATER, WATER_LEG = "air leg", "zone from air", "zone from water", "water leg"
PARTS = (AIR_LEG, FROM_AIR, FROM_WATER, WATER_LEG)

SEEN = "seen and not avoided"
LATE = "seen too late to stop"
NEVER = "never seen"
SLID = "slid in the zone: seen in time"
SLID_LATE = "slid in the zone: seen too late"
ROSE_OR_SANK = "rose or sank in the zone: seen in time"
LEFT = "left the box"
SLID_OUT = "left the box: sliding in the zone"
ROUGH_SPEED = "rough crossing: lateral speed"
ROUGH_TILT = "rough crossing: tilt"
ROUGH_BOTH = "rough crossing: lateral speed and tilt"
WAITED = "time-out: waiting at one place"
WAITED_IN_ZONE = "time-out: waiting in the zone"
CIRCLED = "time-out: circling"
MADE_WAY = "time-out: making way"
DIVERGED = "diverged"
CAUSES = (
    *(SLID, SLID_LATE, ROSE_OR_SANK, SEEN, LATE, NEVER, SLID_OUT, LEFT),
    *(ROUGH_SPEED, ROUGH_TILT, ROUGH_BOTH, WAITED_IN_ZONE, WAITED, CIRCLED, MADE_WAY, DIVERGED),
)

LATELY = 30.0  # s before a time-out that tell what the vehicle was doing
PLACE = 1.0  # m: farther away is another place
WAY = 1.0  # m nearer to the goal than ever before is way made


class End(NamedTuple):
    """Where and how a flight ended."""

    time_s: float
    x_m: float
    y_m: float
    z_m: float
    share_of_way: float  # of the straight line from start to goal, projected on it
    part: str  # one of PARTS; inside the zone by the side it was entered from
    medium: str  # air or water
    horizontal_speed_m_s: float  # of a rough crossing, these three are those of the crossing
    vertical_speed_m_s: float
    tilt_deg: float
    zone_entry_speed_m_s: float | None  # horizontal, where the zone was last entered; None outside it


class Contact(NamedTuple):
    """The sphere that was touched."""

    sphere: int  # row of the scenario's obstacles
    sphere_radius_m: float
    sphere_elevation_deg: float  # direction in which its centre lay, above horizontal
    closing_speed_m_s: float  # of the vehicle towards that centre
    known_s: float | None  # how long the policy had decided knowing it; None: never


class Chance(NamedTuple):
    """The last decision at which a safe stop could be chosen."""

    last_chance_s: float  # before the end
    last_chance_speed_m_s: float  # of the vehicle then
    known_at_last_chance: bool | None  # whether the sphere touched was known then; None without a contact


@dataclass(frozen=True, kw_only=True, eq=False)
class Failure:
    """One flight that did not arrive."""

    mission: str  # environment id
    seed: int  # of the world
    outcome: Outcome  # how it ended
    cause: str  # one of `CAUSES`
    end: End  # where and how
    contact: Contact | None  # of a collision, else None
    chance: Chance | None  # None for a time-out, and if there never was one
    stayed_s: float  # how long it had been within 1 m of where it ended, s
    interventions: int | None  # periods in which a shield flew another reference than proposed; None without one
    path: NDArray[np.float64]  # (K, 2) share of the way and height in m, at every decision and at the end


def examine(failed: FailedFlight) -> Failure:
    """Work out why a flight failed."""
    flight, world = failed.flight, failed.world
    start, goal = np.array(flight.scenario.start[:3]), np.array(flight.scenario.goal)
    share = (flight.states[:, :3] - start) @ (goal - start) / ((goal - start) @ (goal - start))
    end, contact = _end(flight, world, float(share[-1])), _contact(failed)
    chance = _last_chance(failed, contact)
    return Failure(
        mission=failed.mission,
        seed=failed.seed,
        outcome=flight.outcome,
        cause=_cause(flight, world, end, contact, chance),
        end=end,
        contact=contact,
        chance=chance,
        stayed_s=_stayed(flight),
        interventions=flight.interventions,
        path=np.column_stack((share, flight.states[:, 2])),
    )


def _end(flight: Flight, world: World, share: float) -> End:
    """Describe the last instant of a flight, at a share of the way."""
    states, last = flight.trace.states, flight.trace.states[-1]
    outside = np.flatnonzero(np.abs(states[:, 2]) > world.zone)
    entry = int(outside[-1]) + 1  # missions begin outside the zone
    inside = entry < len(states)
    if inside:
        part = FROM_AIR if in_air(states[entry - 1, 2]) else FROM_WATER
    else:
        part = AIR_LEG if in_air(last[2]) else WATER_LEG
    speed, climb, tilt = float(np.hypot(*last[6:8])), float(last[8]), float(np.arccos(np.cos(last[3:5]).prod()))
    if flight.outcome is Outcome.ROUGH_TRANSITION:
        speed, tilt, climb = (flight.transitions[-1][key] for key in ("lateral_speed", "tilt", "vertical_speed"))
    entry_speed = float(np.hypot(*states[entry, 6:8])) if inside else None
    medium = "air" if in_air(last[2]) else "water"
    x, y, z = last[:3].tolist()
    return End(flight.time, x, y, z, share, part, medium, speed, climb, float(np.degrees(tilt)), entry_speed)


def _contact(failed: FailedFlight) -> Contact | None:
    """Find the sphere that a collision was with: the nearest one to the path of the last tick."""
    flight = failed.flight
    if flight.outcome is not Outcome.COLLISION:
        return None
    before, last = flight.trace.states[-2:]
    sphere = int(np.argmin(gaps_along(before[:3], last[:3], flight.scenario.obstacles)))
    centre, radius = flight.scenario.obstacles[sphere, :3], float(flight.scenario.obstacles[sphere, 3])
    toward = (centre - last[:3]) / np.linalg.norm(centre - last[:3])
    elevation = float(np.degrees(np.arcsin(np.clip(toward[2], -1.0, 1.0))))
    known = flight.time - float(failed.known[sphere])
    return Contact(sphere, radius, elevation, float(last[6:9] @ toward), known if np.isfinite(known) else None)


def _last_chance(failed: FailedFlight, contact: Contact | None) -> Chance | None:
    """Find the last decision at which a safe stop could be chosen."""
    chances = np.flatnonzero(failed.stoppable)
    if not len(chances):
        return None
    time, speed = chances[-1] * failed.period, float(np.linalg.norm(failed.flight.states[chances[-1], 6:9]))
    return Chance(
        float(failed.flight.time - time), speed, None if contact is None else bool(failed.known[contact.sphere] <= time)
    )


def _cause(flight: Flight, world: World, end: End, contact: Contact | None, chance: Chance | None) -> str:
    """Put a name to it."""
    sliding = end.part in (FROM_AIR, FROM_WATER) and end.horizontal_speed_m_s > abs(end.vertical_speed_m_s)
    if contact is not None:
        in_time = chance is not None and bool(chance.known_at_last_chance)  # known when the vehicle could still stop
        if contact.known_s is None:
            return NEVER
        if sliding:
            return SLID if in_time else SLID_LATE
        seen = ROSE_OR_SANK if end.part in (FROM_AIR, FROM_WATER) else SEEN
        return seen if in_time else LATE
    if flight.outcome is Outcome.OUT_OF_BOUNDS:
        return SLID_OUT if sliding else LEFT
    if flight.outcome is Outcome.ROUGH_TRANSITION:
        fast, tilted = end.horizontal_speed_m_s / world.rough_speed, np.radians(end.tilt_deg) / world.rough_tilt
        both = min(fast, tilted) > 1.0
        return ROUGH_BOTH if both else (ROUGH_SPEED if fast > tilted else ROUGH_TILT)
    if flight.outcome is Outcome.TIMEOUT:
        return _cause_of_timeout(flight, end)
    return DIVERGED


def _cause_of_timeout(flight: Flight, end: End) -> str:
    """Say what the vehicle was doing in the last `LATELY` seconds."""
    positions = flight.trace.states[:, :3]
    lately = flight.trace.times > flight.time - LATELY
    if np.linalg.norm(positions[lately] - positions[-1], axis=1).max() <= PLACE:
        return WAITED_IN_ZONE if end.part in (FROM_AIR, FROM_WATER) else WAITED
    distance = np.linalg.norm(positions - flight.scenario.goal, axis=1)
    before = distance[~lately].min(initial=distance[0])
    return MADE_WAY if distance[lately].min() < before - WAY else CIRCLED


def _stayed(flight: Flight) -> float:
    """How long a flight had been within `PLACE` of where it ended, s."""
    positions = flight.trace.states[:, :3]
    away = np.flatnonzero(np.linalg.norm(positions - positions[-1], axis=1) > PLACE)
    return flight.time - float(flight.trace.times[away[-1]]) if len(away) else flight.time
