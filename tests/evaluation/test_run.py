"""Evaluations give the same rows however they are run."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import joblib
import numpy as np
import pytest

from agents import load_agent
from hydrone_gym.evaluation import (
    HELD_OUT,
    MISSIONS,
    EvaluationStopped,
    Suite,
    evaluate,
    evaluate_held_out,
    fly,
    fly_worlds,
    load_suite,
    read_records,
    wilson_interval,
)
from hydrone_gym.evaluation.backends import runner
from hydrone_gym.evaluation.page import write_report
from hydrone_gym.evaluation.plan import WORLDS_A_JOB, make_plan
from hydrone_gym.evaluation.records import TIMING, from_line
from planners import CLRRT, StraightLine
from tests.processes import completed

FEW = {"policies": ["straight-line", "straight-line-shield", "clrrt", "ppo"], "worlds": WORLDS_A_JOB + 1}


def timeless(records):
    """Records without the columns that may differ."""
    return [replace(record, **dict.fromkeys(TIMING, 0.0)) for record in records]


@pytest.fixture(scope="module")
def serial():
    return evaluate("paper-20", **FEW)


def test_rows_come_in_the_order_of_the_plan(serial):
    assert [record.key for record in serial] == make_plan("paper-20", **FEW).keys()
    assert len(serial) == 4 * 2 * FEW["worlds"]
    assert len({record.key for record in serial}) == len(serial)


def test_a_folder_holds_all_that_a_report_is_made_of(tmp_path):
    policies = {"line": "straight-line", "clrrt": "clrrt"}
    records = evaluate("paper-20", policies, worlds=2, out=tmp_path)
    document = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert document["complete"] is True
    assert document["rows"] == len(records) == 8
    assert document["arguments"]["baseline"] == "clrrt"
    assert (tmp_path / "tables.md").is_file()
    page = write_report(tmp_path, into=tmp_path / "report")
    assert "line" in page.read_text(encoding="utf-8")


def test_a_row_is_the_flight_by_hand(serial):
    mission = load_suite("paper-20").missions[0]
    env = gym.make(mission.env_id, **mission.options)
    for policy, label in ((CLRRT.for_env(env), "clrrt"), (StraightLine.for_env(env), "straight-line")):
        flight = fly(env, policy, scenario=mission.scenarios[3])
        (row,) = [r for r in serial if r.key == ("paper-20-v1", mission.name, 3, label)]
        assert (row.outcome, row.success) == (flight.outcome.name, flight.outcome.name == "GOAL")
        assert (row.time, row.energy, row.length) == (flight.time, flight.energy, flight.length)
        assert (row.clearance, row.obstacles, row.decisions) == (flight.clearance, 20, len(flight.references))
        assert row.episode_return == flight.episode_return
        assert row.crossings == len(flight.transitions)
        if flight.transitions:
            assert row.crossing_time == flight.transitions[0]["time"]
            assert row.tilt == max(crossing["tilt"] for crossing in flight.transitions)
            assert row.lateral_speed == max(crossing["lateral_speed"] for crossing in flight.transitions)
        assert 0.0 < row.decision_ms_p50 <= row.decision_ms_p99 <= row.decision_ms_max


def test_the_vehicle_is_the_one_asked_for(serial):
    mission = load_suite("paper-20").missions[1]
    env = gym.make(mission.env_id, **mission.options, vehicle="physical")
    flight = fly(env, CLRRT.for_env(env), scenario=mission.scenarios[0])
    rows = evaluate("paper-20", "clrrt", worlds=1, vehicle="physical")
    assert (rows[1].time, rows[1].energy) == (flight.time, flight.energy)
    assert rows[1].energy not in [row.energy for row in serial]


def test_the_control_law_is_the_one_asked_for_or_that_of_the_worlds(serial):
    mission = load_suite("paper-20").missions[1]
    env = gym.make(mission.env_id, **mission.options, controller="robust")
    flight = fly(env, CLRRT.for_env(env), scenario=mission.scenarios[0])
    rows = evaluate("paper-20", "clrrt", worlds=1, controller="robust")
    assert (rows[1].time, rows[1].energy) == (flight.time, flight.energy)
    named = Suite(name="robust", missions=(replace(mission, options={**mission.options, "controller": "robust"}),))
    assert evaluate(named, "clrrt", worlds=1)[0].energy == flight.energy
    paper = evaluate(named, "clrrt", worlds=1, controller="paper")[0]
    assert paper.energy in [row.energy for row in serial]


def test_only_shields_count_interventions(serial):
    for record in serial:
        assert (record.interventions is None) == (record.policy != "straight-line-shield")
    assert any(record.interventions for record in serial)


def test_without_obstacles_there_is_no_clearance():
    records = evaluate("density", "straight-line", worlds=1)
    assert [record.clearance is None for record in records] == [record.obstacles == 0 for record in records]
    assert {record.obstacles for record in records} == {0, 10, 20, 30, 40}


@pytest.mark.parametrize("backend", ["loky", "threading"])
def test_rows_are_those_of_a_serial_run(serial, backend):
    assert timeless(evaluate("paper-20", **FEW, backend=backend, jobs=2)) == timeless(serial)


def test_the_backend_may_come_from_joblib(serial):
    with joblib.parallel_config(backend="threading", n_jobs=2):
        assert timeless(evaluate("paper-20", **FEW)) == timeless(serial)


SCRIPT = """
from hydrone_gym.evaluation import evaluate
from hydrone_gym.evaluation.records import to_line

if __name__ == "__main__":
    %s
    records = evaluate("paper-20", %r, worlds=%d, backend=%r, jobs=2)
    print("ROWS")
    print("".join(map(to_line, records)), end="")
"""
RAY = """
    import atexit, ray
    from ray.cluster_utils import Cluster
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    atexit.register(cluster.shutdown)
    cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    ray.init(address=cluster.address, log_to_driver=False)
    assert len([node for node in ray.nodes() if node["Alive"]]) == 2
"""


@pytest.mark.parametrize(("backend", "before"), [("multiprocessing", ""), ("dask", ""), ("ray", RAY)])
def test_rows_of_a_script_are_those_of_a_serial_run(serial, tmp_path, backend, before):
    """Real ones of Dask and of Ray, here a cluster of two nodes with one core each, so that both must work.

    In a process without threads, unlike this one: its forks cannot wait for a lock that a thread held.
    """
    script = tmp_path / "script.py"
    script.write_text(SCRIPT % (before.strip(), FEW["policies"], FEW["worlds"], backend))
    done = completed([sys.executable, script], 300.0)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.partition("ROWS\n")[2].splitlines()
    assert timeless(map(from_line, lines)) == timeless(serial)


def test_a_cluster_that_was_killed_is_not_sought(serial, tmp_path):
    """It leaves its address in a file, and Ray connects to what that says unless it is told otherwise."""
    with tempfile.TemporaryDirectory(prefix="ray", dir="/tmp") as folder:  # short: sockets lie in it
        place = Path(folder) / "ray" / "ray_current_cluster"
        place.parent.mkdir()
        place.write_text("127.0.0.1:1")
        script = tmp_path / "script.py"
        script.write_text(SCRIPT % ("", FEW["policies"], FEW["worlds"], "ray"))
        done = completed([sys.executable, script], 300.0, env={**os.environ, "RAY_TMPDIR": folder})
    assert done.returncode == 0, done.stderr
    assert timeless(map(from_line, done.stdout.partition("ROWS\n")[2].splitlines())) == timeless(serial)


class Moody:
    """Keeps its own random stream and counts its flights, which a policy should not."""

    def __init__(self, env, seed):
        self.random, self.line, self.decided = np.random.default_rng(seed), StraightLine.for_env(env), 0

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.decided += 1
        action, state = self.line.predict(observation, state, episode_start)
        return action + self.random.normal(0.0, 0.01 * self.decided, 4), state


def test_a_flight_leaves_no_trace_in_the_next():
    """Rows depend on policy, seed and world, even where a policy keeps something to itself."""
    whole = evaluate("paper-20", {"moody": Moody}, worlds=7)
    parts = evaluate("paper-20", {"moody": Moody}, worlds=7, backend="threading", jobs=2)
    assert timeless(parts) == timeless(whole)
    last = load_suite("paper-20").missions[0]
    alone = Suite(name="one", missions=(replace(last, scenarios=last.scenarios[6:7]),))
    (row,) = evaluate(alone, {"moody": Moody})
    (same,) = [r for r in whole if r.world == 6 and r.mission == last.name]
    assert (row.time, row.energy, row.outcome) == (same.time, same.energy, same.outcome)
    assert timeless(evaluate("paper-20", {"moody": Moody}, worlds=7, seed=1)) != timeless(whole)


def test_agrees_with_flying_all_worlds_in_one_batch():
    """The same rows, but for the length of paths and the times of decisions, from seeds and from scenarios."""
    policies = ["ppo", "straight-line+shield", "clrrt"]
    suite = load_suite("held-out-obstacles-30-radii-0.8-1.8", 6)
    assert [(m.name, len(m.scenarios), len(m.scenarios[0].obstacles)) for m in suite.missions] == [
        (name, 6, 30) for name in MISSIONS
    ]
    batch = evaluate(suite, policies, vehicle="physical")
    alone = evaluate(replace(suite, batch=False), policies, vehicle="physical")
    assert {row.length for row in batch} == {None}
    assert {row.policy for row in batch if row.interventions} == {"straight-line+shield"}
    assert all(0.0 < row.decision_ms_p50 <= row.decision_ms_max for row in batch)
    whole = {row.key: replace(row, length=None, zone_speed=None) for row in timeless(alone)}
    assert {row.key: row for row in timeless(batch)} == whole
    mission, options = suite.missions[0], {**suite.missions[0].options, "vehicle": "physical"}
    rows = gym.make_vec(mission.env_id, num_envs=6, vectorization_mode="vector_entry_point", **options)
    drawn = fly_worlds(rows, load_agent("ppo"), seed=HELD_OUT)
    assert [(e.outcome.name, e.obstacles, e.time) for e in drawn] == [
        (row.outcome, row.obstacles, row.time) for row in batch if (row.mission, row.policy) == (mission.name, "ppo")
    ]


def test_a_batch_that_breaks_off_is_told_and_the_others_are_kept(tmp_path):
    class Crowded:
        def __init__(self, env):
            self.line = StraightLine.for_env(env)

        def predict(self, observation, state=None, episode_start=None, deterministic=False):
            if np.ndim(observation["state"]) == 2:
                raise OSError("too many")
            return self.line.predict(observation, state, episode_start)

    policies = {"line": "straight-line", "crowded": Crowded}
    with pytest.raises(
        EvaluationStopped, match="policy 'crowded' failed in suite held-out, mission HydroneGym/Mission-v0, world 0: O"
    ):
        evaluate("held-out", policies, worlds=2, out=tmp_path)
    kept = read_records(tmp_path / "rows.csv")
    assert [(row.policy, row.world) for row in kept] == [("line", 0), ("line", 1)]
    again = evaluate("held-out", {**policies, "crowded": policies["line"]}, worlds=2)
    assert [row.key for row in again[:2]] == [row.key for row in kept]


def test_an_evaluation_of_held_out_worlds_is_scored():
    records, scores = evaluate_held_out("straight-line", worlds=7, options={"num_obstacles": 25, "vehicle": "physical"})
    assert [score["mission"] for score in scores] == list(MISSIONS)
    for score in scores:
        flown = [record for record in records if record.mission == score["mission"]]
        arrived = [record for record in flown if record.outcome == "GOAL"]
        assert (score["episodes"], score["success"]) == (7, len(arrived) / 7)
        assert score["outcomes"] == Counter(record.outcome for record in flown)
        assert score["interval"] == wilson_interval(len(arrived), 7)
        assert score["time"] == pytest.approx(np.mean([record.time for record in arrived]))
        assert score["energy"] == pytest.approx(np.mean([record.energy for record in arrived]))
    assert {record.obstacles for record in records} == {25}


def test_shipped_agents_fly_without_torch():
    program = """if True:
        import sys
        sys.modules["torch"] = sys.modules["stable_baselines3"] = None
        from hydrone_gym.evaluation import evaluate
        records = evaluate("paper-20", ["ppo", "ppo-shield"], worlds=1)
        print(len(records), all(record.success for record in records))
    """
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    assert done.stdout.split() == ["4", "True"]


@pytest.mark.parametrize(("jobs", "calls", "workers"), [(8, 2, 2), (2, 8, 2), (1, 1, 1)])
def test_there_are_no_more_workers_than_calls(jobs, calls, workers):
    with runner("threading", jobs, calls):
        assert joblib.parallel.get_active_backend()[1] == workers


def test_workers_leave_ctrl_c_to_the_process_that_started_them():
    before = signal.getsignal(signal.SIGINT)
    with runner("loky", 2, 2) as run:
        assert list(run([joblib.delayed(signal.getsignal)(signal.SIGINT)] * 2)) == [signal.SIG_IGN] * 2
    assert signal.getsignal(signal.SIGINT) is before
