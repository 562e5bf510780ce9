"""What goes wrong around `hydrone train`: each told in one line, nothing left behind, nothing lost that was saved."""

import itertools
import json
import os
import shutil
import signal
import subprocess
import sys

import pytest
import yaml

from agents import run_log, training
from agents.agent_file import read_agent
from agents.checkpoint import checkpoints
from agents.recipe import ENV_ID
from agents.run_log import RunLog
from agents.training import TrainingRun, resume, train
from hydrone_gym._folder_lock import held
from hydrone_gym.cli import main
from tests.agents.test_training import PERIOD, RECIPES, SMALL, curve, layers, small_run, written
from tests.processes import finish, started

OUT = "run"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "small.yml", SMALL)
    return tmp_path


def entry(**changes):
    """The small recipe with other settings; None drops one."""
    settings = {**SMALL[ENV_ID], **changes}
    return {**SMALL, ENV_ID: {name: value for name, value in settings.items() if value is not None}}


def kwargs(**changes):
    return entry(policy_kwargs={**SMALL[ENV_ID]["policy_kwargs"], **changes})


TEXT = yaml.safe_dump(SMALL)
NAN, INFINITE = float("nan"), float("inf")
RECIPES_THAT_ARE_REFUSED = {
    "gamma": (entry(gamma=-5), "gamma must be a number from 0 to 1, got -5"),
    "gamma nan": (entry(gamma=NAN), "gamma must be a number from 0 to 1, got nan"),
    "infinite": (entry(vf_coef=INFINITE), "vf_coef must be a number of at least 0, got inf"),
    "net_arch": (
        kwargs(net_arch=[16, -1]),
        "policy_kwargs.net_arch must be a list of fewer than 32 sizes from 1 to 4096",
    ),
    "net_arch text": (kwargs(net_arch="16"), "policy_kwargs.net_arch must be a list"),
    "net_arch empty": (kwargs(net_arch=[]), "policy_kwargs.net_arch must be a list"),
    "net_arch half": (kwargs(net_arch={"pi": [4]}), "policy_kwargs.net_arch must be a list"),
    "net_arch of another": (kwargs(net_arch={"pi": [4], "xf": [4]}), "policy_kwargs.net_arch must name pi and vf, got"),
    "cnn": (entry(policy="CnnPolicy"), "policy must be MlpPolicy, got 'CnnPolicy'"),
    "unknown": (entry(gama=0.9), "unknown key gama: known are batch_size, clip_range"),
    "of another algorithm": (entry(tau=0.1), "unknown key tau: known are"),
    "unknown of the policy": (kwargs(depth=3), "unknown key policy_kwargs.depth: known are"),
    "unknown at the top": (
        {**SMALL, "mission": {}},
        "unknown key mission: known are HydroneGym/Mission-v0, environment",
    ),
    "not a name": ({**SMALL, 3: {}}, "unknown key 3: known are"),
    "entropy": (entry(ent_coef="auto"), "ent_coef must be a number of at least 0, got 'auto'"),
    "type": (entry(n_steps="8"), "n_steps must be a whole number from 1 to 1,000,000,000, got '8'"),
    "bool": (entry(n_epochs=True), "n_epochs must be a whole number"),
    "half a step": (entry(n_timesteps=10.5), "n_timesteps must be a whole number"),
    "exponent": (entry(learning_rate="5e-4"), "learning_rate must be a number of at least 0 such as 3.0e-4, or lin_"),
    "schedule": (entry(learning_rate="lin_fast"), "learning_rate must be"),
    "schedule nan": (entry(learning_rate="lin_nan"), "learning_rate must be"),
    "batch of one": (entry(batch_size=1), "batch_size must be a whole number from 2"),
    "memory": (entry(n_steps=10**9), "no model can be made of this recipe"),
    "optimizer": (kwargs(optimizer_kwargs={"eps": -1.0}), "no model can be made of this recipe: ValueError: Invalid"),
    "optimizer's names": (kwargs(optimizer_kwargs={"epps": 1.0}), "no model can be made of this recipe: TypeError"),
    "environment": ({**SMALL, "environment": {"wind": 3}}, "unknown key environment.wind: known are"),
    "interface": ({**SMALL, "environment": {"interface": "world"}}, "unknown key environment.interface: known are"),
    "option": ({**SMALL, "environment": {"period": -1}}, "environment: period must be a positive number (s), got -1"),
    "level": ({**SMALL, "environment": {"weather": [0, 9]}}, "environment: weather must be a level from 0 to 5 or"),
    "evaluation": ({**SMALL, "evaluation": {"wind": 3}}, "unknown key evaluation.wind: known are"),
    "weather of an evaluation": ({**SMALL, "evaluation": {"weather": [0, 1]}}, "evaluation: weather must be a level"),
    "missions": ({**SMALL, "missions": {"CartPole-v1": 48}}, "missions must be a mapping from ids of this project"),
    "rows": ({**SMALL, "missions": {ENV_ID: -48}}, "missions must be a mapping from ids of this project"),
    "sum": ({**SMALL, "missions": {ENV_ID: 4}}, "the rows of missions must sum to n_envs = 48"),
    "shield": ({**SMALL, "shield": "yes, please"}, "shield must be true or false, got 'yes, please'"),
    "no steps": (entry(n_timesteps=None), "HydroneGym/Mission-v0 lacks n_timesteps"),
    "empty": ("", "needs an entry 'HydroneGym/Mission-v0'"),
    "list": ("[1, 2]", "needs an entry 'HydroneGym/Mission-v0'"),
    "text": ("gamma", "needs an entry 'HydroneGym/Mission-v0'"),
    "twice": (f"{TEXT}\n{ENV_ID}: {{}}", f"the key '{ENV_ID}' stands there twice"),
    "gamma twice": (TEXT.replace("n_epochs: 2", "n_epochs: 2\n  n_epochs: 3"), "the key 'n_epochs' stands there twice"),
    "python": ("a: !!python/name:os.system ''", "could not determine a constructor"),
    "binary": (b"\xff\xfe\x00", "no YAML"),
    "cut": (TEXT + "\nshield: {", "no YAML"),
    "alias": ("a: &x 3\nb: *x", "an alias"),
}


@pytest.mark.parametrize("case", RECIPES_THAT_ARE_REFUSED)
def test_a_recipe_that_is_refused(here, capsys, case):
    content, message = RECIPES_THAT_ARE_REFUSED[case]
    if isinstance(content, dict):
        content = yaml.safe_dump(content)
    (here / "mine.yml").write_bytes(content.encode() if isinstance(content, str) else content)
    assert main(["train", "ppo", "--recipe", "mine.yml", "--out", OUT, "--json"]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "compiling" not in line]
    assert line.startswith("hydrone: error: mine.yml: ")
    assert message in line
    assert sorted(path.name for path in here.iterdir()) == ["mine.yml", "small.yml"]


def test_values_that_a_recipe_may_have(here):
    """Whole numbers written as such with a point, and what several algorithms know."""
    for name, content in RECIPES.items():
        settings = {**content[ENV_ID], "n_timesteps": 1e3, "gamma": 1, "policy_kwargs": {"net_arch": {}}}
        settings["policy_kwargs"]["net_arch"] = {"pi": [8], "vf" if name == "ppo" else "qf": [8]}
        recipe = written(here / f"{name}.yml", {**content, ENV_ID: settings})
        assert training.load_recipe(name, recipe).steps == 1000
        training._built(
            TrainingRun(folder=here / "x", algorithm=name, recipe=recipe), training.load_recipe(name, recipe)
        )


def test_noise_is_normal(here):
    recipe = written(here / "td3.yml", {**RECIPES["td3"], ENV_ID: {**RECIPES["td3"][ENV_ID], "noise_type": "ou"}})
    with pytest.raises(ValueError, match="noise_type must be normal, got 'ou'"):
        training.load_recipe("td3", recipe)


ARGUMENTS = {
    "seed": (["--seed", "-1"], "seed must lie between"),
    "steps": (["--steps", "0"], "steps must be at least 1, got 0"),
    "threads": (["--num-threads", "0"], "threads must be at least 1, got 0"),
    "checkpoints": (["--checkpoint-every", "0"], "checkpoint_every must be at least 1, got 0"),
    "episodes": (["--evaluation-episodes", "-1"], "evaluation_episodes must be at least 0, got -1"),
    "obstacles": (["--obstacles", "-3"], "num_obstacles"),
    "no recipe": (["--recipe", "none.yml"], "none.yml"),
    "recipe is a folder": (["--recipe", "folder"], "folder"),
    "out is a file": (["--out", "small.yml"], "small.yml"),
    "out lies in a file": (["--out", "small.yml/run"], "small.yml"),
    "out holds a run": (["--out", "held"], "holds a run already"),
    "no start": (["--start-from", "nowhere"], "nowhere holds no checkpoint"),
    "start is a file": (["--start-from", "small.yml"], "small.yml holds no checkpoint"),
    "resume": (["--resume", "nowhere"], "no training run at nowhere"),
    "resume a file": (["--resume", "small.yml"], "no training run at small.yml"),
    "resume half": (["--resume", "held"], "not the configuration of a run: TypeError"),
    "resume none": (["--resume", "bare"], "bare holds no checkpoint"),
    "resume and seed": (["--resume", "held", "--seed", "3"], "--resume excludes seed"),
}


@pytest.mark.parametrize("case", ARGUMENTS)
def test_arguments_that_are_refused(here, capsys, case):
    arguments, message = ARGUMENTS[case]
    for name in ("folder", "held", "bare"):
        (here / name).mkdir()
    (here / "held" / "config.yaml").write_text("recipe: {}")
    told = {"recipe": None, "start_from": None}
    recipe = {"algorithm": "ppo", "steps": 1, "missions": {}, "policy": "MlpPolicy", "settings": {}}
    (here / "bare" / "config.yaml").write_text(yaml.safe_dump({"run": told, "recipe": recipe}))
    before = sorted(here.rglob("*"))
    defaults = [] if "--resume" in arguments else ["--recipe", "small.yml", "--out", OUT]  # the last of each counts
    assert main(["train", *defaults, *arguments]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "compiling" not in line]
    assert line.startswith("hydrone: error: ")
    assert message in line
    assert sorted(here.rglob("*")) == before


@pytest.mark.parametrize(("algorithm", "steps"), [("ppo", PERIOD + 1), ("ppo", 2 * PERIOD), ("sac", 48 * 2 * 9 + 5)])
def test_the_bar_ends_where_the_training_does(here, monkeypatch, algorithm, steps):
    bars = []

    class Bar(run_log.tqdm):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            bars.append(self)

    monkeypatch.setattr(run_log, "tqdm", Bar)
    recipe = written(here / "other.yml", RECIPES[algorithm])
    train(small_run(here / OUT, recipe, algorithm=algorithm, steps=steps, progress=True))
    taken = read_agent(here / OUT / "agent").notes["steps"]
    assert taken >= steps
    assert (bars[-1].total, bars[-1].n) == (taken, taken)


def test_the_second_of_two_is_told(here, capsys):
    (here / OUT).mkdir()
    with held(here / OUT):
        assert main(["train", "--recipe", "small.yml", "--out", OUT]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if "compiling" not in line]
    assert line == f"hydrone: error: {OUT} is in use by another run (pid {os.getpid()})"
    assert list((here / OUT).iterdir()) == []
    train(small_run(here / OUT, here / "small.yml", steps=PERIOD))
    with held(here / OUT):
        assert main(["train", "--resume", OUT]) == 2
    assert "is in use by another run" in capsys.readouterr().err


def test_two_at_once(here):
    """Two processes, one folder: one trains, the other says that it does not."""
    command = [sys.executable, "-c", "import sys; from hydrone_gym.cli import main; sys.exit(main())", "train"]
    command += ["--recipe", "small.yml", "--out", OUT, "--evaluation-episodes", "0", "--json"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with started(command, **pipes) as one, started(command, **pipes) as other:
        both = one, other
        printed = [finish(process)[1] for process in both]
    assert sorted(process.returncode for process in both) == [0, 2]
    (refusal,) = [text for process, text in zip(both, printed, strict=True) if process.returncode == 2]
    (line,) = refusal.splitlines()
    assert line.startswith(f"hydrone: error: {OUT} ")  # is in use, or holds a run already
    assert read_agent(here / OUT / "agent").notes["steps"] == 6 * PERIOD


def interrupt(monkeypatch, at, go):
    """Send the signal of Ctrl-C while steps are taken, `at` so many updates; `go` trains."""

    def step(self, step=RunLog._on_step):
        if self.num_timesteps > at * PERIOD:
            os.kill(os.getpid(), signal.SIGINT)
        return step(self)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where a script runs in the background
    with monkeypatch.context() as patch:
        patch.setattr(RunLog, "_on_step", step)
        try:
            return go()
        except KeyboardInterrupt:
            return None
        finally:
            signal.signal(signal.SIGINT, before)


def test_ctrl_c_says_how_to_go_on(here, capsys, monkeypatch):
    options = ["--recipe", "small.yml", "--evaluation-episodes", "0", "--checkpoint-every", str(PERIOD)]
    assert interrupt(monkeypatch, 3.5, lambda: main(["train", *options, "--out", OUT])) == 130
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == f"hydrone: interrupted; hydrone train --resume {OUT} goes on after step {3 * PERIOD:010d}"
    assert not (here / OUT / ".lock").exists()
    assert main(["train", "--resume", OUT, "--json"]) == 0
    assert read_agent(here / OUT / "agent").notes["steps"] == 6 * PERIOD


def test_what_ends_before_its_first_checkpoint_leaves_no_folder(here, capsys, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    for error, status in ((full, 2), (lambda *_: (_ for _ in ()).throw(KeyboardInterrupt()), 130)):
        with monkeypatch.context() as patch:
            patch.setattr(run_log, "save_checkpoint", error)
            assert main(["train", "--recipe", "small.yml", "--out", OUT]) == status
        assert sorted(path.name for path in here.iterdir()) == ["small.yml"]
    (here / OUT).mkdir()
    (here / OUT / "mine.txt").write_text("stays")
    with monkeypatch.context() as patch:
        patch.setattr(run_log, "save_checkpoint", full)
        assert main(["train", "--recipe", "small.yml", "--out", OUT]) == 2
    assert [path.name for path in (here / OUT).iterdir()] == ["mine.txt"]
    assert "No space left" in capsys.readouterr().err


def truncate(path):
    (path / "model.zip").write_bytes((path / "model.zip").read_bytes()[:3000])


def flip(path):
    data = bytearray((path / "rest.pkl").read_bytes())
    data[len(data) // 2] ^= 1
    (path / "rest.pkl").write_bytes(data)


def lose(path):
    (path / "rest.pkl").unlink()


@pytest.mark.parametrize("damage", [truncate, flip, lose])
def test_a_damaged_checkpoint_falls_back_to_the_one_before(here, capsys, monkeypatch, damage):
    """To the very same weights and curve as ever; and the damaged one is not taken for the latest again."""
    settings = {"checkpoint_every": PERIOD}
    train(small_run(here / "whole", here / "small.yml", **settings))
    interrupt(monkeypatch, 4.5, lambda: train(small_run(here / OUT, here / "small.yml", **settings)))
    older, latest = checkpoints(here / OUT / "checkpoints")
    damage(latest)
    capsys.readouterr()
    shutil.copytree(here / OUT, here / "both")
    interrupt(
        monkeypatch, 3.5, lambda: resume(here / OUT, progress=False)
    )  # killed again before it is where the damaged one was
    assert older.exists()
    resume(here / OUT, progress=False)
    told = capsys.readouterr().err.splitlines()
    assert told == [f"hydrone: {latest} is damaged: the checkpoint before it is tried"] * 2
    for a, b in zip(layers(here / "whole"), layers(here / OUT), strict=True):
        assert (a == b).all()
    assert curve(here / "whole") == curve(here / OUT)

    damage(here / "both" / "checkpoints" / older.name)
    assert main(["train", "--resume", "both"]) == 2
    *_, last = capsys.readouterr().err.splitlines()
    assert last == "hydrone: error: both holds no checkpoint that is whole"


def test_a_new_checkpoint_outlives_a_damaged_later_one(here, monkeypatch):
    """Runs with a replay buffer keep one checkpoint: it must be the one that was just written."""
    recipe = written(here / "sac.yml", RECIPES["sac"])
    run = small_run(here / OUT, recipe, algorithm="sac", checkpoint_every=PERIOD)
    interrupt(monkeypatch, 2.5, lambda: train(run))
    (only,) = checkpoints(here / OUT / "checkpoints")
    damaged = only.with_name("step_0000001900")
    shutil.copytree(only, damaged)
    truncate(damaged)
    interrupt(monkeypatch, 4.5, lambda: resume(here / OUT, progress=False))
    (kept,) = checkpoints(here / OUT / "checkpoints")
    assert only.name < kept.name < damaged.name


def test_where_an_agent_comes_from(here, monkeypatch):
    """Versions with the commit, and the seconds of all processes that trained it."""
    monkeypatch.setattr(training, "commit", lambda: "0123456789ab")
    clock = itertools.count(0.0, 10.0)
    monkeypatch.setattr(run_log.time, "process_time", lambda: next(clock))
    interrupt(monkeypatch, 3.5, lambda: train(small_run(here / OUT, here / "small.yml")))
    first = float(list(curve_seconds(here / OUT))[-1])
    assert first >= 30.0
    resume(here / OUT, progress=False)
    notes = read_agent(here / OUT / "agent").notes
    assert notes["seconds"]["cpu"] > first + 20.0
    assert notes["seconds"]["wall"] > 0.0
    resume(here / OUT, progress=False)
    assert read_agent(here / OUT / "agent").notes == notes
    versions = json.loads((here / OUT / "versions.json").read_text())
    assert versions["commit"] == notes["versions"]["commit"] == "0123456789ab"
    assert {"python", "torch", "hydrone-gym"} <= versions.keys()


def curve_seconds(folder):
    return [line.split(",")[2] for line in (folder / "curve.csv").read_text().splitlines()[1:]]


def test_tables_on_the_terminal(here, capsys):
    """Not Markdown, which is for files."""
    assert main(["train", "--recipe", "small.yml", "--out", OUT, "--evaluation-episodes", "2"]) == 0
    printed = capsys.readouterr().out
    assert "|--" not in printed
    assert "success (%)" in printed
