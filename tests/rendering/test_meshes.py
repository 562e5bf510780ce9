"""Meshes: closed, seen from outside, as large as they should be."""

from collections import Counter

import numpy as np
import pytest

from hydrone_gym.rendering.shapes import MODEL
from hydrone_gym.rendering.stage import Mesh, ball, model, rod, slab, walls


def volume(mesh):
    """Volume (m³) inside a closed mesh, positive if its faces are seen from outside."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_bodies_of_revolution_have_their_volume_and_their_outside_out():
    assert volume(ball(0.5, (3.0, -2.0, 1.0), rings=40)) == pytest.approx(np.pi / 6.0, rel=0.01)
    for end in ((2.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 2.0), (1.2, 1.6, 0.0)):
        assert volume(rod((0.0, 0.0, 0.0), end, 0.3, sections=60)) == pytest.approx(0.18 * np.pi, rel=0.01)


def test_rods_are_where_they_should_be():
    mesh = rod((1.0, 1.0, 1.0), (1.0, 1.0, 4.0), 0.5)
    np.testing.assert_allclose(mesh.vertices.min(axis=0), (0.5, 0.5, 1.0), atol=1e-9)
    np.testing.assert_allclose(mesh.vertices.max(axis=0), (1.5, 1.5, 4.0), atol=1e-9)


def test_walls_floor_and_top_enclose_the_box():
    lower, upper = (-1.0, -2.0, -3.0), (1.0, 3.0, 4.0)
    sides, top, floor = walls(lower, upper, -3.0, 4.0), slab(4.0, lower, upper), slab(-3.0, lower, upper)
    assert volume(Mesh.joined(*sides, top, Mesh(floor.vertices, floor.faces[:, ::-1]))) == pytest.approx(70.0)
    assert [len(side.vertices) for side in sides] == [4, 4, 4, 4]


def test_the_vehicle_points_ahead_and_its_rotors_are_alike():
    parts = {name: model(shapes, 0.4) for name, shapes in MODEL.items()}
    assert parts["front"].vertices[:, 0].max() == pytest.approx(0.4 * 1.62, rel=0.01)
    assert np.abs(parts["front"].vertices[:, 1]).max() == pytest.approx(0.4 * 0.62, rel=0.01)
    lowest = {name: part.vertices[:, 0].min() for name, part in parts.items()}
    assert min(lowest.values()) == lowest["rotors"] == pytest.approx(-0.4 * 1.62, rel=0.01)
    assert all(volume(part) > 0.0 for part in parts.values())
    used = Counter(parts["frame"].faces.ravel().tolist())
    assert set(used) == set(range(len(parts["frame"].vertices)))
