"""Films of flights: as many pictures as ticks, as long as the flight."""

import sys

import imageio_ffmpeg
import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from PIL import Image

from hydrone_gym.evaluation import fly
from hydrone_gym.rendering.video import frames, save_film
from planners import StraightLine
from tests.envs.missions import AIR_TO_AIR, begin

SIZE = (96, 64)


@pytest.fixture(scope="module")
def flown():
    env, _ = begin(AIR_TO_AIR, render_mode="rgb_array", render_size=SIZE)
    return fly(env, StraightLine.for_env(env), scenario=AIR_TO_AIR), env.render()


def test_pictures_are_those_of_the_environment(flown):
    flight, end = flown
    pictures = list(frames(flight, size=SIZE))
    assert len(pictures) == len(flight.trace.times)
    np.testing.assert_array_equal(pictures[-1], end)
    env, _ = begin(AIR_TO_AIR, render_mode="rgb_array", render_size=SIZE)
    np.testing.assert_array_equal(pictures[0], env.render())
    env.step(flight.references[0])
    np.testing.assert_array_equal(pictures[10], env.render())


def test_every_so_many_ticks_up_to_the_end(flown):
    flight, end = flown
    pictures = list(frames(flight, size=SIZE, every=4, camera="chase"))
    assert len(pictures) == -(-len(flight.trace.times) // 4)
    np.testing.assert_array_equal(list(frames(flight, size=SIZE, every=4))[-1], end)
    with pytest.raises(ValueError, match="every must be a whole number of ticks of at least 1, got 0"):
        frames(flight, every=0)


def test_a_film_lasts_as_long_as_the_flight(flown, tmp_path):
    flight, _ = flown
    path = tmp_path / "flight.mp4"
    save_film(frames(flight, size=SIZE, every=2), path, fps=10.0)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    assert count == len(range(len(flight.trace.times), 0, -2))
    assert seconds == pytest.approx(flight.time, abs=0.2)
    meta = next(imageio_ffmpeg.read_frames(str(path)))
    assert tuple(meta["size"]) == SIZE


def test_a_gif_shows_every_picture_in_its_colours_and_rests_at_the_end(flown, tmp_path):
    flight, end = flown
    path = tmp_path / "flight.gif"
    save_film(frames(flight, size=SIZE, every=4), path, fps=12.5)
    with Image.open(path) as gif:
        assert (gif.size, gif.info["loop"]) == (SIZE, 0)
        times = []
        for k in range(gif.n_frames):
            gif.seek(k)
            times.append(gif.info["duration"])
        assert gif.n_frames == len(range(len(flight.trace.times), 0, -4))
        assert times == [80] * (gif.n_frames - 1) + [2000]
        last = np.asarray(gif.convert("RGB"), float)
    assert np.abs(last - end).mean() < 6.0  # of 255
    orange = (end[..., 0] > 180) & (end[..., 2] < 60)  # the path and the front rotor
    assert orange.sum() > 20
    assert np.abs(last - end)[orange].mean() < 20.0


def test_bad_films(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError, match="the folder of the film does not exist"):
        save_film([np.zeros((64, 64, 3), np.uint8)], tmp_path / "none" / "film.mp4")
    with pytest.raises(ValueError, match="at least one picture, got none"):
        save_film([], tmp_path / "film.mp4")
    with pytest.raises(ValueError, match="at least one picture, got none"):
        save_film([], tmp_path / "film.gif")
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(DependencyNotInstalled, match=r"hydrone-gym\[render\]"):
        save_film([], tmp_path / "film.mp4")
