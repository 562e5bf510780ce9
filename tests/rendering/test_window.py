"""The window: every tick, in real time, until somebody closes it; and what happens where there can be none."""

import copy
import pickle
import sys
import time

import gymnasium as gym
import numpy as np
import pygame
import pytest
from gymnasium.error import DependencyNotInstalled

from hydrone_gym.rendering.view import Window
from tests.envs.missions import DIVE, IDS, begin, make, same

HOVER = np.array([*DIVE.start[:3], 0.0])


@pytest.fixture
def shown(monkeypatch):
    """Pictures shown; the clock does not wait."""
    pictures = []
    show = Window.show
    monkeypatch.setattr(Window, "show", lambda self, image: (pictures.append(image), show(self, image)))
    monkeypatch.setattr(time, "sleep", lambda seconds: None)
    monkeypatch.setattr(time, "monotonic", lambda: 0.0)
    return pictures


def test_every_tick_is_shown_once(shown):
    env, _ = begin(DIVE, render_mode="human", render_size=(64, 64))
    assert len(shown) == 1
    env.step(HOVER)
    assert len(shown) == 11
    assert env.render() is None
    assert len(shown) == 12
    twin, _ = begin(DIVE, render_mode="rgb_array", render_size=(64, 64))
    np.testing.assert_array_equal(shown[0], twin.render())
    twin.step(HOVER)
    np.testing.assert_array_equal(shown[10], twin.render())
    np.testing.assert_array_equal(shown[11], twin.render())
    surface = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(surface, shown[-1])
    env.reset()
    assert len(shown) == 13
    env.set_state(twin.get_state())
    env.step(HOVER)
    assert len(shown) == 23
    env.close()
    assert pygame.display.get_surface() is None


def test_a_step_lasts_as_long_as_its_period():
    env, _ = begin(DIVE, render_mode="human", render_size=(64, 64), period=0.1)
    began = time.monotonic()
    for _ in range(3):
        env.step(HOVER)
    assert 0.29 < time.monotonic() - began < 1.0
    env.close()


def test_a_slow_machine_skips_pictures_but_not_the_last(shown, monkeypatch):
    clock = iter(np.arange(0.0, 1e3, 0.2))
    env, _ = begin(DIVE, render_mode="human", render_size=(64, 64))
    monkeypatch.setattr(time, "monotonic", lambda: float(next(clock)))
    env.step(HOVER)
    assert 2 <= len(shown) < 8
    twin, _ = begin(DIVE, render_mode="rgb_array", render_size=(64, 64))
    twin.step(HOVER)
    np.testing.assert_array_equal(shown[-1], twin.render())
    env.close()


def test_closing_the_window_leaves_the_episode_alone(shown):
    env, _ = begin(DIVE, render_mode="human", render_size=(64, 64))
    plain, _ = begin(DIVE)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    results = [each.step(HOVER) for each in (env, plain)]
    assert same(*results)
    assert pygame.display.get_surface() is None
    count = len(shown)
    assert same(env.step(HOVER), plain.step(HOVER))
    env.reset()
    assert env.render() is None
    assert len(shown) == count
    env.close()
    env.close()


def test_environments_share_the_window_and_the_last_one_closes_it(shown):
    first, second = (begin(DIVE, render_mode="human", render_size=(64, 64))[0] for _ in range(2))
    first.close()
    assert pygame.display.get_surface() is not None
    second.step(HOVER)
    second.close()
    assert pygame.display.get_surface() is None


@pytest.mark.parametrize(
    "how", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))], ids=["deepcopy", "pickle"]
)
def test_copies_have_no_window(how, shown):
    env, _ = begin(DIVE, render_mode="human", render_size=(64, 64))
    count = len(shown)
    twin = how(env)
    twin.step(HOVER)
    assert len(shown) == count
    env.step(HOVER)
    assert len(shown) > count
    env.close()


def test_without_pygame_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DependencyNotInstalled, match=r"hydrone-gym\[render\]"):
        make(render_mode="human")
    make(render_mode="rgb_array")


def test_without_a_display_it_warns_and_goes_on(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "none such")
    with pytest.warns(UserWarning, match="shows nothing"):
        env, _ = begin(DIVE, render_mode="human", render_size=(64, 64))
    plain, _ = begin(DIVE)
    assert same(env.step(HOVER), plain.step(HOVER))


def test_gymnasium_makes_it_without_a_wrapper():
    env = gym.make(IDS[0], render_mode="human", render_size=(64, 64))
    assert env.unwrapped.render_mode == "human"
    assert not isinstance(env, gym.wrappers.HumanRendering)
    env.close()
