"""What a flight turned is told apart by medium."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.crossing_points import crossed


def test_turning_by_medium():
    states = np.zeros((6, 12))
    states[:, 0] = np.linspace(0.0, 5.0, 6)
    states[:, 2] = [2.0, 1.5, 0.5, -0.5, -1.5, -2.0]
    states[:, 5] = np.radians([170.0, -170.0, 180.0, 180.0, 177.0, 147.0])  # the first turn passes 180 degrees
    scenario = SimpleNamespace(start=(0.0, 0.0, 2.0, 0.0), goal=(5.0, 0.0, -2.0))
    flight = SimpleNamespace(trace=SimpleNamespace(states=states), scenario=scenario, time=5.0, energy=1.0)
    flown = crossed(flight, zone=0.8)
    assert flown.turned == pytest.approx((30.0, 3.0, 30.0))
    assert flown.apart == pytest.approx(23.0)
    assert flown.legs == pytest.approx((2.0, 2.0, 1.0))
