"""What pictures show: the waterline, depth order, water, the vehicle's attitude, path, marks and words."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hydrone_gym import HYDRONE, Outcome
from hydrone_gym.rendering import raycast
from tests.rendering.scenes import SIZE, colour_at, moment, paint, painter, towards_eye


def blueness(colour):
    return colour[2] - colour[0]


def test_an_obstacle_is_cut_by_the_surface():
    shown = moment(obstacles=[(0.0, 0.0, 0.0, 2.0)])
    out = painter().pose(shown).eye * [1.0, 1.0, 0.0]
    out /= np.linalg.norm(out)
    above, below, line = (2.0 * np.cos(a) * out + [0.0, 0.0, 2.0 * np.sin(a)] for a in (0.5, -0.5, 0.0))
    dry, wet = colour_at(shown, above), colour_at(shown, below)
    assert abs(blueness(dry)) < 8.0, "in the air it is grey"
    assert blueness(wet) > 25.0, "under water it is seen through water"
    assert colour_at(shown, line, size=(640, 480)).min() > 120.0, "and the waterline is bright"


def test_deeper_is_bluer_and_darker():
    near, deep = (colour_at(moment(obstacles=[(0.0, 0.0, z, 0.9)]), (0.0, 0.0, z)) for z in (-1.2, -4.0))
    assert blueness(deep) > blueness(near) + 15.0
    dry = colour_at(moment(obstacles=[(0.0, 0.0, 1.2, 0.9)]), (0.0, 0.0, 1.2))
    assert abs(blueness(dry)) < 8.0


@pytest.mark.parametrize("z", [5.0, -3.0])
def test_a_sphere_behind_another_is_hidden(z):
    front = (0.0, 3.0, z, 1.0)
    behind = towards_eye(moment(), front[:3], -2.5)
    alone, both = (paint(moment(obstacles=spheres)) for spheres in ([front], [front, (*behind, 0.7)]))
    np.testing.assert_array_equal(alone, both)
    aside = towards_eye(moment(), front[:3], 2.5)
    assert (paint(moment(obstacles=[front, (*aside, 0.7)])) != alone).any()


def test_order_of_obstacles_does_not_matter():
    spheres = [(0.0, 3.0, 5.0, 1.0), (0.5, 3.4, 5.2, 1.1), (-0.4, 2.5, 0.1, 1.4), (1.0, 1.0, -2.0, 1.0)]
    np.testing.assert_array_equal(paint(moment(obstacles=spheres)), paint(moment(obstacles=spheres[::-1])))


def test_a_sphere_in_front_hides_the_vehicle():
    hider = (*towards_eye(moment(), (0.0, -6.0, 5.0), 4.0), 2.0)
    tilted = (0.3, 0.2, 1.0)
    np.testing.assert_array_equal(paint(moment(obstacles=[hider])), paint(moment(attitude=tilted, obstacles=[hider])))
    assert (paint(moment()) != paint(moment(attitude=tilted))).any()
    seen = moment(obstacles=[hider], detected=False)
    through = moment(attitude=tilted, obstacles=[hider], detected=False)
    assert (paint(seen) != paint(through)).any(), "an obstacle not yet detected is see-through"


def test_the_vehicle_hides_what_is_behind_it_but_never_itself_from_the_chasing_camera():
    shown = moment()
    small = (*towards_eye(shown, (0.0, -6.0, 5.0), -3.0, "chase"), 0.05)
    np.testing.assert_array_equal(paint(shown, "chase"), paint(shown._replace(**hidden_by(small)), "chase"))
    blocker = (*towards_eye(shown, (0.0, -6.0, 5.0), 2.0, "chase"), 0.8)
    level, tilted = (moment(attitude=a, obstacles=[blocker]) for a in ((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))
    assert (paint(level, "chase") != paint(tilted, "chase")).any(), "glass, so that the vehicle is not lost"


def hidden_by(sphere):
    return {"obstacles": np.array([sphere]), "detected": np.array([True])}


@pytest.mark.parametrize(
    "attitude", [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (-0.4, 0.0, 0.0), (0.0, -0.4, 0.0), (0.2, 0.1, 2.5)]
)
@pytest.mark.parametrize("z", [5.0, -2.5])
def test_rotors_are_where_the_attitude_puts_them(attitude, z):
    """The front rotor is orange, the others white, each where R = Rz(psi) Rx(phi) Ry(theta) turns its arm."""
    size = (640, 480)
    shown = moment((0.0, -6.0, z), attitude)
    brush = painter("chase", size)
    turn = Rotation.from_euler("ZXY", [attitude[2], attitude[0], attitude[1]]).as_matrix()
    # a point of each disc between its hub and its rim
    on_discs = (
        HYDRONE.arm * np.array([(1.3, 0.1, 0.12), (0.1, 1.3, 0.12), (-1.3, 0.1, 0.12), (0.1, -1.3, 0.12)]) @ turn.T
    )
    places = np.floor(brush.pose(shown).project(shown.ticks[0, :3] + on_discs, size)).astype(int)
    image = brush.paint(shown).astype(float)
    reds = [image[row, column, 0] - image[row, column, 2] for column, row in places]
    others = [image[row, column].mean() for column, row in places[1:]]
    assert reds[0] > max(reds[1:]) + 40.0
    assert min(others) > 120.0


def test_rolling_lifts_the_left_rotor():
    size = (640, 480)
    rows = {}
    for roll in (-0.3, 0.3):
        image = paint(moment(attitude=(roll, 0.0, 0.0)), "chase", size)[220:330, 220:420]
        row, column = np.nonzero(image.min(axis=2) > 170)  # white discs
        rows[roll] = row[column < 80].mean() - row[column > 120].mean()
    assert rows[0.3] < -8.0 < 8.0 < rows[-0.3]


def test_path_and_reference_are_drawn_where_they_are():
    start = moment((0.0, -6.0, 5.0))
    xs = np.linspace(0.0, 5.0, 60)
    ticks = np.repeat(start.ticks, 60, axis=0)
    ticks[:, 0] = xs
    ticks[-1, 12:15] = (7.0, -3.0, 4.0)
    shown = start._replace(ticks=ticks)
    size = (640, 480)
    for x in (1.0, 2.0, 3.0):
        red, green, blue = colour_at(shown, (x, -6.0, 5.0), size=size)
        assert red > green > blue
        assert red - blue > 80.0
    assert colour_at(shown, (7.0, -3.0, 4.0), size=size).max() < 110.0, "the middle of the reference is black"
    assert blueness(colour_at(shown, shown.goal, size=size)) < 40.0


def test_water_is_translucent():
    """What lies on the floor is seen from above, through the surface."""
    without, ball = (paint(moment(obstacles=spheres)) for spheres in ([], [(0.0, 0.0, -4.0, 1.0)]))
    column, row = np.floor(painter().pose(moment()).project(np.array([[0.0, 0.0, -4.0]]), SIZE)[0]).astype(int)
    assert np.abs(without[row, column].astype(int) - ball[row, column]).max() > 25


@pytest.mark.parametrize("camera", ["overview", "chase"])
def test_what_was_drawn_before_leaves_no_trace(camera):
    """A camera that stands still keeps the picture without shapes; the others must come out as if it did not."""
    brush = painter(camera)
    balls = [(0.0, 3.0, 0.2, 1.0), (3.0, -6.0, -2.0, 1.5), (-5.0, 0.0, 9.0, 1.2)]
    level = moment(obstacles=balls)
    tilted, aside = moment(attitude=(0.2, 0.3, 1.0), obstacles=balls, detected=False), moment(goal=(0.0, 8.0, -3.0))
    several = [level, level, tilted, moment(), aside, aside, level]
    for shown in several:
        np.testing.assert_array_equal(brush.paint(shown), paint(shown, camera))


def test_equal_moments_give_equal_bytes_and_new_arrays():
    shown = moment(attitude=(0.1, -0.1, 1.0), obstacles=[(0.0, 3.0, 0.2, 1.0)])
    brush = painter()
    first, second = brush.paint(shown), brush.paint(shown)
    assert first.tobytes() == second.tobytes() == paint(shown).tobytes()
    assert not np.shares_memory(first, second)
    assert first.shape == (240, 320, 3)
    assert first.dtype == np.uint8


@pytest.mark.parametrize("camera", ["overview", "chase"])
def test_looking_only_in_the_tiles_of_an_outline_misses_nothing(camera, monkeypatch):
    rng = np.random.default_rng(3)
    spheres = np.column_stack((rng.uniform(-10, 10, (40, 2)), rng.uniform(-5, 10, 40), rng.uniform(0.5, 1.8, 40)))
    shown = moment(attitude=(0.2, 0.1, 0.5), obstacles=spheres)._replace(detected=rng.random(40) < 0.5)
    image = paint(shown, camera)
    everywhere = np.array([0, 0, -(-SIZE[0] // raycast.TILE), -(-SIZE[1] // raycast.TILE)])
    monkeypatch.setattr(
        "hydrone_gym.rendering.raycast.outlines", lambda pose, ends, *_: np.tile(everywhere, (len(ends), 1))
    )
    np.testing.assert_array_equal(paint(shown, camera), image)


def test_words():
    heights = {5.0: "in the air", -0.3: "crossing", -2.0: "under water"}
    for z, word in heights.items():
        assert moment((0.0, -6.0, z))._replace(time=12.34).words(0.8) == ("12.3 s", word)
    assert len({moment()._replace(outcome=outcome).words(0.8) for outcome in Outcome}) == len(Outcome)
    running, ended = moment(), moment()._replace(outcome=Outcome.GOAL)
    changed = np.nonzero((paint(running) != paint(ended)).any(axis=2))
    assert changed[0].min() > 200
    assert changed[1].max() < 200
