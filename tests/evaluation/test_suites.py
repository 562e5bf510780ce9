"""Frozen suites are what they were, and a user's own are read as they were written."""

import hashlib
import json
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from benchmarks.freeze_suites import IDS, RECIPES, draw
from hydrone_gym.envs.hydrone_env import known_options
from hydrone_gym.evaluation import HELD_OUT, MISSIONS, Mission, Suite, frozen_suites, load_suite, save_suite
from hydrone_gym.evaluation.suites import FOLDER, SHA256, in_short, level_of, load_suites
from hydrone_gym.weather import Weather
from hydrone_gym.world.scenario import Scenario, save_scenario

LEVELS = [f"weather-{level}-v1" for level in range(6)]
HERE = Scenario(start=(-8.0, 0.0, 5.0, 0.3), goal=(8.0, 0.0, 5.0), obstacles=[(0.0, 0.0, 5.0, 1.0)])


@pytest.mark.parametrize("name", sorted(RECIPES))
def test_drawing_a_frozen_suite_again_gives_its_arrays(name):
    suites, drawn = load_suites(name), draw(name)
    assert [suite.name for suite in suites] == (LEVELS if name == "weather-v1" else [name])
    for suite in suites:
        for frozen, again in zip(suite.missions, drawn.missions, strict=True):
            options = {key: value for key, value in frozen.options.items() if key != "weather"}
            assert replace(frozen, options=options) == again
    assert hashlib.sha256((FOLDER / f"{name}.npz").read_bytes()).hexdigest() == SHA256[name]


def test_frozen_suites_hold_what_they_promise():
    assert frozen_suites() == sorted({*RECIPES, *LEVELS} - {"weather-v1"})
    counts = {}
    for name in frozen_suites():
        for mission in load_suite(name).missions:
            radii = np.concatenate([scenario.obstacles[:, 3] for scenario in mission.scenarios])
            low, high = (radii.min(), radii.max()) if len(radii) else (None, None)
            spheres = {len(scenario.obstacles) for scenario in mission.scenarios}
            counts[name, mission.name] = (len(mission.scenarios), spheres)
            assert len(set(mission.scenarios)) == len(mission.scenarios) or spheres == {0}
            if name.startswith("dense"):
                assert 0.8 <= low < 0.85
                assert 1.75 < high <= 1.8
            elif spheres != {0}:
                assert 0.5 <= low < 0.6
                assert 1.4 < high <= 1.5
    both = ("air-to-water", "water-to-air")
    media = ("air-air", "air-water", "water-air", "water-water")
    assert counts == {
        **{("paper-20-v1", mission): (200, {20}) for mission in both},
        **{("dense-40-v1", mission): (200, {40}) for mission in both},
        **{("missions-v1", mission): (100, {20}) for mission in media},
        **{("density-v1", f"{mission}-{n}"): (50, {n}) for mission in both for n in (0, 10, 20, 30, 40)},
        **{(level, mission): (200, {20}) for level in LEVELS for mission in (*both, "random")},
    }


def test_missions_join_the_media_they_are_named_for():
    for mission in load_suite("missions").missions:
        for scenario in mission.scenarios:
            assert "-".join(scenario.media) == mission.name
            assert np.linalg.norm(np.array(scenario.start[:3]) - scenario.goal) >= 8.0


def test_a_level_is_the_same_worlds_in_its_weather():
    still, *others = load_suites("weather")
    for level, suite in enumerate([still, *others]):
        assert (suite.name, level_of(suite.name)) == (LEVELS[level], level)
        assert {mission.options["weather"] for mission in suite.missions} == {level}
        assert [m.scenarios for m in suite.missions] == [m.scenarios for m in still.missions]
    assert [mission.env_id for mission in still.missions] == [MISSIONS[1], MISSIONS[2], MISSIONS[0]]
    assert load_suite("weather-3") == load_suite("weather-3-v1") == others[2]
    assert len({suite.fingerprint() for suite in (still, *others)}) == 6
    assert level_of("paper-20-v1") is level_of("weather-6") is level_of("weather-v1") is None
    for name in ("weather", "weather-v1"):
        with pytest.raises(ValueError, match=f"{name} stands for 6 suites, .* to weather-5.*: give one"):
            load_suite(name)


def test_all_levels_have_one_name_in_short():
    assert in_short(["paper-20-v1", *LEVELS, "mine"]) == ["paper-20-v1", "weather-v1", "mine"]
    assert in_short(LEVELS[1:]) == LEVELS[1:]


@pytest.mark.parametrize(
    ("name", "mission"), [*(("paper-20", mission) for mission in sorted(IDS)), ("weather-5", "random")]
)
def test_a_frozen_world_is_the_one_its_environment_draws(name, mission):
    suite = load_suite(name)
    (found,) = [entry for entry in suite.missions if entry.name == mission]
    recipe = RECIPES[suite.name.replace("weather-5", "weather")]
    env = gym.make(found.env_id, **found.options)
    for world in (0, 7, 199):
        env.reset(seed=recipe.seed + world)
        assert env.unwrapped.scenario == found.scenarios[world]


def test_worlds_are_clear_of_training_and_of_the_worlds_agents_are_chosen_on():
    used = [range(recipe.seed, recipe.seed + recipe.worlds) for recipe in RECIPES.values()]
    assert all(seeds.start > HELD_OUT + 1_000_000 for seeds in used)
    assert all(
        one.stop <= two.start for one, two in zip(sorted(used, key=min), sorted(used, key=min)[1:], strict=False)
    )


def test_a_changed_frozen_file_is_refused(tmp_path, monkeypatch):
    content = bytearray((FOLDER / "density-v1.npz").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "density-v1.npz").write_bytes(content)
    monkeypatch.setattr("hydrone_gym.evaluation.suites.FOLDER", tmp_path)
    with pytest.raises(ValueError, match=r"density-v1\.npz: the frozen suite is damaged, its SHA-256 is"):
        load_suite("density")


def test_a_name_without_version_is_the_newest(monkeypatch):
    for version in (2, 10):
        monkeypatch.setitem(SHA256, f"paper-20-v{version}", "")
    with pytest.raises(FileNotFoundError, match=r"paper-20-v10\.npz"):
        load_suite("paper-20")
    assert load_suite("paper-20-v1").name == "paper-20-v1"


def test_a_suite_of_ones_own_is_saved_and_loaded(tmp_path):
    suite = Suite.drawn("HydroneGym/Mission-v0", range(3, 8), {"num_obstacles": 4}, name="mine")
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=4)
    for world, scenario in enumerate(suite.missions[0].scenarios):
        env.reset(seed=3 + world)
        assert env.unwrapped.scenario == scenario
    save_suite(suite, tmp_path / "mine.npz")
    assert load_suite(tmp_path / "mine.npz") == suite
    assert load_suite(str(tmp_path / "mine.npz")).fingerprint() == suite.fingerprint()
    assert suite.first(2).missions[0].scenarios == suite.missions[0].scenarios[:2]


def test_a_folder_of_scenarios_is_a_suite(tmp_path):
    folder = tmp_path / "mine"
    for place, count in (("", 2), ("near", 1), ("far", 3)):
        (folder / place).mkdir(parents=True, exist_ok=True)
        for k in range(count):
            spheres = np.repeat(HERE.obstacles, k, axis=0) + [[0.0, 0.0, 0.1 * k, 0.0]]
            save_scenario(replace(HERE, obstacles=spheres, name=f"s{k}"), folder / place / f"{k}.json")
    suite = load_suite(folder)
    assert suite.name == "mine"
    assert [(m.name, len(m.scenarios), m.options["num_obstacles"]) for m in suite.missions] == [
        ("mine", 2, 1),
        ("far", 3, 2),
        ("near", 1, 0),
    ]
    assert [scenario.name for scenario in suite.missions[1].scenarios] == ["s0", "s1", "s2"]


def test_the_fingerprint_tells_suites_apart():
    def suite(scenario=HERE, **changes):
        described = {"name": "m", "env_id": "HydroneGym/Mission-v0", "options": {}, **changes}
        return Suite(name="s", missions=(Mission(scenarios=(scenario,), **described),))

    nudged = np.nextafter(HERE.obstacles, 9.0)
    others = [
        suite(name="n"),
        suite(env_id="HydroneGym/AirToWater-v0"),
        suite(options={"time_limit": 60.0}),
        suite(replace(HERE, goal=(8.0, 0.0, 5.5))),
        suite(replace(HERE, obstacles=nudged)),
        suite(replace(HERE, start=(-8.0, 0.0, 5.0, 0.4))),
        suite(replace(HERE, weather=Weather(wind=1.0))),
        suite(options={"weather": Weather(wind=1.0)}),
        suite(options={"weather": Weather(wind=2.0)}),
    ]
    assert len({suite().fingerprint(), *(other.fingerprint() for other in others)}) == 10
    assert suite().fingerprint() == suite().fingerprint()


def test_what_is_no_suite_is_refused(tmp_path):
    with pytest.raises(
        FileNotFoundError, match="no suite 'paper-21': frozen are dense-40-v1, density-v1, missions-v1,"
    ):
        load_suite("paper-21")
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match=r"empty: no scenario files \(\*\.json\)"):
        load_suite(tmp_path / "empty")
    (tmp_path / "text.npz").write_text("no archive")
    with pytest.raises(ValueError, match=r"text\.npz: not a suite file"):
        load_suite(tmp_path / "text.npz")
    np.savez(tmp_path / "other.npz", suite=np.array(json.dumps({"name": "x"})))
    with pytest.raises(ValueError, match=r"other\.npz: not a suite file"):
        load_suite(tmp_path / "other.npz")
    mission = Mission(name="m", env_id="HydroneGym/Mission-v0", options={}, scenarios=(HERE,))
    with pytest.raises(ValueError, match="must have at least one scenario"):
        replace(mission, scenarios=())
    with pytest.raises(ValueError, match="different names"):
        Suite(name="s", missions=(mission, mission))
    uneven = replace(mission, scenarios=(HERE, replace(HERE, obstacles=[])))
    with pytest.raises(ValueError, match="equally many spheres"):
        save_suite(Suite(name="s", missions=(uneven,)), tmp_path / "uneven.npz")
    windy = replace(mission, scenarios=(replace(HERE, weather=Weather(wind=1.0)),))
    with pytest.raises(ValueError, match="must leave weather to its options to be saved"):
        save_suite(Suite(name="s", missions=(windy,)), tmp_path / "windy.npz")
    for name in ("vehicle", "interface", "render_mode"):
        assert name in known_options()
        with pytest.raises(ValueError, match=f"must leave option {name} to the evaluation"):
            replace(mission, options={name: None})
