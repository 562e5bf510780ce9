"""What the shield calls rest is rest, and where it cannot last, under water, the vehicle gets away."""

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import Outcome
from hydrone_gym.simulation.storage import new_rows
from planners.shield import HELD, RETREAT, Shield

NOWHERE = np.array([0.0, 0.0, -4.0, 0.5])  # a sphere far from where these tests fly


@pytest.fixture(scope="module")
def guarded():
    return Shield.for_env(None, gym.make("HydroneGym/Mission-v0"))


def rows_at(states, references):
    rows = new_rows(len(states))
    rows["state"], rows["goal"], rows["clearance"] = states, 5.0, np.inf
    rows["reference"] = references
    return rows


def check(shield, rows, proposed, held, sphere=NOWHERE):
    observation = {key: rows[key] for key in ("state", "integral", "reference", "goal")}
    observation["obstacles"] = np.tile(sphere, (len(rows), 1, 1))
    return shield.check(observation, proposed, held)


def fly(shield, rows, references, sphere=NOWHERE):
    """Advance rows by a period."""
    shield.simulation.advance(rows, references, np.tile(sphere, (len(rows), 1)), np.full((len(rows), 1), np.inf), 1)


def assert_what_passes_is_safe(shield, rows, proposed):
    """Fly what the shield lets pass for a period, then 6 s of what is held; return how many passed."""
    sent, held, choice = check(shield, rows, proposed, rows["reference"])
    passed = choice >= 0
    rows = rows[passed]
    fly(shield, rows, sent[passed])
    for _ in range(12):
        fly(shield, rows, held[passed])
    assert (rows["outcome"] == Outcome.RUNNING).all(), rows["state"][rows["outcome"] != Outcome.RUNNING]
    return len(rows)


def moving_near_a_wall(count, air):
    """Vehicles that near a wall or, in air, brake before it; then what they are asked for."""
    rng = np.random.default_rng(7)
    states, references = np.zeros((count, 12)), np.zeros((count, 4))
    states[:, 1], states[:, 2] = rng.uniform(9.5, 9.9, count), 5.0 if air else -3.0
    states[:, 3] = rng.uniform(-0.2, 0.2, count) * air
    states[:, 5] = rng.uniform(-np.pi, np.pi, count) * (not air)
    states[:, 7] = rng.uniform(0.0, 0.8, count) * (1.0 if air else 0.1)
    references[:, 1], references[:, 2] = states[:, 1] - rng.uniform(0.0, 0.4, count), states[:, 2]
    proposed = references + rng.uniform([-0.3, -0.1, 0.0, 0.0], [0.3, 0.4, 0.0, 0.0], (count, 4))
    return rows_at(states, references), proposed


@pytest.mark.parametrize("air", [True, False])
def test_what_is_let_pass_can_be_followed_by_what_is_held(guarded, air):
    """Also by those who stand still for a moment, tilted and about to be drawn on: 6 s of what is held are safe."""
    rows, proposed = moving_near_a_wall(4000, air)
    assert 1000 < assert_what_passes_is_safe(guarded, rows, proposed) < len(rows)


def test_standing_still_for_a_moment_is_no_rest(guarded):
    """Vehicles that brake near a wall are still, but tilted, within a period: drawn on, they would leave the box."""
    y, roll, vy, rolling, reference, px, py = np.array(
        [
            (9.7974, 0.0461, 0.6302, 0.1880, 9.7875, 0.0224, 10.0455),
            (9.7087, -0.0694, 0.6899, -0.1598, 9.8036, 0.1662, 10.3301),
            (9.7811, -0.0937, 0.4829, 0.4392, 9.8004, 0.0390, 9.9694),
            (9.7153, -0.2982, 0.3142, 0.1802, 9.8175, 0.2566, 10.1765),
            (9.7655, -0.1525, 0.3851, -0.3755, 9.8083, -0.0415, 9.9897),
            (9.7521, -0.0259, 0.5541, -0.0761, 9.7713, -0.0350, 10.0477),
        ]
    ).T
    states, references, proposed = np.zeros((6, 12)), np.zeros((6, 4)), np.zeros((6, 4))
    states[:, 1], states[:, 2], states[:, 3], states[:, 7], states[:, 9] = y, 5.0, roll, vy, rolling
    references[:, 1], references[:, 2] = reference, 5.0
    proposed[:, 0], proposed[:, 1], proposed[:, 2] = px, py, 5.0
    assert_what_passes_is_safe(guarded, rows_at(states, references), proposed)


@pytest.mark.parametrize("vy", [-0.004, -0.006])
def test_a_drift_toward_a_wall_ends_in_a_retreat(guarded, vy):
    """Sideways through the wall in some seconds: the vehicle swims a metre against it, and goes on with that."""
    state = np.array([[0.0, -9.96, -3.0, 0.0, 0.0, 0.0, 0.0, vy, 0.0, 0.0, 0.0, 0.0]])
    hover = np.array([[0.0, -9.9, -3.0, 0.0]])
    rows = rows_at(state, hover)
    sent, held, choice = check(guarded, rows, hover, hover)
    assert choice.tolist() == [RETREAT]
    np.testing.assert_allclose(sent, [[0.0, -8.96, -3.0, 0.0]], atol=1e-6)
    np.testing.assert_array_equal(held, sent)
    fly(guarded, rows, sent)
    again, _, choice = check(guarded, rows, hover, held)
    assert choice.tolist() == [HELD]
    np.testing.assert_array_equal(again, held)


def test_a_drift_toward_a_sphere_ends_in_a_retreat(guarded):
    sphere = np.array([0.0, -1.5, -3.0, 1.0])
    state = np.array([[0.0, 0.0, -3.0, 0.0, 0.0, 0.0, 0.0, -0.006, 0.0, 0.0, 0.0, 0.0]])
    hover = np.array([[0.0, 0.0, -3.0, 0.0]])
    rows, held, chosen = rows_at(state, hover), hover, set()
    for _ in range(120):
        sent, held, choice = check(guarded, rows, hover, held, sphere)
        chosen.add(int(choice[0]))
        fly(guarded, rows, sent, sphere)
    assert RETREAT in chosen
    assert rows["outcome"][0] == Outcome.RUNNING


def test_nobody_is_carried_out_of_a_corner(guarded):
    """Ten minutes of a policy that asks for the corner it is in, beginning with a drift into it."""
    headings, sways = (grid.ravel() for grid in np.meshgrid(np.linspace(-1.5, 1.5, 7), [0.005, 0.01, 0.02]))
    states = np.zeros((len(sways), 12))
    states[:, :3], states[:, 5] = (-9.75, -9.85, -3.0), headings
    states[:, 6], states[:, 7] = -0.5 * sways, -sways
    corner = np.tile([-10.0, -10.0, -3.0, 0.0], (len(sways), 1))
    held = np.column_stack([states[:, :3], headings])
    rows = rows_at(states, held)
    for _ in range(1200):
        sent, held, _ = check(guarded, rows, corner, held)
        fly(guarded, rows, sent)
    assert (rows["outcome"] == Outcome.RUNNING).all(), rows["state"][rows["outcome"] != Outcome.RUNNING]
