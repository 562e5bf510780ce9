"""Flights of fixed seeds are bit for bit what they were when `python -m benchmarks.golden record` noted them.

The simulation gives the same bits on every machine, so recorded actions lead to the recorded flights anywhere, and most
policies choose them again. What MPPI and the agent leave to NumPy may round differently on another processor: their
first decisions must be the recorded ones within `CLOSE`, and where NumPy rounds as it did, so must their whole flights.
"""

import math

import numpy as np
import pytest

from benchmarks.golden import arithmetic, differing, load
from benchmarks.golden_flights import OPTIONS, PILOTS, Replay, fly_single, fly_vector

RECORDED, ABOUT = load()
WAYS = {"single": fly_single, "vector": fly_vector}
ROUNDED = ("mppi", "ppo")  # choose by what NumPy makes of exponentials, products and angles
FLIGHTS = {name: 60 for name in PILOTS} | {"clrrt-published": 12, "mppi": 6}
DECISIONS, CLOSE = 8, 1e-5  # periods of a flight; m or rad


class Compared:
    """Sends recorded actions and asks a policy what it would have sent at first."""

    def __init__(self, pilot, actions):
        self.pilot, self.replay, self.furthest, self.asked = pilot, Replay(actions), 0.0, 0

    def act(self, observation, starts, worlds):
        sent = self.replay.act(observation, starts, worlds)
        if min(self.replay.step.values()) < DECISIONS:
            wanted = self.pilot.act(observation, starts, worlds)
            early = [self.replay.step[row] < DECISIONS for row in range(len(worlds))]
            apart = np.atleast_2d(wanted.astype(float) - sent)[early]
            apart[:, 3] = [math.remainder(angle, 2.0 * math.pi) for angle in apart[:, 3]]
            self.furthest = max(self.furthest, float(np.abs(apart).max()))
            self.asked += len(apart)
        return sent


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", PILOTS)
def test_recorded_actions_lead_to_the_recorded_flights(name, way):
    sent = RECORDED[name].sent()
    flown = WAYS[way](lambda env: Replay(sent), sent, OPTIONS.get(name, {}))
    assert len(flown) == len(sent) > 2
    assert not differing(flown, RECORDED[name])


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", PILOTS)
def test_policies_fly_as_recorded(name, way):
    sent, compared = RECORDED[name].sent(), []

    def make(env):
        compared.append(Compared(PILOTS[name](env), sent))
        return compared[-1]

    WAYS[way](make, sent, OPTIONS.get(name, {}))
    assert sum(pilot.asked for pilot in compared) >= sum(min(len(actions), DECISIONS) for actions in sent.values())
    assert max(pilot.furthest for pilot in compared) <= CLOSE
    if name not in ROUNDED or ABOUT[name]["arithmetic"] == arithmetic():
        assert not differing(WAYS[way](PILOTS[name], range(FLIGHTS[name]), OPTIONS.get(name, {})), RECORDED[name])


def test_a_thousand_flights_of_every_policy_are_recorded():
    assert RECORDED.keys() == PILOTS.keys()
    for name, golden in RECORDED.items():
        assert len(golden.fingerprints) == len(np.unique(golden.fingerprints)) == ABOUT[name]["flights"] == 1000
        assert golden.digest == ABOUT[name]["digest"]
