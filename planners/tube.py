"""Tubes: how far a flight may leave the one that was predicted, measured by flying in the weather that is assumed.

Vehicles fly random missions without obstacles in a level's weather, each with the estimator of the disturbance. At
every look the period that begins and the stop after it are predicted, and flown: by a copy of the vehicle, in the same
weather. The distance between the two is the deviation, by the place of the look (in air, near the surface, in water)
and the time since. Its shape is a high quantile at each place and time; the score of a flight is how many times the
shape its worst deviation was, over all its looks and times. A tube is the shape times a quantile of the scores of whole
flights: conformal, so the next flight of the same kind stays in its tube with the probability promised, whatever the
distribution is. It holds for the weather, law and vehicle it was measured with; the flights are those of a straight
line, and what a planner flies is not quite of that kind.
"""

import functools
import json
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planners.belief import Belief
from planners.check import TUBE_LENGTH

PLACES = ("air", "surface", "water")  # of a look, see `planners.check.place_of`
FILE = Path(__file__).parent / "tubes.json"
NO_TUBE = np.zeros((len(PLACES), TUBE_LENGTH))


class Tube(NamedTuple):
    """What was measured in a level's weather."""

    shape: NDArray[np.float64]  # (3, TUBE_LENGTH) m, by place of the look and time since
    scores: NDArray[np.float64]  # (n,) ascending, of whole flights

    def at(self, promise: float) -> NDArray[np.float64]:
        """Return the tube (3, TUBE_LENGTH) in m that a share `promise` of flights stays in.

        Raises ValueError for a share that so few flights cannot tell.
        """
        count = len(self.scores)
        most = count / (count + 1)
        if isinstance(promise, bool) or not isinstance(promise, int | float) or not 0.0 < promise <= most:
            raise ValueError(f"promise must be a share of flights above 0 and at most {most:.4g}, got {promise!r}")
        return self.shape * self.scores[math.ceil((count + 1) * promise) - 1]


@functools.cache
def tube_of(belief: Belief, level: int) -> Tube:
    """Return the tube that was measured of a vehicle under its law at a level; ValueError where none was."""
    stored, wanted = json.loads(FILE.read_text()), key_of(belief, level)
    if wanted not in stored:
        known = "; ".join(stored)
        raise ValueError(f"promise needs a tube of {wanted!r}, `python -m benchmarks.tubes` measured these: {known}")
    return Tube(np.array(stored[wanted]["shape"]), np.array(stored[wanted]["scores"]))


def key_of(belief: Belief, level: int) -> str:
    """Return what a tube is stored under."""
    crossing = "vertical" if belief.world.vertical_mode else "adaptive"
    return f"{belief.vehicle.name}, {belief.law}, {belief.period:g} s, {crossing}, level {level}"
