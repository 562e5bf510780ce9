"""Policies are found by every way of naming them, and what cannot be found is told in one line."""

import functools
import pickle
import shutil
import subprocess
import sys

import gymnasium as gym
import pytest

from agents import Agent, shipped_agents
from agents.agent import PRETRAINED
from hydrone_gym.evaluation import DEFAULT_POLICIES, known_policies
from hydrone_gym.evaluation.policies import find_policies, find_policy
from planners import CLRRT, MPPI, OpenLoopRRT, PotentialField, PublishedCLRRT, StraightLine
from planners.caution import caution_at
from planners.shield import Shield

SOURCE = """
class Still:
    def __init__(self, env, seed=None):
        self.seed = seed

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return observation["reference"], None


class Maker:
    made = Still


def hasty(env):
    raise KeyError("sails")


number = 3
"""
KINDS = {
    "straight-line": StraightLine,
    "straight-line-shield": Shield,
    "potential-field": PotentialField,
    "clrrt-published": PublishedCLRRT,
    "clrrt": CLRRT,
    "mppi": MPPI,
    "open-loop-rrt": OpenLoopRRT,
    "ppo": Agent,
    "ppo-shield": Shield,
    "ppo-weather": Agent,
    "ppo-weather-shield": Shield,
}


@pytest.fixture(scope="module")
def env():
    return gym.make("HydroneGym/Mission-v0", vehicle="physical")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_policies.py").write_text(SOURCE)
    return tmp_path


def test_every_registered_name_makes_its_policy_for_the_environment(env):
    assert set(KINDS) <= set(known_policies())
    assert set(DEFAULT_POLICIES) <= set(known_policies())
    for name, kind in KINDS.items():
        policy = find_policy(name).make(env, 0)
        assert type(policy) is kind
    assert find_policy("clrrt").make(env, 7).seed == 7
    assert find_policy("clrrt").make(env, 7).simulation.vehicle == env.unwrapped.vehicle
    shielded = find_policy("ppo-shield").make(env, 0)
    assert shielded.policy.file.name == "ppo-shield"
    assert shielded.simulation.vehicle == env.unwrapped.vehicle
    assert type(find_policy("straight-line-shield").make(env, 0).policy) is StraightLine


def test_a_shield_for_weather_is_ready_for_the_level_of_its_environment():
    for level in (0, 2):
        shielded = find_policy("ppo-weather-shield").make(gym.make("HydroneGym/Mission-v0", weather=level), 0)
        assert shielded.caution == caution_at(level)
        assert shielded.policy.file.name == "ppo-weather"


@pytest.mark.parametrize("text", ["my_policies:Still", "my_policies.py:Still", "my_policies:Maker.made"])
def test_modules_and_files_of_the_current_folder(here, env, text, monkeypatch):
    source = find_policy(f"mine={text}")
    assert source.label == "mine"
    assert find_policy(text).label == text
    monkeypatch.chdir("/")
    assert type(source.make(env, 5)).__name__ == "Still"
    program = """if True:
        import pickle, sys
        policy = pickle.loads(sys.stdin.buffer.read()).make(None, 5)
        print(type(policy).__name__, policy.seed)
    """
    worker = subprocess.run(  # another process, in another folder
        [sys.executable, "-c", program], input=pickle.dumps(source), capture_output=True, timeout=60, check=True
    )
    assert worker.stdout.split() == [b"Still", b"5"]


def test_a_folder_of_a_trained_agent(tmp_path, env, monkeypatch):
    shutil.copytree(PRETRAINED / shipped_agents()[0], tmp_path / "run" / "agent")
    monkeypatch.chdir(tmp_path)
    source = find_policy("run/agent")
    assert source.label == "run/agent"
    monkeypatch.chdir("/")
    assert source.make(env, 0).file.name == shipped_agents()[0]
    assert source.origin == f"agents.named:from_folder {tmp_path / 'run' / 'agent'}"


class Sower:
    """Takes a seed, or not, behind a method that hands on whatever it is given."""

    def __init__(self, env, seed=None):
        self.seed, self.predict = seed, None.__init__

    @classmethod
    def for_env(cls, env, **options):
        return cls(env, **options)


class Unsown(Sower):
    def __init__(self, env):
        super().__init__(env, "none")


def test_a_seed_is_handed_on_to_the_class(env):
    factories = {"a": Sower.for_env, "b": functools.partial(Sower.for_env), "c": Unsown.for_env, "d": Sower}
    assert [source.make(env, 5).seed for source in find_policies(factories)] == [5, 5, "none", 5]


def test_a_factory_as_it_is(env):
    (source,) = find_policies({"mine": StraightLine.for_env})
    assert type(source.make(env, 0)) is StraightLine
    assert source.origin.endswith(":StraightLine.for_env") or source.origin.endswith(":PlannerPolicy.for_env")
    (source,) = find_policies({"other": "clrrt"})
    assert (source.label, source.factory) == ("other", "planners:CLRRT.for_env")


def test_a_name_registered_by_another_package(tmp_path, env, monkeypatch):
    info = tmp_path / "sailing-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: sailing\nVersion: 1.0\n")
    entries = "[hydrone_gym.policies]\nsail = sailing:Still\nppo = sailing:Still\n"
    (info / "entry_points.txt").write_text(entries)
    (tmp_path / "sailing.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path)
    assert "sail" in known_policies()
    assert type(find_policy("sail").make(env, 0)).__name__ == "Still"
    with pytest.raises(ValueError, match=r"'ppo' is registered by several packages: agents\.named:ppo, sailing:Still"):
        find_policy("ppo")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("clrt", "no policy 'clrt' (did you mean 'clrrt'?): known are clrrt, clrrt-published"),
        ("my_policies", "no policy 'my_policies'"),
        ("my_policies:", "no policy 'my_policies:'"),
        (":Still", "no policy ':Still'"),
        ("no_such_module:Still", "cannot be imported: ModuleNotFoundError: No module named 'no_such_module'"),
        ("my_policies:Stil", "'my_policies' has no attribute 'Stil'"),
        ("my_policies:number", "must be a callable that takes the environment, got int"),
        ("broken.py:Still", "cannot be imported: SyntaxError"),
        ("empty", "empty: not a trained agent: there must be a file agent.yaml"),
    ],
)
def test_what_cannot_be_found_is_named(here, text, message):
    (here / "broken.py").write_text("def :")
    (here / "empty").mkdir()
    with pytest.raises(ValueError) as stop:  # noqa: PT011
        find_policy(text)
    assert message in str(stop.value)
    assert "\n" not in str(stop.value)


def test_a_file_that_is_not_there():
    with pytest.raises(FileNotFoundError, match=r"there is no file .*gone\.py"):
        find_policy("gone.py:Still")


def test_what_cannot_be_made_is_named(here, env):
    with pytest.raises(
        ValueError, match=r"policy 'p' cannot be made: KeyError: 'sails' \(.*my_policies\.py, line \d+\)"
    ):
        find_policy("p=my_policies:hasty").make(env, 0)
    with pytest.raises(ValueError, match="policy 'p': its factory must return something with `predict`, got set"):
        find_policies({"p": lambda env: {1}})[0].make(env, 0)


def test_labels_tell_policies_apart():
    with pytest.raises(ValueError, match="must have different names, got ppo twice: write LABEL="):
        find_policies(["ppo", "clrrt", "ppo"])
    assert [source.label for source in find_policies(["ppo", "again=ppo"])] == ["ppo", "again"]
    with pytest.raises(ValueError, match="at least one policy"):
        find_policies([])
    with pytest.raises(ValueError, match="a label must consist of"):
        find_policies({"a b": "ppo"})


def test_missing_weights_are_told_with_the_file(env, tmp_path, monkeypatch):
    monkeypatch.setattr("agents.agent.PRETRAINED", tmp_path)
    with pytest.raises(ValueError, match="policy 'ppo' cannot be made: FileNotFoundError: no agent 'ppo': shipped are"):
        find_policy("ppo").make(env, 0)
    folder = tmp_path / "agent"
    shutil.copytree(PRETRAINED / "ppo", folder)
    (folder / "tensors.npz").unlink()
    with pytest.raises(ValueError, match=r"cannot be made: .*tensors\.npz"):
        find_policy(str(folder)).make(env, 0)
