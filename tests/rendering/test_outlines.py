"""Outlines of obstacles against points sampled on them."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from hydrone_gym.rendering.camera import axes
from hydrone_gym.rendering.scene3d import outlines

CAMERA = axes(-60.0, 20.0)


def area(polygon):
    x, y = (polygon @ CAMERA[:2].T).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def test_camera_axes_are_orthonormal_and_right_handed():
    np.testing.assert_allclose(CAMERA @ CAMERA.T, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(np.cross(CAMERA[0], CAMERA[1]), CAMERA[2], atol=1e-15)
    np.testing.assert_allclose(axes(-90.0, 90.0), np.eye(3), atol=1e-15)  # a map: x right, y up


def test_outline_is_a_circle_and_caps_lie_inside():
    centre = np.array([1.0, 2.0, 5.0])
    outline, *caps = outlines(np.append(centre, 1.5), CAMERA, True)
    seen = (outline - centre) @ CAMERA[:2].T
    np.testing.assert_allclose(np.linalg.norm(seen, axis=1), 1.5, atol=1e-6)
    assert area(outline) == pytest.approx(np.pi * 1.5**2, rel=0.01)
    assert len(caps) >= 5
    for outer, inner in zip([outline, *caps[:-1]], caps, strict=True):
        assert 0.0 < area(inner) < area(outer)
        assert np.linalg.norm((inner - centre) @ CAMERA[:2].T, axis=1).max() <= 1.5 + 1e-9


@pytest.mark.parametrize("height", [-0.7, -0.2, 0.0, 0.4, 0.9])
def test_what_rises_above_the_water_is_exact(height):
    centre = np.array([3.0, -4.0, height])
    rng = np.random.default_rng(0)
    points = rng.normal(size=(40000, 3))
    points = centre + points / np.linalg.norm(points, axis=1, keepdims=True)
    dry = points[points[:, 2] >= 0.0]
    sampled = ConvexHull(dry @ CAMERA[:2].T).volume
    assert area(outlines(np.append(centre, 1.0), CAMERA, True)[0]) == pytest.approx(sampled, rel=0.02)


def test_nothing_of_a_sunken_sphere_rises_above_the_water():
    assert outlines(np.array([0.0, 0.0, -3.0, 1.0]), CAMERA, True) == []
    assert len(outlines(np.array([0.0, 0.0, -3.0, 1.0]), CAMERA, False)) > 1
