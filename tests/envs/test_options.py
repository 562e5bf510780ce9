"""One list of options: what the constructors take, refuse, document and show."""

import inspect
from dataclasses import fields, replace

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.control import paper
from hydrone_gym.control.laws import LAWS
from hydrone_gym.envs import HydroneEnv
from hydrone_gym.envs.options import MOST_OBSTACLES, Options, VectorOptions, known_options
from hydrone_gym.envs.vector_env import HydroneVectorEnv
from planners.belief import belief_of
from tests.envs.missions import same as equal

ID, VECTOR = "HydroneGym/AirToWater-v0", "vector_entry_point"
FACES = [(HydroneEnv, Options), (HydroneVectorEnv, VectorOptions)]


@pytest.mark.parametrize(("face", "kind"), FACES)
def test_constructors_show_the_options_with_their_defaults(face, kind):
    parameters = inspect.signature(face).parameters
    assert set(parameters) == {spec.name for spec in fields(kind)} == set(known_options(kind))
    assert {name: parameter.default for name, parameter in parameters.items()} == {
        spec.name: spec.default for spec in fields(kind)
    }
    assert all(p.kind is p.KEYWORD_ONLY for name, p in parameters.items() if name != "num_envs")


@pytest.mark.parametrize(("face", "kind"), FACES)
def test_every_option_is_documented_once(face, kind):
    own = inspect.getdoc(face)
    assert "lists them" not in own
    for spec in fields(kind):
        home = VectorOptions if spec.name in VectorOptions.__annotations__ else Options
        assert inspect.getdoc(home).count(f"`{spec.name}`") >= 1
    for name in kind.__annotations__:
        assert f"`{name}`" in own


@pytest.mark.parametrize(("face", "kind"), FACES)
def test_an_unknown_option_lists_the_known_ones(face, kind):
    with pytest.raises(TypeError, match="unknown option 'wind', 'rain'; known are ") as raised:
        face(wind=3, period=0.5, rain=1)
    assert str(raised.value).endswith(", ".join(inspect.signature(face).parameters))


def test_the_first_argument_of_many_rows_is_their_number():
    assert HydroneVectorEnv(3, num_obstacles=1).num_envs == HydroneVectorEnv(num_envs=3, num_obstacles=1).num_envs == 3
    with pytest.raises(TypeError):
        HydroneEnv("random")


def test_both_environments_hold_the_same_options():
    chosen = {"period": 0.25, "vehicle": "physical", "num_obstacles": 3, "camera": "chase"}
    single = gym.make("HydroneGym/AirToWater-v0", **chosen).unwrapped.options
    rows = gym.make_vec("HydroneGym/AirToWater-v0", 2, "vector_entry_point", **chosen).options
    assert type(single) is type(rows) is Options
    assert single == rows
    assert single.vehicle is HYDRONE_PHYSICAL
    assert single.camera == rows.camera == "chase"


def test_comparison_knows_how_environments_differ():
    plain = Options()
    assert plain.vehicle is HYDRONE
    assert plain.differences(Options(vehicle=HYDRONE, render_mode="rgb_array", camera="chase")) == []
    assert plain.differences(replace(plain, period=0.25, num_obstacles=3)) == ["num_obstacles", "period"]


def slow(vehicle):
    return replace(vehicle, air_gains=replace(vehicle.air_gains, speed_limit=1.0, altitude_i_limit=150.0))


@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_the_controller_flies_every_row_and_is_believed(interface, monkeypatch):
    """A law that flies any vehicle as the paper's law flies a slow one: spaces, rewards and flights are of that."""
    law = paper.LAW._replace(
        name="slow",
        gains_of=lambda vehicle: paper.LAW.gains_of(slow(vehicle)),
        envelope_of=lambda vehicle: paper.LAW.envelope_of(slow(vehicle)),
    )
    monkeypatch.setitem(LAWS, "slow", law)
    ways = [{"controller": "slow"}, {"vehicle": slow(HYDRONE)}, {}]
    for make in (lambda **chosen: gym.make(ID, **chosen), lambda **chosen: gym.make_vec(ID, 3, VECTOR, **chosen)):
        envs = [make(interface=interface, **chosen) for chosen in ways]
        assert envs[0].observation_space == envs[1].observation_space
        for env in envs:
            env.reset(seed=1)
        envs[0].action_space.seed(0)
        action = envs[0].action_space.sample()
        ours, same, other = ([env.step(action) for _ in range(8)] for env in envs)
        assert equal(ours[-1][0], same[-1][0])
        np.testing.assert_array_equal([part[1] for part in ours], [part[1] for part in same])
        assert not np.array_equal(ours[-1][1], other[-1][1])
        assert belief_of(envs[0]).law == "slow"
        assert belief_of(envs[0], "truth").law == "slow"
        assert belief_of(envs[2]).law == "paper"


def test_an_unknown_controller_lists_the_known_ones():
    with pytest.raises(ValueError, match=r"must be one of 'paper', 'robust'.*, got 'best'"):
        Options(controller="best")


def test_the_greatest_number_of_obstacles_is_accepted():
    assert Options(num_obstacles=MOST_OBSTACLES, obstacle_radius=(0.1, 0.1)).num_obstacles == MOST_OBSTACLES
