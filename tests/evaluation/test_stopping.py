"""Evaluations keep what is finished whatever stops them, go on from there, and refuse what does not fit."""

import io
import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace

import pytest

from hydrone_gym.evaluation import EvaluationStopped, evaluate, load_suite, read_records
from hydrone_gym.evaluation.plan import WORLDS_A_JOB, make_plan
from hydrone_gym.evaluation.run import carry_out
from hydrone_gym.evaluation.run_folder import ROWS, RUN, RunFolder
from tests.evaluation.test_run import timeless

PAPER = load_suite("paper-20")
OTHERS = replace(PAPER, missions=tuple(replace(m, scenarios=m.scenarios[1:]) for m in PAPER.missions))
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
        ({"controller": "robust"}, "controller was None, is robust"),
        (
            {"worlds": 3},
            "the worlds of paper-20-v1 were {'air-to-water': 7, 'water-to-air': 7}, are {'air-to-water': 3",
        ),
        ({"policies": ["straight-line"]}, "policies had potential-field too"),
        ({"suites": "dense-40"}, "the worlds of paper-20-v1 were {'air-to-water': 7, 'water-to-air': 7}, are none"),
        ({"suites": OTHERS}, "are {'air-to-water': 7, 'water-to-air': 7} others"),
    ],
)
def test_another_evaluation_is_not_mixed_in(finished, changes, message):
    before = (finished / ROWS).read_bytes()
    with pytest.raises(ValueError, match="holds an evaluation with other arguments") as stop:
        evaluate(**{"suites": "paper-20", **LINES, **changes}, out=finished)
    assert message in str(stop.value)
    assert (finished / ROWS).read_bytes() == before


def test_policies_in_another_order_give_the_same_rows_in_that_order(finished, tmp_path):
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    turned = evaluate("paper-20", LINES["policies"][::-1], worlds=LINES["worlds"], out=tmp_path)
    assert turned == read_records(tmp_path / ROWS)
    assert turned != read_records(finished / ROWS)
    assert {record.key: record for record in turned} == {r.key: r for r in read_records(finished / ROWS)}


def test_overwriting_begins_anew(finished, tmp_path):
    for name in (RUN, ROWS):
        (tmp_path / name).write_bytes((finished / name).read_bytes())
    plan = make_plan("paper-20", "straight-line", worlds=2)
    records = carry_out(plan, RunFolder(tmp_path, plan, overwrite=True))
    assert read_records(tmp_path / ROWS) == records
    assert len(records) == 4
    assert json.loads((tmp_path / RUN).read_text())["arguments"]["policies"].keys() == {"straight-line"}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b",GOAL,1,", b",GOAL,2,", "column success: must be 0 or 1, got '2'"),
        (b",0,20,", b",0,,", "column obstacles: must be a whole number, got ''"),
        (
            b"air-to-water",
            b"air-to-wine",
            "there must be no row, or no second one, of ('paper-20-v1', 'air-to-wine', 0, 'str",
        ),
        (
            b"water-to-air,1,",
            b"water-to-air,0,",
            "there must be no row, or no second one, of ('paper-20-v1', 'water-to",
        ),
        (b"\n", b"\n\n", "line 2: there must be 23 cells, got 0"),
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
        EvaluationStopped, match=r"policy 'careless' failed .* the action .* of shape \(4,\), got shape \(2,\)"
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
    plan = make_plan("paper-20", "straight-line", worlds=1)
    records, folder = carry_out(plan), RunFolder(tmp_path, plan)
    folder.begin()

    class Slow(io.FileIO):
        def write(self, content):
            return super().write(bytes(content[:7]))

    monkeypatch.setattr("builtins.open", lambda path, mode, buffering: Slow(path, "a"))
    monkeypatch.setattr(folder, "_write_run", lambda: None)
    folder.append(records)
    monkeypatch.undo()
    assert read_records(tmp_path / ROWS) == records


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"worlds": 0}, "worlds must be a whole number of at least 1, got 0"),
        ({"seed": -1}, "seed must be a whole number of at least 0, got -1"),
        ({"jobs": 0}, "jobs must be a whole number of at least 1, at most 1024, got 0"),
        ({"jobs": 100_000}, "jobs must be a whole number of at least 1, at most 1024, got 100000"),
        ({"vehicle": "submarine"}, "submarine"),
        ({"controller": "fuzzy"}, "controller must be one of 'paper', 'robust'"),
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
