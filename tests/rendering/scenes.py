"""Small missions to be drawn, and where things are in their pictures."""

import numpy as np

from hydrone_gym import HYDRONE, Outcome, World
from hydrone_gym.rendering.camera import View
from hydrone_gym.rendering.frame import Painter
from hydrone_gym.rendering.track import Moment

SIZE = (320, 240)
WORLD = World()


def painter(camera="overview", size=SIZE):
    return Painter(View(size=size, camera=camera), WORLD, HYDRONE)


def moment(position=(0.0, -6.0, 5.0), attitude=(0.0, 0.0, 0.0), *, goal=(8.0, -6.0, 5.0), obstacles=(), detected=True):
    """A vehicle at rest (m, rad), its reference at the goal, among obstacles (x, y, z, r), all detected or none."""
    spheres = np.array(obstacles, dtype=np.float64).reshape(-1, 4)
    state = np.concatenate((position, attitude, np.zeros(6)))
    tick = np.concatenate((state, goal, [attitude[2]]))
    known = np.full(len(spheres), detected)
    return Moment(tick[None], np.array(goal), spheres, known, 1.0, Outcome.RUNNING)


def paint(shown, camera="overview", size=SIZE):
    return painter(camera, size).paint(shown)


def colour_at(shown, point, camera="overview", size=SIZE):
    """Colour (3,) 0 to 255 of the picture of a moment where a point (m) would appear."""
    brush = painter(camera, size)
    column, row = np.floor(brush.pose(shown).project(np.array([point]), size)[0]).astype(int)
    return brush.paint(shown)[row, column].astype(float)


def towards_eye(shown, point, distance, camera="overview"):
    """A point (m) so far from another, nearer to the camera."""
    eye = painter(camera).pose(shown).eye
    way = eye - np.array(point)
    return np.array(point) + distance * way / np.linalg.norm(way)
