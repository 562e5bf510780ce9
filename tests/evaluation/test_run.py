"""Evaluations give the same rows however they are run, and keep what is finished whatever stops them."""

import io
import json
import os
import subprocess
import sys
from dataclasses import replace

import gymnasium as gym
import joblib
import numpy as np
import pytest

import agents.evaluation
from agents import load_agent
from hydrone_gym.evaluation import EvaluationStopped, Suite, evaluate, fly, load_suite, read_records
from hydrone_gym.evaluation.plan import WORLDS_A_JOB, make_plan
from hydrone_gym.evaluation.records import TIMING
from hydrone_gym.evaluation.run_folder import ROWS, RUN, RunFolder
from planners import CLRRT, StraightLine

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


def test_only_shields_count_interventions(serial):
    for record in serial:
        assert (record.interventions is None) == (record.policy != "straight-line-shield")
    assert any(record.interventions for record in serial)


def test_without_obstacles_there_is_no_clearance():
    records = evaluate("density", "straight-line", worlds=1)
    assert [record.clearance is None for record in records] == [record.obstacles == 0 for record in records]
    assert {record.obstacles for record in records} == {0, 10, 20, 30, 40}


@pytest.mark.parametrize("backend", ["loky", "threading", "multiprocessing", "dask"])
def test_rows_are_those_of_a_serial_run(serial, backend):
    assert timeless(evaluate("paper-20", **FEW, backend=backend, jobs=2)) == timeless(serial)


def test_the_backend_may_come_from_joblib(serial):
    with joblib.parallel_config(backend="threading", n_jobs=2):
        assert timeless(evaluate("paper-20", **FEW)) == timeless(serial)


RAY = """
import sys, ray
from ray.cluster_utils import Cluster
from hydrone_gym.evaluation import evaluate
from hydrone_gym.evaluation.records import to_line

if __name__ == "__main__":
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    cluster.add_node(num_cpus=1)
    cluster.wait_for_nodes()
    ray.init(address=cluster.address, log_to_driver=False)
    assert len([node for node in ray.nodes() if node["Alive"]]) == 2
    records = evaluate("paper-20", %r, worlds=%d, backend="ray")
    print("ROWS")
    print("".join(map(to_line, records)), end="")
    ray.shutdown()
    cluster.shutdown()
"""


def test_rows_from_a_cluster_of_two_nodes_are_those_of_a_serial_run(serial, tmp_path):
    """A real Ray cluster, two nodes on this machine with one core each, so that both must work."""
    from hydrone_gym.evaluation.records import from_line

    script = tmp_path / "on_ray.py"
    script.write_text(RAY % (FEW["policies"], FEW["worlds"]))
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.partition("ROWS\n")[2].splitlines()
    assert timeless(map(from_line, lines)) == timeless(serial)


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
    env_id, worlds, seed = "HydroneGym/Mission-v0", 12, agents.evaluation.HELD_OUT
    score = agents.evaluation.evaluate(load_agent("ppo"), env_id, episodes=worlds, seed=seed)
    rows = evaluate(Suite.drawn(env_id, range(seed, seed + worlds)), "ppo")
    arrived = [row for row in rows if row.success]
    assert {name: sum(row.outcome == name for row in rows) for name in score.outcomes} == score.outcomes
    assert score.time == pytest.approx(np.mean([row.time for row in arrived]), rel=1e-12)
    assert score.energy == pytest.approx(np.mean([row.energy for row in arrived]), rel=1e-12)


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


LINES = {"policies": ["straight-line", "potential-field"], "worlds": WORLDS_A_JOB + 2}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    evaluate("paper-20", **LINES, out=folder)
    return folder


@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.5, 0.77, 0.999])
def test_goes_on_after_a_cut_at_any_byte(finished, tmp_path, share, monkeypatch):
    content = (finished / ROWS).read_bytes()
    kept = content[: int(share * len(content))]
    (tmp_path / RUN).write_bytes((finished / RUN).read_bytes())
    (tmp_path / ROWS).write_bytes(kept)
    records = evaluate("paper-20", **LINES, out=tmp_path)
    whole = kept[: kept.rfind(b"\n") + 1]
    assert (tmp_path / ROWS).read_bytes().startswith(whole)
    assert timeless(records) == timeless(read_records(finished / ROWS))
    assert read_records(tmp_path / ROWS) == records


def test_a_finished_evaluation_flies_nothing(finished, monkeypatch):
    monkeypatch.setattr("hydrone_gym.evaluation.run.fly_job", None)
    before = (finished / ROWS).read_bytes()
    assert evaluate("paper-20", **LINES, out=finished) == read_records(finished / ROWS)
    assert (finished / ROWS).read_bytes() == before


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 1}, "seed was 0, is 1"),
        ({"vehicle": "physical"}, "vehicle was paper, is physical"),
        ({"worlds": 3}, "worlds was {'paper-20-v1': {'air-to-water': 7"),
        ({"policies": ["straight-line"]}, "policies was {'straight-line'"),
    ],
)
def test_another_evaluation_is_not_mixed_in(finished, changes, message):
    before = (finished / ROWS).read_bytes()
    with pytest.raises(ValueError, match="holds an evaluation with other arguments") as stop:
        evaluate("paper-20", **{**LINES, **changes}, out=finished)
    assert message in str(stop.value)
    assert (finished / ROWS).read_bytes() == before


def test_policies_in_another_order_are_another_evaluation(finished):
    with pytest.raises(ValueError, match="line 2: expected the row of"):
        evaluate("paper-20", LINES["policies"][::-1], worlds=LINES["worlds"], out=finished)


def test_overwriting_begins_anew(finished, tmp_path):
    for name in (RUN, ROWS):
        (tmp_path / name).write_bytes((finished / name).read_bytes())
    records = evaluate("paper-20", "straight-line", worlds=2, out=tmp_path, overwrite=True)
    assert read_records(tmp_path / ROWS) == records
    assert len(records) == 4
    assert json.loads((tmp_path / RUN).read_text())["arguments"]["policies"].keys() == {"straight-line"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b",GOAL,1,", b",GOAL,2,", "column success: must be 0 or 1, got '2'"),
        (b",0,20,", b",0,,", "column obstacles: must be a whole number, got ''"),
        (b"air-to-water", b"air-to-wine", "expected the row of"),
        (b"\n", b"\n\n", "line 2: there must be 22 cells, got 0"),
    ],
)
def test_damaged_rows_are_told_and_left_alone(finished, tmp_path, old, new, message):
    content = (finished / ROWS).read_bytes().replace(old, new, 1)
    (tmp_path / RUN).write_bytes((finished / RUN).read_bytes())
    (tmp_path / ROWS).write_bytes(content)
    with pytest.raises(ValueError, match=r"rows\.csv, line \d+: ") as stop:
        evaluate("paper-20", **LINES, out=tmp_path)
    assert message in str(stop.value)
    assert (tmp_path / ROWS).read_bytes() == content


def test_a_folder_with_rows_of_unknown_origin_is_left_alone(finished, tmp_path):
    (tmp_path / ROWS).write_bytes((finished / ROWS).read_bytes())
    with pytest.raises(ValueError, match=r"holds rows\.csv without run\.json"):
        evaluate("paper-20", **LINES, out=tmp_path)
    (tmp_path / RUN).write_text("{")
    with pytest.raises(ValueError, match=r"run\.json: damaged"):
        evaluate("paper-20", **LINES, out=tmp_path)


FRAIL = """
import os
from pathlib import Path
from planners import StraightLine

class Frail:
    def __init__(self, env):
        self.line = StraightLine.for_env(env)

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        if Path(__file__).with_name("storm").exists() and observation["obstacles"][:, 0].sum() > 5.5:
            self.founder()
        return self.line.predict(observation, state, episode_start)

    def founder(self):
        {how}
"""


@pytest.mark.parametrize(("backend", "jobs"), [(None, None), ("loky", 2)])
def test_a_policy_that_raises_is_named_and_finished_rows_are_kept(tmp_path, backend, jobs):
    frail = tmp_path / "frail.py"
    frail.write_text(FRAIL.format(how='raise OSError("the mast is\\nbroken")'))
    policies = ["straight-line", f"frail={frail}:Frail"]
    whole = evaluate("paper-20", policies, worlds=8, out=tmp_path / "calm")
    (tmp_path / "storm").touch()
    with pytest.raises(EvaluationStopped) as stop:
        evaluate("paper-20", policies, worlds=8, out=tmp_path / "out", backend=backend, jobs=jobs)
    kept = read_records(tmp_path / "out" / ROWS)
    failed = whole[len(kept)]
    assert len(kept) == WORLDS_A_JOB + 1  # those of the job that failed too
    assert (failed.policy, failed.world) == ("frail", 1)
    where = f"policy 'frail' failed in suite paper-20-v1, mission {failed.mission}, world {failed.world}: "
    reason = f"OSError: the mast is broken ({frail}, line 16); {len(kept)} of 32 flights are finished"
    assert str(stop.value).partition(" and kept")[0] == where + reason
    assert "in founder" in stop.value.__notes__[0]
    assert timeless(stop.value.records) == timeless(kept) == timeless(whole[: len(kept)])
    (tmp_path / "storm").unlink()
    again = evaluate("paper-20", policies, worlds=8, out=tmp_path / "out", backend=backend, jobs=jobs)
    assert timeless(again) == timeless(whole)


def test_a_worker_that_dies_is_told_and_finished_rows_are_kept(tmp_path):
    frail = tmp_path / "frail.py"
    frail.write_text(FRAIL.format(how="os._exit(1)"))
    (tmp_path / "storm").touch()
    policies = ["straight-line", f"frail={frail}:Frail"]
    with pytest.raises(EvaluationStopped, match="workers failed: TerminatedWorkerError"):
        evaluate("paper-20", policies, worlds=60, out=tmp_path / "out", backend="loky", jobs=2)
    assert all(key == record.key for key, record in zip(make_plan("paper-20", policies).keys(), read_rows(tmp_path)))


def read_rows(folder):
    path = folder / "out" / ROWS
    return read_records(path) if path.exists() else []


class Careless:
    def __init__(self, env):
        pass

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return [1.0, 2.0], None


def test_an_action_of_the_wrong_shape_is_the_policys_fault():
    with pytest.raises(
        EvaluationStopped, match=r"policy 'careless' failed .* ValueError: action must have shape \(4,\)"
    ):
        evaluate("paper-20", {"careless": Careless}, worlds=1)


@pytest.mark.parametrize(("worlds", "limit", "least"), [(LINES["worlds"], 4000, 10), (1, 700, 0)])
def test_a_disk_that_takes_no_more_keeps_whole_rows(tmp_path, worlds, limit, least):
    """The limit on the size of files stands in for a full disk: the system takes a part of a block, then no more."""
    program = f"""if True:
        import resource
        from hydrone_gym.evaluation import EvaluationStopped, evaluate
        resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, resource.RLIM_INFINITY))
        try:
            evaluate("paper-20", {LINES["policies"]}, worlds={worlds}, out={str(tmp_path)!r})
        except EvaluationStopped as stop:
            print(stop)
    """
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    kept = read_records(tmp_path / ROWS)
    assert "File too large" in done.stdout
    assert f"of {4 * worlds} flights are finished and kept in {tmp_path / ROWS}" in done.stdout
    assert os.path.getsize(tmp_path / ROWS) == limit
    assert least <= len(kept) < 4 * worlds
    records = evaluate("paper-20", LINES["policies"], worlds=worlds, out=tmp_path)
    assert timeless(records) == timeless(evaluate("paper-20", LINES["policies"], worlds=worlds))
    assert records[: len(kept)] == kept


def test_a_block_that_is_written_in_part_is_written_to_its_end(tmp_path, monkeypatch):
    """A write may take less than it is given without an error."""
    records = evaluate("paper-20", "straight-line", worlds=1)
    folder = RunFolder(tmp_path, {})

    class Slow(io.FileIO):
        def write(self, content):
            return super().write(bytes(content[:7]))

    monkeypatch.setattr("builtins.open", lambda path, mode, buffering: Slow(path, "a"))
    folder.append(records)
    monkeypatch.undo()
    assert read_records(tmp_path / ROWS) == records


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"worlds": 0}, "worlds must be a whole number of at least 1, got 0"),
        ({"seed": -1}, "seed must be a whole number of at least 0, got -1"),
        ({"jobs": 0}, "jobs must be a whole number of at least 1, got 0"),
        ({"vehicle": "submarine"}, "submarine"),
        ({"backend": "carrier-pigeon"}, "carrier-pigeon"),
        ({"suites": ["paper-20", "paper-20-v1"]}, "suites must have different names"),
        ({"suites": []}, "at least one suite"),
    ],
)
def test_bad_arguments(arguments, message):
    with pytest.raises(ValueError) as stop:  # noqa: PT011
        evaluate(**{"suites": "paper-20", "policies": "straight-line", "worlds": 1, **arguments})
    assert message in str(stop.value)


@pytest.mark.parametrize("package", ["dask", "ray"])
def test_a_backend_without_its_package_says_what_to_install(package, monkeypatch):
    for name in ("dask", "distributed") if package == "dask" else ("ray",):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ValueError, match=rf'backend {package}: .*pip install "hydrone-gym\[{package}\]"'):
        evaluate("paper-20", "straight-line", worlds=1, backend=package)


def test_a_scenario_that_cannot_be_flown_is_named_before_anything_flies(tmp_path):
    suite = load_suite("paper-20").first(2)
    mission = suite.missions[0]
    inside = replace(mission.scenarios[0], start=(0.0, 0.0, 0.1, 0.0), name="wet")
    bad = replace(suite, missions=(replace(mission, scenarios=(mission.scenarios[1], inside)),))
    with pytest.raises(
        ValueError, match="suite paper-20-v1, mission air-to-water, world 1 wet: start z must lie outside"
    ):
        evaluate(bad, "straight-line", out=tmp_path)
    assert not (tmp_path / ROWS).exists()
