"""Where pictures are taken from: the whole box in view, the vehicle in the middle of the chase."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hydrone_gym.rendering.camera import chase, outlines, overview

CORNERS = np.array([[x, y, z] for x in (-10.0, 10.0) for y in (-10.0, 10.0) for z in (-5.0, 10.0)])


@given(
    st.floats(-360.0, 360.0), st.floats(1.0, 70.0), st.sampled_from([(640, 480), (320, 240), (200, 600), (1000, 64)])
)
def test_overview_shows_all_corners_and_wastes_nothing(azimuth, elevation, size):
    pose = overview(CORNERS, azimuth, elevation, size[0] / size[1])
    places = pose.project(CORNERS, size)
    assert ((places >= 0.0) & (places <= size)).all()
    reach = (places.max(axis=0) - places.min(axis=0)) / size
    assert reach.max() == pytest.approx(0.97, abs=1e-6)
    np.testing.assert_allclose([pose.right @ pose.up, pose.right @ pose.forward], 0.0, atol=1e-12)
    assert np.linalg.det([pose.right, pose.up, -pose.forward]) == pytest.approx(1.0), "not mirrored"


def test_project_puts_right_and_up_where_they_belong():
    pose = overview(CORNERS, 0.0, 20.0, 4.0 / 3.0)  # from +x, so that +y is to the right
    middle, right, up = pose.project(np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), (640, 480))
    assert right[0] > middle[0] + 10.0
    assert right[1] == pytest.approx(middle[1])
    assert up[1] < middle[1] - 10.0


@pytest.mark.parametrize("goal", [(9.0, 9.0, -3.0), (0.0, 0.0, 8.0), (-9.0, 0.0, 0.0)])
@pytest.mark.parametrize("step", [(0.1, 0.0, 0.0), (0.0, 0.0, 0.05), (0.0, 0.0, 0.0)])
def test_chase_keeps_the_vehicle_near_the_middle(goal, step):
    path = np.arange(80)[:, None] * np.array(step)
    pose = chase(path, np.array(goal))
    (column, row) = pose.project(path[-1:], (640, 480))[0]
    assert column == pytest.approx(320.0, abs=1.0)
    assert 180.0 < row < 340.0
    assert pose.eye[2] > path[-1, 2]


def test_chase_stands_behind_the_way_flown():
    path = np.column_stack((np.zeros(100), np.linspace(0.0, 10.0, 100), np.full(100, 3.0)))
    pose = chase(path, np.array([9.0, 0.0, 3.0]))
    assert pose.forward[1] > 0.8 * np.hypot(*pose.forward[:2])
    assert pose.eye[1] < path[-1, 1] - 3.0


@given(st.integers(0, 2**32 - 1))
def test_outlines_hold_every_point_of_a_shape(seed):
    rng = np.random.default_rng(seed)
    pose = overview(CORNERS, rng.uniform(0.0, 360.0), 20.0, 4.0 / 3.0)
    pose = pose._replace(eye=pose.eye + rng.uniform(0.0, 60.0) * pose.forward)  # inside the box too
    ends, radius = rng.uniform(-10.0, 10.0, (2, 3)), rng.uniform(0.1, 2.0)
    first_column, first_row, last_column, last_row = outlines(pose, ends[None], np.array([radius]), (640, 480), 16)[0]
    directions = rng.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    share = rng.random((300, 1))
    points = ends[0] + share * (ends[1] - ends[0]) + radius * directions
    points = points[(points - pose.eye) @ pose.forward > 1e-6]
    tiles = np.floor(pose.project(points, (640, 480)) / 16)
    visible = tiles[((tiles >= 0) & (tiles < (40, 30))).all(axis=1)]
    assert (visible >= (first_column, first_row)).all()
    assert (visible < (last_column, last_row)).all()
