"""`python -m benchmarks.golden` notices every change of a flight, and says where."""

import numpy as np
import pytest

from benchmarks.golden import KEPT, load, main, save
from benchmarks.golden_flights import FIRST, Log, Replay, fly_single, fly_vector

FEW = ["--flights", "7", "--policies", "random", "--file"]
OBSERVATION = {
    "state": np.arange(12.0),
    "integral": np.ones(4),
    "reference": np.full(4, 2.0),
    "goal": np.zeros(3),
    "obstacles": np.ones((2, 4)),
}
CROSSING = {"time": 1.0, "direction": "entry", "lateral_speed": 0.1, "tilt": 0.02, "vertical_speed": -0.5}
INFO = {"outcome": 1, "time": 0.5, "energy": 20.0, "clearance": 1.5, "transitions": [CROSSING]}


def fingerprint(observation=OBSERVATION, reward=0.1, ended=(True, False), info=INFO):
    log = Log(OBSERVATION)
    log.step(np.zeros(4, np.float32), (observation, reward, *ended))
    return log.end(info).fingerprint


def nudged(value):
    return np.nextafter(value, np.inf)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "new" / "flights.npz"
    assert main(["record", *FEW, str(path)]) == 0
    return path


@pytest.mark.parametrize("key", OBSERVATION)
def test_the_last_bit_of_an_observation_counts(key):
    assert fingerprint() == fingerprint({**OBSERVATION})
    changed = OBSERVATION[key].copy()
    changed.flat[-1] = nudged(changed.flat[-1])
    assert fingerprint({**OBSERVATION, key: changed}) != fingerprint()


@pytest.mark.parametrize("key", ["time", "energy", "clearance"])
def test_the_last_bit_of_the_figures_counts(key):
    assert fingerprint(info={**INFO, key: nudged(INFO[key])}) != fingerprint()


@pytest.mark.parametrize("key", ["time", "lateral_speed", "tilt", "vertical_speed"])
def test_the_last_bit_of_a_crossing_counts(key):
    crossing = {**CROSSING, key: nudged(CROSSING[key])}
    assert fingerprint(info={**INFO, "transitions": [crossing]}) != fingerprint()


def test_reward_ends_outcome_and_crossings_count():
    others = [
        fingerprint(reward=nudged(0.1)),
        fingerprint(ended=(False, True)),
        fingerprint(info={**INFO, "outcome": 2}),
        fingerprint(info={**INFO, "transitions": []}),
        fingerprint(info={**INFO, "transitions": [{**CROSSING, "direction": "exit"}]}),
        fingerprint(info={**INFO, "transitions": [CROSSING, CROSSING]}),
    ]
    assert len({fingerprint(), *others}) == 7


def test_what_was_recorded_is_equal_and_a_changed_flight_is_named(file, capsys):
    assert main(["check", *FEW, str(file)]) == 0
    shown = capsys.readouterr().out
    assert "random, single: 7 of 7 equal" in shown
    assert "random, vector: 7 of 7 equal" in shown
    recorded, about = load(file)
    recorded["random"].fingerprints[4] ^= np.uint64(1)
    save(file, recorded, about)
    assert main(["check", *FEW, str(file), "--only", "vector"]) == 1
    shown = capsys.readouterr().out
    assert "random, vector: 6 of 7 equal" in shown
    assert f"HydroneGym/WaterToAir-v0 seed {FIRST + 4}: recorded" in shown
    assert "single" not in shown


def test_it_does_not_check_what_was_not_recorded(file, capsys):
    assert main(["check", "--flights", "8", "--policies", "random", "--file", str(file)]) == 2
    assert "less than 8 flights of random" in capsys.readouterr().err
    assert main(["check", "--flights", "7", "--policies", "random", "ppo", "--file", str(file)]) == 2
    assert main(["check", "--policies", "nobody", "--file", str(file)]) == 2


def test_recording_a_policy_leaves_the_others(file):
    before, _ = load(file)
    assert main(["record", "--flights", "3", "--policies", "straight-line", "--file", str(file)]) == 0
    after, about = load(file)
    assert after.keys() == about.keys() == {"random", "straight-line"}
    assert after["random"].digest == before["random"].digest == about["random"]["digest"]
    assert about["straight-line"]["flights"] == 3


@pytest.mark.parametrize("fly", [fly_single, fly_vector])
def test_another_last_action_is_another_flight(file, fly):
    golden = load(file)[0]["random"]
    sent = golden.sent()
    assert len(sent) == KEPT
    sent[2] = sent[2].copy()
    sent[2][-1, 0] = np.nextafter(sent[2][-1, 0], np.float32(0.0))
    flown = fly(lambda env: Replay(sent), sent, {})
    differ = [world for world in sent if flown[world].fingerprint != golden.fingerprints[world]]
    assert differ == [2]
