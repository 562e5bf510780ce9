"""The frozen bounds: flown again bit for bit, not slower than any shipped policy, and only for their own worlds."""

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym.evaluation import DEFAULT_POLICIES, Trace, evaluate, fly, load_suite
from hydrone_gym.evaluation.bounds import Bound, BoundFlight, bounds_of, load_bounds, save_bounds
from hydrone_gym.evaluation.plan import make_plan
from hydrone_gym.simulation.outcome import Outcome

WORLDS = (0, 7)
FROZEN = 100  # worlds of each mission
EXPERIMENTS = ("air-to-water", "water-to-air", "random")


class Replay:
    """Sends stored references."""

    def __init__(self, references):
        self.references = references

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        period = 0 if state is None else state
        return self.references[period], period + 1


def again(mission, world, bound):
    env = gym.make(mission.env_id, disable_env_checker=True, **mission.options)
    return fly(env, Replay(bound.references), scenario=mission.scenarios[world])


@pytest.mark.parametrize("mission", load_suite("paper-20").missions, ids=lambda mission: mission.name)
def test_a_frozen_bound_is_flown_again_bit_for_bit(mission):
    bounds = load_bounds("paper-20-v1", "paper")
    for world in WORLDS:
        bound = bounds[mission.name, world]
        kept, free = (again(mission, world, flight) for flight in bound)
        for flight, stored in zip((kept, free), bound, strict=True):
            assert flight.outcome is Outcome.GOAL
            assert (flight.time, flight.energy) == (stored.time, stored.energy)
            assert len(flight.references) == len(stored.references)
        assert kept.zone_speed <= 0.2
        assert free.time <= kept.time


def test_the_bounds_are_those_of_the_first_worlds_and_as_fast_as_another_search_found():
    bounds = bounds_of(make_plan("paper-20", ["straight-line"]).arguments())
    for mission, seconds in (("air-to-water", (17.15, 17.10)), ("water-to-air", (18.40, 18.20))):
        own = {world: bound for (_, name, world), bound in bounds.items() if name == mission}
        assert list(own) == list(range(FROZEN))
        assert all(bound.free.time <= bound.kept.time for bound in own.values())
        for rule, time in zip(("kept", "free"), seconds, strict=True):  # s, by 23,000 flights a world
            assert np.median([getattr(bound, rule).time for bound in own.values()]) < 1.03 * time


def test_no_shipped_policy_is_faster():
    bounds = load_bounds("paper-20-v1", "paper")
    for record in evaluate("paper-20", DEFAULT_POLICIES, worlds=3):
        bound = bounds[record.mission, record.world]
        if record.success:
            assert bound.free.time <= record.time
            assert bound.kept.time <= record.time or record.zone_speed > 0.2


def test_bounds_belong_to_the_worlds_and_the_vehicle_they_were_searched_for():
    arguments = make_plan("paper-20", ["straight-line"], worlds=3).arguments()
    assert bounds_of(arguments)["paper-20-v1", "water-to-air", 2].kept is not None
    assert bounds_of({**arguments, "suites": {"paper-20-v1": "others"}}) == {}
    assert bounds_of({**arguments, "vehicle": "physical"}) == {}
    assert bounds_of(make_plan("dense-40", ["straight-line"], worlds=1).arguments()) == {}
    robust = bounds_of(make_plan("paper-20", ["straight-line"], worlds=3, controller="robust").arguments())
    assert robust["paper-20-v1", "water-to-air", 2].free.time < 14.0  # s; 18 under the paper's law


def test_the_bounds_of_every_level_of_weather_are_those_of_still_air():
    still = bounds_of(make_plan("weather-0", ["straight-line"], worlds=1).arguments())
    assert {(mission, world) for _, mission, world in still} == {(m, k) for m in EXPERIMENTS for k in range(50)}
    for name in ("weather-3", "weather-5-v1"):
        windy = bounds_of(make_plan(name, ["straight-line"], worlds=1).arguments())
        assert {key[1:]: bound.free.time for key, bound in windy.items()} == {
            key[1:]: bound.free.time for key, bound in still.items()
        }
        assert {suite for suite, *_ in windy} == {f"{name.removesuffix('-v1')}-v1"}


def test_what_is_saved_is_read_back(tmp_path, monkeypatch):
    monkeypatch.setattr("hydrone_gym.evaluation.bounds.FOLDER", tmp_path)
    flight = BoundFlight(17.05, 866.123456789, np.array([[-9.75, 3.00390625, 7.5, -3.140625], [1.0, 2.0, -3.0, 0.0]]))
    longer = BoundFlight(18.0, 900.0, np.repeat(flight.references, 3, axis=0))
    path = tmp_path / "bounds-mine-paper-paper.npz"
    save_bounds(path, {"a": [Bound(flight, longer), Bound(None, flight)], "b": [Bound(longer, longer)]})
    found = load_bounds("mine", "paper")
    assert list(found) == [("a", 0), ("a", 1), ("b", 0)]
    assert found["a", 1].kept is None
    for one, other in ((found["a", 0].kept, flight), (found["a", 0].free, longer), (found["a", 1].free, flight)):
        assert one[:2] == other[:2]
        np.testing.assert_array_equal(one.references, other.references)
    assert load_bounds("mine", "physical") == load_bounds("other", "paper") == {}
    with pytest.raises(ValueError, match="references must be multiples of 1/256 m and rad, those of a are not"):
        save_bounds(path, {"a": [Bound(None, flight._replace(references=flight.references + 1e-4))]})


def test_lateral_speed_in_the_zone_is_the_greatest_at_any_tick_there():
    states = np.zeros((5, 12))
    states[:, 2] = (2.0, 0.8, 0.0, -0.8, -0.9)
    states[:, 6:8] = ((9.0, 0.0), (0.3, 0.4), (0.1, 0.0), (0.0, -0.2), (9.0, 0.0))  # m/s
    trace = Trace(np.arange(5) * 0.05, states, np.zeros((5, 4)), np.zeros((5, 0)))
    assert trace.zone_speed(0.8) == 0.5
    assert trace.zone_speed(0.5) == 0.1
    assert trace._replace(states=states[[0, 4]]).zone_speed(0.8) is None


def test_only_flights_that_are_traced_know_their_speed_in_the_zone():
    alone = evaluate("paper-20", "straight-line-shield", worlds=1)
    assert all(0.0 < record.zone_speed < 3.0 for record in alone)
    batch = evaluate(load_suite("held-out", 1), "straight-line-shield", worlds=1)
    assert {record.zone_speed for record in batch} == {None}
