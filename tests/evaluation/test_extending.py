"""An evaluation is extended in its folder, and rows are kept only while their policy is what it was."""

import functools
import itertools
import json
import os
import shutil
import sys
from types import SimpleNamespace

import pytest

from agents import shipped_agents
from agents.agent import PRETRAINED
from hydrone_gym._folder_lock import held
from hydrone_gym.evaluation import Suite, evaluate, read_records
from hydrone_gym.evaluation.plan import fly_job
from hydrone_gym.evaluation.policies import find_policies, find_policy
from planners import StraightLine
from tests.evaluation.test_run import timeless

HOP = """
import numpy as np
import {helper}


class Hop:
    def __init__(self, env):
        self.step = {helper}.SPEED * env.unwrapped.simulation.period

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        away = observation["goal"] - observation["state"][:3]
        step = away * min(1.0, self.step / np.linalg.norm(away))
        return np.array([*(observation["state"][:3] + step), {yaw}]), state
"""


@pytest.fixture
def hop(tmp_path, monkeypatch):
    """Write a policy file and the module it imports, of a name of its own: modules are known to the whole process."""
    helper = f"gait_{tmp_path.name}"
    monkeypatch.setattr(sys, "path", list(sys.path))

    def write(yaw="0.0", speed="0.5"):
        (tmp_path / f"{helper}.py").write_text(f"SPEED = {speed}")
        (tmp_path / "hop.py").write_text(HOP.format(helper=helper, yaw=yaw))
        return f"hop={tmp_path / 'hop.py'}:Hop"

    return write


@pytest.fixture
def flown(monkeypatch):
    """The keys of the flights that are flown from now on."""
    keys = []

    def counted(job):
        keys.extend(job.keys)
        return fly_job(job)

    monkeypatch.setattr("hydrone_gym.evaluation.run.fly_job", counted)
    return keys


@pytest.mark.parametrize("edit", [{"yaw": "0.1"}, {"speed": "0.4"}])
def test_an_edited_policy_is_flown_anew_and_no_other(tmp_path, hop, flown, edit):
    policies = ["straight-line", hop()]
    before = evaluate("paper-20", policies, worlds=2, out=tmp_path / "run")
    flown.clear()
    hop(**edit)
    after = evaluate("paper-20", policies, worlds=2, out=tmp_path / "run")
    assert {(policy, world) for *_, world, policy in flown} == {("hop", 0), ("hop", 1)}
    assert len(flown) == 4
    for old, new in zip(before, after, strict=True):
        assert (new == old) == (new.policy == "straight-line")
        assert old.same_flight(new) == (new.policy == "straight-line")
    assert read_records(tmp_path / "run" / "rows.csv") == after
    fresh = evaluate("paper-20", policies, worlds=2)
    assert timeless(fresh) == timeless(after)
    hop()
    assert timeless(evaluate("paper-20", policies, worlds=2, out=tmp_path / "run")) == timeless(before)


def test_results_of_old_code_do_not_outlive_it(tmp_path, hop):
    policies = ["straight-line", hop()]
    evaluate("paper-20", policies, worlds=1, out=tmp_path / "run")
    hop(yaw="1 / 0")
    with pytest.raises(RuntimeError, match="policy 'hop' failed"):
        evaluate("paper-20", policies, worlds=1, out=tmp_path / "run")
    assert {file.name for file in (tmp_path / "run").iterdir()} == {"run.json", "rows.csv"}
    assert {record.policy for record in read_records(tmp_path / "run" / "rows.csv")} == {"straight-line"}


def test_more_worlds_and_policies_fly_only_what_is_missing(tmp_path, flown):
    first = evaluate("paper-20", "straight-line", worlds=2, out=tmp_path)
    flown.clear()
    more = evaluate("paper-20", ["potential-field", "straight-line"], worlds=7, out=tmp_path)
    assert len(flown) == len(set(flown)) == 2 * 2 * 7 - 2 * 2
    assert [record for record in more if record in first] == first
    assert read_records(tmp_path / "rows.csv") == more
    assert timeless(more) == timeless(evaluate("paper-20", ["potential-field", "straight-line"], worlds=7))
    flown.clear()
    both = evaluate(["dense-40", "paper-20"], ["potential-field", "straight-line"], worlds=7, out=tmp_path)
    assert {suite for suite, *_ in flown} == {"dense-40-v1"}
    assert both[28:] == more
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["rows"], summary["complete"]) == (56, True)


def test_more_seeds_of_drawn_worlds_are_more_worlds(tmp_path, flown):
    def drawn(seeds):
        return Suite.drawn("HydroneGym/Mission-v0", seeds, name="mine")

    evaluate(drawn(range(3)), "straight-line", out=tmp_path)
    flown.clear()
    assert len(evaluate(drawn(range(5)), "straight-line", out=tmp_path)) == 5
    assert [world for _, _, world, _ in flown] == [3, 4]
    with pytest.raises(ValueError, match="the worlds of mine were"):
        evaluate(drawn(range(1, 7)), "straight-line", out=tmp_path)


def test_held_out_worlds_in_a_batch_are_extended(tmp_path):
    evaluate("held-out", "straight-line", worlds=2, out=tmp_path)
    more = evaluate("held-out", "straight-line", worlds=5, out=tmp_path)
    assert timeless(more) == timeless(evaluate("held-out", "straight-line", worlds=5))


def test_seconds_are_those_of_all_runs(tmp_path, monkeypatch):
    clock = itertools.count(step=100.0)  # every look at it takes 100 s
    monkeypatch.setattr("hydrone_gym.evaluation.run_folder.time", SimpleNamespace(perf_counter=lambda: next(clock)))

    def seconds(worlds):
        evaluate("paper-20", "straight-line", worlds=worlds, out=tmp_path)
        return json.loads((tmp_path / "summary.json").read_text())["seconds"]

    assert seconds(5) == 300.0  # a look as it begins, and one after each of two jobs
    assert seconds(5) == 300.0  # nothing was flown
    assert seconds(10) == 600.0
    with (
        held(tmp_path),
        pytest.raises(BlockingIOError, match=rf"{tmp_path} is in use by another run \(pid {os.getpid()}\)"),
    ):
        seconds(10)


def test_digests_tell_every_kind_of_policy_from_what_it_was(tmp_path, monkeypatch, hop):
    def digest(policy):
        return find_policies({"x": policy})[0].digest

    assert digest("ppo") == digest("ppo") != digest("sac")
    assert len({digest("straight-line"), digest("straight-line+shield"), digest("clrrt")}) == 3
    assert digest(StraightLine.for_env) == digest(StraightLine.for_env) != digest(functools.partial(StraightLine, 3))
    assert digest(functools.partial(StraightLine, 3)) != digest(functools.partial(StraightLine, 4))
    assert digest(lambda env: env) != digest(lambda env: env)  # nobody can tell
    folder = tmp_path / "agent"
    shutil.copytree(PRETRAINED / shipped_agents()[0], folder)
    before = digest(str(folder))
    shutil.copytree(folder, tmp_path / "moved")
    assert digest(str(tmp_path / "moved")) == before
    (folder / "agent.yaml").write_text((folder / "agent.yaml").read_text() + "\n")
    assert digest(str(folder)) != before
    text = hop().removeprefix("hop=")
    assert digest(text) == find_policy(f"other={text}").digest != digest(text + ".__call__")
    package = tmp_path / "site" / "rowing"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("from rowing.rig import Rig")
    (package / "rig.py").write_text("class Rig: pass")
    monkeypatch.syspath_prepend(tmp_path / "site")
    before = digest("rowing:Rig")
    (package / "rig.py").write_text("class Rig: oars = 2")
    assert digest("rowing:Rig") != before


def test_a_policy_that_is_edited_before_a_worker_loads_it_is_refused(hop):
    source = find_policy(hop())
    hop(speed="3.0")
    with pytest.raises(
        ValueError, match=r"policy 'hop' cannot be made: .* its files have changed since the evaluation"
    ):
        source.make(None, 0)
