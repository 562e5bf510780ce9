"""CL-RRT: what it promises, measured on flights through the environment."""

import dataclasses
import itertools
import pickle
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import DummyVecEnv

from hydrone_gym import HYDRONE, Outcome, Scenario, load_scenario
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, generate
from hydrone_gym.world.world import World
from planners import CLRRT, CLRRTSettings
from planners.cl_rrt.stopping import stop_distances
from tests.planners.flights import fly, make

MISSIONS = ("AirToWater", "WaterToAir", "Mission")


def empty_scenario(start, goal, obstacles=()):
    return Scenario(start=(*start, 0.0), goal=goal, obstacles=np.array(obstacles, dtype=float).reshape(-1, 4))


@pytest.mark.parametrize("mission", MISSIONS)
@pytest.mark.parametrize("vehicle", ["paper", "physical", "hydrone-agile"])
def test_reaches_the_goal_smoothly(mission, vehicle):
    env = make(mission, vehicle=vehicle)
    planner = CLRRT.for_env(env)
    for seed in range(8):
        _, info = fly(env, planner, seed=seed)
        assert info["outcome"] is Outcome.GOAL, f"seed {seed}"
        assert info["clearance"] > 0.0
        for crossing in info["transitions"]:
            assert crossing["lateral_speed"] <= 0.1
            assert np.degrees(crossing["tilt"]) <= 2.0


def test_crosses_among_dense_large_spheres():
    env = make("WaterToAir", num_obstacles=40, obstacle_radius=(0.8, 1.8))
    planner = CLRRT.for_env(env)
    outcomes = [fly(env, planner, seed=seed)[1]["outcome"] for seed in range(12)]
    assert outcomes == [Outcome.GOAL] * 12


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"vehicle": "hydrone-agile"},
        {"period": 0.2},
        {"controller": "robust"},
        {"controller": "robust", "crossing": "adaptive"},
    ],
)
@pytest.mark.parametrize("mission", MISSIONS)
def test_prediction_is_execution(mission, options):
    """Every node sent is reached bit for bit, the node's references played in the environment."""
    env = make(mission, **options)
    history, _ = fly(env, CLRRT.for_env(env), seed=3)
    predicted = 0
    for cycle in history:
        if cycle.memory.root >= 0:
            np.testing.assert_array_equal(cycle.memory.nodes["state"][cycle.memory.root], cycle.state_after)
            predicted += 1
    assert predicted > 0.8 * len(history)


def test_whole_path_is_execution():
    """The best path of one cycle, played open loop in the world it was planned for, reproduces the tree's states."""
    env = make("AirToWater", num_obstacles=0)
    observation, _ = env.reset(seed=0)
    _, (memory,) = CLRRT.for_env(env).predict(observation)
    nodes = memory.nodes[: memory.size]
    ends = np.flatnonzero(nodes["goal"])
    path = [int(ends[np.argmin(nodes["time"][ends])])]
    while path[-1] > 0:
        path.append(int(nodes["parent"][path[-1]]))
    for i in path[-2::-1]:
        observation, _, terminated, _, info = env.step(nodes["reference"][i].astype(np.float32))
        np.testing.assert_array_equal(observation["state"], nodes["state"][i])
        np.testing.assert_array_equal(observation["integral"], nodes["integral"][i])
    assert terminated
    assert info["outcome"] is Outcome.GOAL


def test_same_seed_same_references():
    env = make("AirToWater", num_obstacles=40)  # an easy world has one best path, whatever is drawn
    first, _ = fly(env, CLRRT.for_env(env, seed=7), seed=1)
    again, _ = fly(env, CLRRT.for_env(env, seed=7), seed=1)
    other, _ = fly(env, CLRRT.for_env(env, seed=8), seed=1)
    np.testing.assert_array_equal([c.action for c in first], [c.action for c in again])
    assert not np.array_equal([c.action for c in first], [c.action for c in other])


def test_a_hundred_plans_repeat():
    env = make("WaterToAir", num_obstacles=40)
    planner, twin = CLRRT.for_env(env), CLRRT.for_env(env)
    for seed in range(100):
        observation, _ = env.reset(seed=seed)
        first, (memory,) = planner.predict(observation)
        again, (other,) = twin.predict(observation)
        np.testing.assert_array_equal(first, again)
        np.testing.assert_array_equal(memory.nodes[: memory.size], other.nodes[: other.size])


def test_predict_never_changes_its_state():
    env = make("AirToWater")
    planner = CLRRT.for_env(env)
    observation, _ = env.reset(seed=2)
    _, state = planner.predict(observation)
    frozen = pickle.dumps(state)
    first, _ = planner.predict(observation, state)
    second, _ = planner.predict(observation, pickle.loads(frozen))
    np.testing.assert_array_equal(first, second)
    assert pickle.dumps(state) == frozen


def test_batch_equals_single():
    envs = [make("Mission") for _ in range(3)]
    planner = CLRRT.for_env(envs[0])
    observations = [env.reset(seed=k)[0] for k, env in enumerate(envs)]
    batch = {key: np.stack([o[key] for o in observations]) for key in observations[0]}
    together, state = planner.predict(batch, None, np.ones(3, bool))
    assert together.shape == (3, 4)
    assert together.dtype == np.float32
    for k, observation in enumerate(observations):
        np.testing.assert_array_equal(planner.predict(observation)[0], together[k])
    assert len(state) == 3


@pytest.mark.parametrize("vehicle", ["paper", "hydrone-agile"])
@pytest.mark.parametrize("mission", ["AirToWater", "WaterToAir"])
def test_stop_invariant(mission, vehicle):
    """Whatever happens to the planner, the references verified last bring the vehicle to rest without contact."""
    env = make(mission, num_obstacles=40, obstacle_radius=(0.8, 1.5), vehicle=vehicle)
    history, _ = fly(env, CLRRT.for_env(env), seed=5, snapshots=True)
    for cycle in history[::2]:
        env.unwrapped.set_state(cycle.snapshot)
        _, _, done, _, info = env.step(cycle.action)
        backup = cycle.memory.backup[: cycle.memory.stop]
        for reference in [*backup, *([backup[-1]] * 10)]:
            if done:
                break
            observation, _, done, _, info = env.step(reference)
        assert info["outcome"] in (Outcome.RUNNING, Outcome.GOAL)
        if not done:
            assert np.linalg.norm(observation["state"][6:9]) < 0.1


def ring(x, y, z, around, radius, count=24):
    """Spheres on a sphere around a point: a cage."""
    k = np.arange(count) + 0.5
    polar, azimuth = np.arccos(1.0 - 2.0 * k / count), np.pi * (1.0 + 5.0**0.5) * k
    return [
        (x + around * np.sin(p) * np.cos(a), y + around * np.sin(p) * np.sin(a), z + around * np.cos(p), radius)
        for p, a in zip(polar, azimuth, strict=True)
    ]


HARD = {
    "goal walled in": ((-6, 0, 4), (6.0, 0.0, 4.0), ring(6.0, 0.0, 4.0, 2.2, 0.75), False),
    "start in a pocket": (
        (-6, 0, 4),
        (6.0, 0.0, 4.0),
        [sphere for sphere in ring(-6.0, 0.0, 4.0, 2.6, 0.8, 24) if sphere[0] > -7.6],
        True,
    ),
    "column blocked above the goal": ((-6, 0, 4), (6.0, 0.0, -3.0), [(6.0, 0.0, 0.5, 1.5)], True),
    "obstacle at the exit of the crossing": ((-6, 0, 4), (6.0, 0.0, -4.0), [(6.0, 0.0, -1.6, 0.8)], True),
    "obstacle straight ahead": ((-6, 0, 4), (6.0, 0.0, 4.0), [(0.0, 0.0, 4.0, 1.5)], True),
    "wall under water": ((-8, 0, -3), (8.0, 0.0, 5.0), [(-5.5, y, -3.0, 1.3) for y in range(-10, 11, 2)], True),
}


@pytest.mark.parametrize("name", HARD)
def test_hard_worlds_end_without_contact(name):
    start, goal, obstacles, solvable = HARD[name]
    env = make("Mission", num_obstacles=len(obstacles), time_limit=60.0)
    _, info = fly(env, CLRRT.for_env(env), scenario=empty_scenario(start, goal, obstacles))
    assert info["clearance"] > 0.0
    assert info["outcome"] is (Outcome.GOAL if solvable else Outcome.TIMEOUT)


def test_leaves_a_gap_hardly_wider_than_the_vehicle():
    """World 670 of the dense Experiment 1: it stops 3 cm from a sphere, where every usual step is blocked."""
    env = make("AirToWater", num_obstacles=40)
    scenario = load_scenario(Path(__file__).with_name("narrow_gap.json"))
    _, info = fly(env, CLRRT.for_env(env), scenario=scenario)
    assert info["outcome"] is Outcome.GOAL
    assert info["clearance"] > 0.0


@pytest.mark.parametrize("objective", ["energy", "length", "paper"])
def test_other_objectives_arrive_too(objective):
    env = make("AirToWater")
    planner = CLRRT.for_env(env, objective=objective)
    for seed in range(4):
        history, info = fly(env, planner, seed=seed)
        assert info["outcome"] is Outcome.GOAL
        assert info["clearance"] > 0.0
    assert history[-1].memory.report.arrives


def test_energy_objective_counts_what_the_environment_counts():
    """The cost of the path sent is the energy that flying it takes: known map, one plan."""
    env = make("AirToWater", num_obstacles=0)
    planner = CLRRT.for_env(env, objective="energy")
    observation, _ = env.reset(seed=0)
    _, (memory,) = planner.predict(observation)
    assert memory.report.arrives
    state, done = None, False
    while not done:
        action, state = planner.predict(observation, state)
        observation, _, done, _, info = env.step(action)
    assert info["energy"] <= memory.report.cost * (1.0 + 1e-12)  # later cycles may only find something cheaper


@pytest.mark.parametrize("mission", ["AirToWater", "WaterToAir"])
def test_latency(mission):
    """Each reference was decided a period before it is sent, from what was sensed then, and that is still safe."""
    env = make(mission)
    planner = CLRRT.for_env(env, latency=True)
    assert planner.cruise_speed < CLRRT.for_env(env).cruise_speed
    for seed in range(6):
        history, info = fly(env, planner, seed=seed)
        assert info["outcome"] is Outcome.GOAL
        assert info["clearance"] > 0.0
        for before, after in itertools.pairwise(history):
            np.testing.assert_array_equal(before.memory.pending.astype(np.float32), after.action)


def test_cruise_speed_follows_from_the_sensor():
    """A period of travel and the measured stop fit into what is sensed; a shorter sensor means slower flight."""
    speeds = [CLRRT(Simulation(HYDRONE, World(sensor_range=r))).cruise_speed for r in (1.5, 2.0, 3.0)]
    assert speeds[0] < speeds[1] < speeds[2] == pytest.approx(HYDRONE.air_gains.speed_limit)
    stop = stop_distances(Simulation(HYDRONE, World()), np.array([speeds[1]]), air=True)[0]
    assert 0.5 * speeds[1] + stop <= 2.0 - HYDRONE.radius


def test_report():
    env = make("AirToWater")
    history, _ = fly(env, CLRRT.for_env(env), seed=0)
    for cycle in history:
        report = cycle.memory.report
        assert report.nodes >= report.depth
        assert (report.depth == 0) == (report.waiting > 0)
        assert report.seconds > 0.0
    assert history[0].memory.report.edges > 20


def test_time_budget_is_kept(monkeypatch):
    """By a clock that ticks 4 ms with every look at it: the tree grows until the budget is spent, and no longer."""
    looks = itertools.count()
    monkeypatch.setattr("planners.cl_rrt.policy.time", SimpleNamespace(perf_counter=lambda: 0.004 * next(looks)))
    env = make("AirToWater", num_obstacles=40)
    observation, _ = env.reset(seed=0)
    nodes = []
    for budget in (0.01, 0.1):
        before = next(looks)
        _, (memory,) = CLRRT.for_env(env, time_budget=budget).predict(observation)
        nodes.append(memory.report.nodes)
        spent = 0.004 * (next(looks) - before - 2)  # the last look is the report's
        assert budget < spent <= budget + 0.009
    assert nodes[0] < nodes[1]


def test_evaluate_policy_flies_it():
    env = DummyVecEnv([lambda: make("Mission")] * 3)
    env.seed(0)
    returns, lengths = evaluate_policy(CLRRT.for_env(env), env, n_eval_episodes=3, return_episode_rewards=True)
    assert min(returns) > 0.0
    assert max(lengths) < 240


@pytest.mark.parametrize(("mission", "law"), [("AirToWater", EXPERIMENT_1), ("WaterToAir", EXPERIMENT_2)])
def test_tree_keeps_the_rules_of_algorithm_1(mission, law):
    world = World()
    scenario = generate(law, world, HYDRONE.radius, np.random.default_rng(0))
    simulation = Simulation(HYDRONE, world)
    planner = CLRRT(simulation, iterations=300)
    observation, _ = make(mission).reset(seed=0, options={"scenario": scenario})
    observation = {**observation, "obstacles": scenario.obstacles}
    _, (memory,) = planner.predict(observation)
    nodes = memory.nodes[: memory.size]
    assert len(nodes) > 100
    assert (nodes["parent"][1:] < np.arange(1, len(nodes))).all()
    opened = nodes["kind"] == 0
    assert (np.abs(nodes["state"][opened, 2]) > world.zone).all()
    for i in range(1, len(nodes)):
        parent, node = nodes[nodes["parent"][i]], nodes[i]
        row = row_at(parent["state"], scenario.goal)
        row["integral"], row["reference"] = parent["integral"], parent["reference"]
        _, states, moving, row = trajectory(simulation, row, node["reference"][None], scenario.obstacles)
        np.testing.assert_array_equal(states[-1], node["state"])
        assert row["clearance"][0] > 0.0
        in_zone = np.abs(states[:, 2]) < world.zone
        assert np.all(np.linalg.norm(states[in_zone, 6:8], axis=1) <= 0.1)
        if not in_zone.any():
            assert np.ptp(np.diff(moving[:, :3], axis=0), axis=0).max() < 1e-9  # the reference is linear


def test_view_of_a_tree():
    world = World()
    scenario = generate(EXPERIMENT_2, world, HYDRONE.radius, np.random.default_rng(4))
    env = make("WaterToAir")
    observation, _ = env.reset(options={"scenario": scenario})
    view = CLRRT.for_env(env).grow_tree({**observation, "obstacles": scenario.obstacles}, 400)
    assert view.edges.shape[1:] == (2, 3)
    assert len(view.edges) == len(view.air) == len(view.time)
    assert 0 < view.air.sum() < len(view.air)
    assert len(view.path) > 0
    np.testing.assert_array_equal(view.edges[view.path][1:, 0], view.edges[view.path][:-1, 1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"iterations": 0}, "iterations must be a whole number of at least 1, got 0"),
        ({"iterations": 2.5}, "iterations must be a whole number of at least 1, got 2.5"),
        ({"time_budget": -1.0}, r"time_budget must be positive \(s\), got -1.0"),
        ({"time_budget": float("nan")}, r"time_budget must be positive \(s\), got nan"),
        ({"objective": "speed"}, "objective must be one of 'time', 'energy', 'length', 'paper' or how many joules"),
        ({"objective": -1.0}, r"\(W, finite, not negative\), got -1.0"),
        ({"objective": True}, r"\(W, finite, not negative\), got True"),
        ({"latency": 1}, "latency must be True or False, got 1"),
        ({"seed": -3}, "seed must be a whole number of at least 0, got -3"),
    ],
)
def test_bad_budget(options, message):
    with pytest.raises(ValueError, match=message):
        CLRRT(Simulation(HYDRONE, World()), **options)


def test_bad_settings():
    with pytest.raises(ValueError, match=r"CLRRTSettings.margin must be a number that is not negative, got -1"):
        CLRRTSettings(margin=-1)
    with pytest.raises(ValueError, match=r"goal_bias \+ column_bias must not exceed 1, got 0.9 \+ 0.35"):
        CLRRTSettings(goal_bias=0.9)
    with pytest.raises(ValueError, match="max_nodes must be a whole number of at least 100, got 7"):
        CLRRTSettings(max_nodes=7)
    with pytest.raises(TypeError, match="unknown"):
        CLRRTSettings(unknown=1)
    assert dataclasses.replace(CLRRTSettings(), margin=0.2).params(1.0).margin == 0.2


def test_bad_input():
    env = make("AirToWater")
    planner = CLRRT.for_env(env)
    observation, _ = env.reset(seed=0)
    with pytest.raises(ValueError, match=r"observation\['state'\] must be finite"):
        planner.predict({**observation, "state": np.full(12, np.nan)})
    with pytest.raises(ValueError, match="observation lacks goal"):
        planner.predict({key: value for key, value in observation.items() if key != "goal"})
    with pytest.raises(ValueError, match="state holds 2 memories for 1 observations"):
        planner.predict(observation, (None, None))
    with pytest.raises(TypeError, match="for_env needs a HyDrone environment"):
        CLRRT.for_env(object())
