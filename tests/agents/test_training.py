"""Training runs: what they leave behind, that they repeat, and that stopping and resuming loses nothing."""

import csv
import dataclasses
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from agents import run_log, training
from agents.agent_file import read_agent
from agents.algorithms import ALGORITHMS
from agents.checkpoint import checkpoints, load_buffer, save_buffer
from agents.recipe import ENV_ID, FOLDER, load_recipe
from agents.run_log import RunLog
from agents.training import TrainingRun, resume, train
from agents.vec_env import MissionMix
from hydrone_gym.evaluation import HELD_OUT, MISSIONS, evaluate_held_out

SMALL = {
    ENV_ID: {
        "n_envs": 48,
        "n_timesteps": 48 * 8 * 6,
        "policy": "MlpPolicy",
        "n_steps": 8,
        "batch_size": 128,
        "n_epochs": 2,
        "learning_rate": "lin_5e-4",
        "policy_kwargs": {"net_arch": [16], "log_std_init": -1.0},
    },
    "missions": {ENV_ID: 32, "HydroneGym/AirToWater-v0": 16},
}
PERIOD = 48 * 8  # steps an update
OFF_POLICY = {
    ENV_ID: {
        "n_envs": 48,
        "n_timesteps": 48 * 8 * 6,
        "policy": "MlpPolicy",
        "train_freq": 2,
        "gradient_steps": 1,
        "batch_size": 64,
        "buffer_size": 48 * 30,  # less than the run: the buffer comes round
        "learning_starts": 2 * PERIOD,
        "learning_rate": "lin_1e-3",
        "n_steps": 3,
        "policy_kwargs": {"net_arch": [16]},
    },
    "missions": SMALL["missions"],
}
NOISY = {**OFF_POLICY, ENV_ID: {**OFF_POLICY[ENV_ID], "noise_type": "normal", "noise_std": 0.2}}
RECIPES = {"ppo": SMALL, "sac": OFF_POLICY, "td3": NOISY, "tqc": OFF_POLICY}


def written(path, content):
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.fixture
def recipe(tmp_path):
    return written(tmp_path / "small.yml", SMALL)


def small_run(folder, recipe, **changes):
    settings = {"checkpoint_every": PERIOD, "evaluation_episodes": 0, "progress": False, "seed": 5, **changes}
    return TrainingRun(folder=folder, recipe=recipe, **settings)


def layers(folder):
    network = read_agent(folder / "agent").network
    return [*network.weights, *network.biases]


def curve(folder):
    with (folder / "curve.csv").open() as stream:
        return [{k: v for k, v in line.items() if not k.endswith("_s")} for line in csv.DictReader(stream)]


def test_a_run_folder_is_complete(tmp_path, recipe):
    folder = tmp_path / "run"
    records, scores = train(small_run(folder, recipe, evaluation_episodes=8))
    assert [record.mission for record in records[::8]] == [score["mission"] for score in scores] == list(MISSIONS)
    assert [entry["episodes"] for entry in json.loads((folder / "evaluation.json").read_text())] == [8, 8, 8]
    assert (folder / "curve.png").stat().st_size > 1000
    assert [int(line["steps"]) for line in curve(folder)] == [PERIOD * k for k in range(1, 7)]
    assert json.loads((folder / "versions.json").read_text())["torch"].startswith(torch.__version__.split("+")[0])
    assert read_agent(folder / "agent").notes["steps"] == 6 * PERIOD
    assert len(checkpoints(folder / "checkpoints")) == 2
    with pytest.raises(FileExistsError, match="holds a run already"):
        train(small_run(folder, recipe))


def test_an_evaluation_has_options_of_its_own(tmp_path):
    """What a recipe says of held-out worlds holds there alone; an option of the run holds in both."""
    own = {"environment": {"weather": [0, 1]}, "evaluation": {"weather": 2, "controller": "robust", "num_obstacles": 3}}
    recipe = written(tmp_path / "small.yml", {**SMALL, **own})
    run = small_run(tmp_path / "run", recipe, evaluation_episodes=4, options={"num_obstacles": 6})
    records, _ = train(run)
    assert {record.obstacles for record in records} == {6}
    options = {"weather": 2, "controller": "robust", "num_obstacles": 6}
    again, _ = evaluate_held_out(str(tmp_path / "run" / "agent"), worlds=4, options=options)
    assert all(one.same_flight(other) for one, other in zip(records, again, strict=True))


@pytest.mark.parametrize(
    ("algorithm", "killed_at"), [("ppo", 3.5), ("sac", 1.5), ("sac", 4.5), ("td3", 4.5), ("tqc", 4.5)]
)
def test_killed_and_resumed_is_never_stopped(tmp_path, monkeypatch, algorithm, killed_at):
    """A run killed in the middle of a rollout goes on from its checkpoint to the very same weights and curve.

    Off-policy algorithms are killed while actions are still drawn blindly, and after their replay buffer came round.
    """
    monkeypatch.setattr(run_log, "LINES", 6)
    recipe = written(tmp_path / "small.yml", RECIPES[algorithm])
    settings = {"algorithm": algorithm, "checkpoint_every": PERIOD - 100}  # due before a line of the curve is
    train(small_run(tmp_path / "whole", recipe, **settings))

    class KilledError(Exception):
        pass

    def dies(self, step=RunLog._on_step):
        if self.num_timesteps > killed_at * PERIOD:
            raise KilledError
        return step(self)

    with monkeypatch.context() as patch:
        patch.setattr(RunLog, "_on_step", dies)
        with pytest.raises(KilledError):
            train(small_run(tmp_path / "halves", recipe, **settings))
    torch.manual_seed(99)
    np.random.seed(99)  # noqa: NPY002
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        resume(tmp_path / "halves", progress=False)
    for a, b in zip(layers(tmp_path / "whole"), layers(tmp_path / "halves"), strict=True):
        np.testing.assert_array_equal(a, b)
    assert curve(tmp_path / "whole") == curve(tmp_path / "halves")
    assert [int(line["steps"]) for line in curve(tmp_path / "whole")] == [PERIOD * k for k in range(1, 7)]


@pytest.mark.parametrize("steps", [20, 30, 75])
def test_a_replay_buffer_survives_its_file(tmp_path, steps):
    """Not yet full, just full, and come round twice."""
    rows = MissionMix({ENV_ID: 6}, {"time_limit": 4.0})
    arguments = {"learning_starts": 10**6, "buffer_size": 180, "n_steps": 3, "seed": 0, "device": "cpu"}
    model = ALGORITHMS["sac"].model("MlpPolicy", rows, **arguments)
    model.learn(6 * steps)
    save_buffer(model.replay_buffer, tmp_path / "replay.npz")
    other = ALGORITHMS["sac"].model("MlpPolicy", rows, **arguments)
    load_buffer(other.replay_buffer, tmp_path / "replay.npz")
    assert model.replay_buffer.timeouts.any()
    for name, value in vars(model.replay_buffer).items():
        np.testing.assert_array_equal(value, getattr(other.replay_buffer, name), err_msg=name)
    observations = model.replay_buffer.observations[: min(steps, 30)].nbytes
    assert (tmp_path / "replay.npz").stat().st_size < 1.5 * observations + 4000


def test_time_outs_are_bootstrapped():
    """The replay buffer holds the last observation of an ended row, and a time-out does not count as an end."""
    rows = MissionMix({ENV_ID: 8}, {"time_limit": 4.0})
    model = ALGORITHMS["sac"].model("MlpPolicy", rows, learning_starts=10**6, buffer_size=8 * 40, seed=0, device="cpu")
    model.learn(8 * 20)
    buffer = model.replay_buffer
    timeouts = np.argwhere(buffer.timeouts[:20])
    assert len(timeouts) > 4
    for step, row in timeouts:
        assert buffer.dones[step, row]
        last, first = buffer.next_observations[step, row], buffer.observations[step + 1, row]
        assert np.abs(last - first).max() > 0.1  # the next episode began elsewhere
        assert np.abs(last[:3] - buffer.observations[step, row, :3]).max() < 0.4  # 2 m, in fifths
    sample = buffer._get_samples(timeouts[:, 0])
    assert sample.dones.sum() <= buffer.dones[timeouts[:, 0]].sum() - len(timeouts)


def test_seeds(tmp_path, recipe):
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        train(small_run(tmp_path / name, recipe, seed=seed))
    for a, b in zip(layers(tmp_path / "a"), layers(tmp_path / "b"), strict=True):
        np.testing.assert_array_equal(a, b)
    assert not np.array_equal(layers(tmp_path / "a")[0], layers(tmp_path / "c")[0])


def test_start_from_takes_the_weights(tmp_path, recipe, monkeypatch):
    train(small_run(tmp_path / "first", recipe))
    seen = []
    monkeypatch.setattr(training, "_learn", lambda run, recipe, model, spent: seen.append(model))
    train(small_run(tmp_path / "second", recipe, start_from=tmp_path / "first"))
    first = seen[0].policy.mlp_extractor.policy_net[0].weight.detach().numpy().T
    np.testing.assert_array_equal(first, layers(tmp_path / "first")[0])


def test_the_recipe_says_what_the_rows_fly_in(tmp_path, monkeypatch):
    """In training, unless the run says something else; evaluation flies what the run says."""
    flown = []
    monkeypatch.setattr(training, "evaluate_held_out", lambda policy, **told: (flown.append(told["options"]) or [], []))
    made = []
    monkeypatch.setattr(
        training, "MissionMix", lambda *args, **more: made.append(MissionMix(*args, **more)) or made[-1]
    )
    recipe = written(tmp_path / "dense.yml", {**SMALL, "environment": {"num_obstacles": 7, "time_limit": 30.0}})
    for name, options in (("a", {}), ("b", {"num_obstacles": 9})):
        train(small_run(tmp_path / name, recipe, steps=PERIOD, options=options, evaluation_episodes=2))
    rows = [part.options for mix in made for part in mix.parts]
    assert [(o.num_obstacles, o.time_limit) for o in rows] == [(7, 30.0)] * 2 + [(9, 30.0)] * 2
    assert flown == [{}, {"num_obstacles": 9}]


def test_bad_runs(tmp_path, recipe):
    with pytest.raises(FileNotFoundError, match="no training run"):
        resume(tmp_path / "nothing")
    with pytest.raises(ValueError, match="algorithm must be one of 'ppo'"):
        train(TrainingRun(folder=tmp_path / "x", algorithm="pppo"))
    with pytest.raises(ValueError, match="steps must be at least 1, got 0"):
        TrainingRun(folder=tmp_path, steps=0)
    with pytest.raises(ValueError, match="seed must lie between 0 and 4999999, got -1"):
        TrainingRun(folder=tmp_path, seed=-1)
    with pytest.raises(FileNotFoundError, match="holds no checkpoint"):
        train(small_run(tmp_path / "y", recipe, start_from=tmp_path / "z"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: [", "no YAML"),
        ("a: 1", "needs an entry"),
        ("HydroneGym/Mission-v0: {n_envs: 4}", "lacks n_timesteps, policy"),
        (
            "HydroneGym/Mission-v0: {n_envs: 4, n_timesteps: 9, policy: MlpPolicy, policy_kwargs: dict()}",
            "code is not run",
        ),
        (
            "HydroneGym/Mission-v0: {n_envs: 4, n_timesteps: 9, policy: MlpPolicy, noise_type: ou}",
            "unknown key noise_type: known are",
        ),
        (
            "HydroneGym/Mission-v0: {n_envs: 4, n_timesteps: 9, policy: MlpPolicy}\n"
            "missions: {HydroneGym/AirToWater-v0: 3}",
            "must sum to n_envs = 4",
        ),
        (
            "HydroneGym/Mission-v0: {n_envs: 4, n_timesteps: 9, policy: MlpPolicy}\nenvironment: [7]",
            r"mapping .* got \[7\]",
        ),
    ],
)
def test_bad_recipes(tmp_path, text, message):
    path = tmp_path / "bad.yml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_recipe("ppo", path)


def test_the_packaged_recipes():
    assert sorted(file.stem for file in FOLDER.glob("*.yml")) == sorted(ALGORITHMS)
    schedule = load_recipe("ppo").arguments()["learning_rate"]
    assert (schedule(1.0), schedule(0.5), schedule(0.0)) == (6e-4, 3e-4, 0.0)
    noise = load_recipe("td3").arguments()["action_noise"]
    assert noise().shape == (3,)
    names = {spec.name for spec in dataclasses.fields(TrainingRun)}
    assert {"seed", "steps", "threads"} <= names


@pytest.mark.parametrize("name", ["sac", "td3", "tqc"])
def test_packaged_recipes_suit_their_algorithms(name, monkeypatch, tmp_path):
    """What a recipe says reaches the model."""
    seen = []
    monkeypatch.setattr(training, "_learn", lambda run, recipe, model, spent: seen.append(model))
    train(TrainingRun(folder=tmp_path / "run", algorithm=name))
    (model,) = seen
    assert type(model) is ALGORITHMS[name].model
    assert model.replay_buffer.n_steps == 5
    assert model.replay_buffer.handle_timeout_termination
    assert {type(module) for module in model.policy.actor.modules()} >= {torch.nn.ReLU}


def test_tensorboard(tmp_path, recipe, monkeypatch):
    train(small_run(tmp_path / "run", recipe, tensorboard=True))
    assert list((tmp_path / "run" / "tensorboard").rglob("events.out.tfevents.*"))
    monkeypatch.setattr(training, "find_spec", lambda _: None)
    with pytest.raises(ValueError, match=r'pip install "hydrone-gym\[tensorboard\]"'):
        small_run(tmp_path / "other", recipe, tensorboard=True)


def test_mission_mix_is_its_parts():
    """Rows of the mix are the rows of the parts, seeded one after the other."""
    mix = MissionMix({ENV_ID: 3, "HydroneGym/WaterToAir-v0": 2})
    mix.seed(7)
    observation = mix.reset()
    second = mix.parts[1]
    goals = second._core.episodes.rows["goal"]
    np.testing.assert_array_equal(goals, [[-9.0, 9.0, 7.0]] * 2)
    alone = MissionMix({"HydroneGym/WaterToAir-v0": 2})
    alone.seed(10)
    np.testing.assert_array_equal(alone.reset(), observation[3:])
    actions = np.full((5, 3), 0.3, np.float32)
    ours, theirs = mix.step(actions), alone.step(actions[3:])
    for mine, other in zip(ours[:3], theirs[:3], strict=True):
        np.testing.assert_array_equal(mine[3:], other)
    assert len(ours[3]) == 5
    assert mix.get_attr("num_envs") == [3, 3, 3, 2, 2]
    with pytest.raises(ValueError, match="at least one environment"):
        MissionMix({})


def test_held_out_seeds_lie_beyond_training():
    largest = HELD_OUT // 2 - 1
    TrainingRun(folder=Path("x"), seed=largest)
    assert largest + sum(load_recipe("ppo").missions.values()) < HELD_OUT
