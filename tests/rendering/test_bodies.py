"""What pictures ask of obstacles: places, boxes, surfaces and triangles, against points sampled on spheres."""

import numpy as np
import pytest

from hydrone_gym.rendering.frame import _label
from hydrone_gym.world.bodies import UNIT, bounds, distances, gaps_along, mesh, placed, section, support

BODIES = np.array([[1.0, 2.0, 0.3, 1.5], [-4.0, 0.0, -3.0, 0.5]])


def directions(count, seed=0):
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def test_support_is_the_farthest_point_of_a_body():
    for body in BODIES:
        points = body[:3] + body[3] * directions(4000)
        ways = directions(20, seed=1)
        farthest = support(body, ways)
        assert ((farthest * ways).sum(axis=1) >= (points @ ways.T).max(axis=0)).all()
        np.testing.assert_allclose(distances(farthest, body[None]), 0.0, atol=1e-12)


def test_bounds_hold_a_body_and_touch_it():
    for body, (lower, upper) in zip(BODIES, bounds(BODIES), strict=True):
        ends = support(body, np.concatenate((-np.eye(3), np.eye(3))))
        np.testing.assert_allclose((lower, upper), (ends.min(axis=0), ends.max(axis=0)))


def test_distances_are_those_of_paths_without_length():
    points = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.3], [9.0, -9.0, 4.0]])
    expected = [gaps_along(point, point, BODIES) for point in points]
    np.testing.assert_allclose(distances(points, BODIES), expected)


def test_a_section_lies_on_the_surface_and_at_its_height():
    points, normals = section(BODIES[0], 0.0, 24)
    np.testing.assert_allclose(points[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(distances(points, BODIES[:1]), 0.0, atol=1e-12)
    np.testing.assert_allclose(support(BODIES[0], normals), points)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    for height in (-3.0, 3.0):
        assert section(BODIES[0], height, 24)[0].shape == (0, 3)


def test_every_body_is_the_unit_body_moved_and_scaled():
    vertices, faces = mesh(UNIT)
    for body, middle, size in zip(BODIES, *placed(BODIES), strict=True):
        moved, same = mesh(body)
        np.testing.assert_allclose(moved, middle + size * vertices)
        np.testing.assert_array_equal(same, faces)
    edges = np.sort(np.concatenate((faces[:, :2], faces[:, 1:], faces[:, ::2])), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] <= 2).all()
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)


def test_captions_are_not_kept_for_ever():
    for time in range(100):
        _label(f"{time}.0 s   in the air", "#1f2d3a", 12)
    assert _label.cache_info().currsize <= 16
