"""Steps aside: who is refused what he asks for again and again, at one place, is sent elsewhere for a while."""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.surface import in_air
from planners.check import AIR_GATE, WATER_GATE

PATIENCE = 7  # refusals within `_PLACE` of one place after which the vehicle is sent aside
ASIDE = 14  # periods that a step aside lasts: down out of the zone and then some
_PLACE = 0.5  # m
_STEP = 2.0  # m
_TURN = np.pi * (3.0 - np.sqrt(5.0))  # rad, the golden angle: directions tried one after another spread evenly


def watch(
    positions: NDArray[np.float64],
    starts: NDArray[np.bool_],
    refused: NDArray[np.bool_],
    place: NDArray[np.float64],
    stayed: NDArray[np.int64],
    detours: NDArray[np.int64],
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the new place, periods stayed and detours: a vehicle that has waited too long begins a step aside.

    Args:
        positions: (n, 3) of the vehicles, m.
        starts: (n,) where an episode begins.
        refused: (n,) whether something was refused in the last period.
        place: (n, 3) where each vehicle was when it last got away from a place, m.
        stayed: (n,) periods with a refusal since; negative while it is sent aside.
        detours: (n,) steps aside of this episode.
    """
    aside = (stayed < 0) & ~starts
    left = starts | (~aside & (np.linalg.norm(positions - place, axis=1) > _PLACE))
    stayed = np.where(left, 0, stayed + (aside | refused))
    begins = stayed >= PATIENCE
    detours = np.where(starts, 0, detours) + begins
    ended = aside & (stayed == 0)
    place = np.where((left | begins | ended)[:, None], positions, place)
    return place, np.where(begins, -ASIDE, stayed), detours


def beside(
    place: NDArray[np.float64], in_force: NDArray[np.float64], detours: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return references (n, 4) beside a place, in a direction that each detour turns.

    They lie outside the transition zone: from inside it the first detour leads below, the next one above.
    """
    angle = _TURN * detours
    beside = in_force.astype(np.float64)
    beside[:, 0] = place[:, 0] + _STEP * np.cos(angle)
    beside[:, 1] = place[:, 1] + _STEP * np.sin(angle)
    between = np.abs(place[:, 2]) < min(AIR_GATE, WATER_GATE)
    air = np.where(between, detours % 2 == 0, in_air(place[:, 2]))
    beside[:, 2] = np.where(air, np.maximum(place[:, 2], AIR_GATE), np.minimum(place[:, 2], -WATER_GATE))
    return beside
