"""`render_mode` of the environments: pictures, Gymnasium's wrappers, snapshots; and pictures change no flight."""

import copy
import pickle
import warnings

import gymnasium as gym
import imageio_ffmpeg
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import HumanRendering, RecordVideo, RenderCollection
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from hydrone_gym import Scenario
from tests.envs.missions import DIVE, IDS, begin, make, same, wander

SMALL = {"render_mode": "rgb_array", "render_size": (64, 64)}


@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_checkers_have_nothing_to_say(interface):
    env = gym.make(IDS[2], interface=interface, **SMALL).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if interface == "world":
            warnings.filterwarnings("ignore", message=".*symmetric and normalized")
            warnings.filterwarnings("ignore", message="Your observation obstacles has an unconventional shape")
        check_env(env)
        check_env_sb3(env)


@pytest.mark.parametrize("camera", ["overview", "chase"])
@pytest.mark.parametrize("size", [(640, 480), (320, 240)])
def test_pictures(size, camera):
    env = make(render_mode="rgb_array", render_size=size, camera=camera)
    env.reset(seed=1)
    first = env.render()
    assert first.shape == (size[1], size[0], 3)
    assert first.dtype == np.uint8
    assert first.std() > 20.0
    again = env.render()
    assert first.tobytes() == again.tobytes()
    assert not np.shares_memory(first, again)
    env.step(np.array([0.0, 0.0, 5.0, 0.0]))
    assert (env.render() != first).any()


def test_equal_episodes_give_equal_bytes():
    pictures = []
    for _ in range(2):
        env = make("AirToWater", **SMALL)
        env.reset(seed=4)
        wander(env, 12, 5)
        pictures.append(env.render())
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize("interface", ["world", "egocentric"])
def test_pictures_leave_the_flight_alone(interface):
    plain, drawn = make(interface=interface), make(interface=interface, **SMALL)
    rng = np.random.default_rng(2)
    assert same(plain.reset(seed=3), drawn.reset(seed=3))
    for _ in range(60):
        action = rng.uniform(plain.action_space.low, plain.action_space.high).astype(np.float32)
        returned = plain.step(action)
        drawn.render()
        assert same(returned, drawn.step(action))
        if returned[2] or returned[3]:
            assert same(plain.reset(), drawn.reset())
    assert plain._core.episodes.rows.tobytes() == drawn._core.episodes.rows.tobytes()
    assert plain._core.episodes.closest.tobytes() == drawn._core.episodes.closest.tobytes()


def test_detected_obstacles_are_drawn_dark():
    scenario = Scenario(start=(-2.0, 0.0, 5.0, 0.0), goal=(4.0, 0.0, 5.0), obstacles=[(-2.0, 3.9, 5.0, 1.0)])
    dark = {}
    for sensor_range in (2.8, 3.0):
        env, _ = begin(scenario, sensor_range=sensor_range, **{**SMALL, "render_size": (320, 240)})
        picture = env.render()[:200]  # without the caption
        dark[sensor_range] = np.count_nonzero(picture.max(axis=2) < 110)
    assert dark[3.0] > dark[2.8] + 200


def test_snapshots_draw_the_same_picture_again():
    env = make(**SMALL)
    env.reset(seed=7)
    wander(env, 9, 8)
    snapshot, picture = env.get_state(), env.render()
    wander(env, 30, 9)
    assert (env.render() != picture).any()
    env.set_state(snapshot)
    np.testing.assert_array_equal(env.render(), picture)
    other = make(**SMALL)
    other.set_state(pickle.loads(pickle.dumps(snapshot)))
    np.testing.assert_array_equal(other.render(), picture)
    for each in (env, other):
        wander(each, 3, 1)
    np.testing.assert_array_equal(env.render(), other.render())


def test_snapshots_of_environments_that_draw_nothing():
    plain, drawn = make(), make(**SMALL)
    plain.reset(seed=7)
    wander(plain, 9, 8)
    drawn.set_state(plain.get_state())
    assert drawn.render().shape == (64, 64, 3)
    assert same(wander(plain, 20, 3), wander(drawn, 20, 3))
    drawn.render()
    plain.set_state(drawn.get_state())
    assert same(wander(plain, 20, 3), wander(drawn, 20, 3))


@pytest.mark.parametrize(
    "how", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["deepcopy", "pickle"]
)
def test_copies_draw_alike(how):
    env = make(**SMALL)
    env.reset(seed=7)
    wander(env, 5, 8)
    twin = how(env)
    for each in (env, twin):
        wander(each, 5, 9)
    np.testing.assert_array_equal(env.render(), twin.render())


def test_calls_out_of_order():
    env = make(**SMALL)
    with pytest.raises(ResetNeeded, match="nothing to draw before the first reset"):
        env.render()
    plain, _ = begin(DIVE)
    with pytest.warns(UserWarning, match="draws nothing without a render_mode"):
        assert plain.render() is None


def test_render_fps_plays_at_the_speed_of_the_flight():
    assert make(**SMALL).metadata["render_fps"] == 2.0
    assert make(period=0.1, **SMALL).metadata["render_fps"] == pytest.approx(10.0)
    assert make().metadata["render_fps"] == 2.0


def test_record_video(tmp_path):
    env = RecordVideo(gym.make(IDS[0], **SMALL), str(tmp_path / "films"), episode_trigger=lambda episode: True)
    env.reset(seed=1)
    for _ in range(7):
        env.step(np.array([-9.0, -9.0, 8.0, 0.0], np.float32))
    env.close()
    (film,) = tmp_path.glob("films/*.mp4")
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(film))
    assert count == 8
    assert seconds == pytest.approx(4.0, abs=0.1)


def test_human_rendering():
    pytest.importorskip("pygame")
    env = HumanRendering(gym.make(IDS[0], period=0.05, **SMALL))
    env.reset(seed=1)
    env.step(env.action_space.sample())
    assert env.window.get_size() == (64, 64)
    env.close()


def test_render_collection():
    env = RenderCollection(gym.make(IDS[0], **SMALL))
    env.reset(seed=1)
    for _ in range(3):
        env.step(env.action_space.sample())
    frames = env.render()
    assert [frame.shape for frame in frames] == [(64, 64, 3)] * 4
    assert (frames[0] != frames[-1]).any()
    listed = gym.make(IDS[0], **{**SMALL, "render_mode": "rgb_array_list"})
    listed.reset(seed=1)
    assert len(listed.render()) == 1


def follow(singles, actions, waiting, ended, mode):
    """Step single environments as a vector environment of an autoreset mode steps its rows."""
    for single, action, waited, over in zip(singles, actions, waiting, ended, strict=True):
        if mode == "NextStep" and waited:
            single.reset()
            continue
        single.step(action)
        if mode == "SameStep" and over:
            single.reset()


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_rows_draw_what_single_environments_draw(mode):
    options = {"num_obstacles": 4, "time_limit": 2.0, **SMALL}
    vector = gym.make_vec(IDS[2], 3, vectorization_mode="vector_entry_point", autoreset_mode=mode, **options)
    singles = [make(**options) for _ in range(3)]
    vector.reset(seed=4)
    for k, single in enumerate(singles):
        single.reset(seed=4 + k)
    rng, waiting, ends = np.random.default_rng(0), np.zeros(3, bool), 0
    for _ in range(24):
        actions = rng.uniform(vector.action_space.low, vector.action_space.high).astype(np.float32)
        *_, terminated, truncated, _ = vector.step(actions)
        ended = terminated | truncated
        follow(singles, actions, waiting, ended, mode)
        waiting, ends = ended, ends + ended.sum()
        for frame, single in zip(vector.render(), singles, strict=True):
            np.testing.assert_array_equal(frame, single.render())
    assert ends > 9


def test_vector_environments_have_pictures_only():
    kwargs = {"vectorization_mode": "vector_entry_point"}
    with pytest.raises(ValueError, match="render_mode must be one of None, 'rgb_array', got 'human'"):
        gym.make_vec(IDS[0], 2, render_mode="human", **kwargs)
    plain = gym.make_vec(IDS[0], 2, **kwargs)
    plain.reset(seed=0)
    with pytest.warns(UserWarning, match="draws nothing without a render_mode"):
        assert plain.render() is None
    drawn = gym.make_vec(IDS[0], 2, period=0.25, **SMALL, **kwargs)
    assert drawn.metadata["render_fps"] == 4.0
    with pytest.raises(ResetNeeded):
        drawn.render()
    sync = gym.make_vec(IDS[0], 2, vectorization_mode="sync", period=0.25, **SMALL)
    sync.reset(seed=0)
    drawn.reset(seed=0)
    assert isinstance(drawn.render(), tuple)
    assert same(tuple(sync.render()), drawn.render())
