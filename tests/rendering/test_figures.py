"""Figures are drawn from arrays: counted in pixels, by colour."""

import itertools
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb

from hydrone_gym import Scenario, World
from hydrone_gym.rendering import style
from hydrone_gym.rendering.figures import plot_attitude, plot_path, plot_position, plot_tree
from hydrone_gym.rendering.files import save_figure
from hydrone_gym.rendering.paths import crossing_points, dash, split_media
from hydrone_gym.rendering.scene3d import Scene
from planners import TreeView

NOTHING = np.zeros((0, 4))
LEGEND = 0.12  # share of the height that the legend takes at the bottom


def pixels(figure):
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = np.asarray(canvas.buffer_rgba())[..., :3].astype(float) / 255.0
    return image[: int((1.0 - LEGEND) * len(image))]


def count(image, colour, tolerance=0.02):
    return int((np.abs(image - to_rgb(colour)).max(axis=-1) < tolerance).sum())


@pytest.fixture
def dive():
    t = np.linspace(0.0, 10.0, 201)
    return t, np.column_stack((t - 5.0, 0.5 * t, 4.0 - 0.8 * t))


def test_split_media_and_crossing_points(dive):
    _, path = dive
    air, water = split_media(path)
    assert len(air) == len(water) == 1
    assert air[0][:, 2].min() == 0.0
    assert water[0][:, 2].max() == 0.0
    np.testing.assert_allclose(crossing_points(path), [[0.0, 2.5, 0.0]], atol=1e-12)  # z = 0 at t = 5
    lengths = [np.linalg.norm(np.diff(part, axis=0), axis=1).sum() for part in (air[0], water[0], path)]
    assert lengths[0] + lengths[1] == pytest.approx(lengths[2])
    assert len(crossing_points(path + [0.0, 0.0, 9.0])) == 0


def test_path_shows_path_water_marks_and_obstacles(dive):
    _, path = dive
    bare = pixels(plot_path(path, path[-1], NOTHING, NOTHING))
    assert count(bare, style.RED) > 1000
    assert count(bare, style.PURPLE) > 100
    assert count(bare, style.BLUE) > 50
    assert count(bare, style.DETECTED[0]) < 500
    sphere = np.array([[-6.0, 6.0, 6.0, 1.5]])
    assert count(pixels(plot_path(path, path[-1], sphere, NOTHING)), style.DETECTED[0]) > 1000
    faint = pixels(plot_path(path, path[-1], NOTHING, sphere))
    assert count(faint, style.DETECTED[0]) < 500
    assert (faint != bare).any(axis=-1).sum() > 1000


def test_path_under_water_is_dashed_and_tinted(dive):
    _, path = dive
    dry = pixels(plot_path(path + [0.0, 0.0, 5.0], path[-1], NOTHING, NOTHING))
    wet = pixels(plot_path(path - [0.0, 0.0, 4.9], path[-1], NOTHING, NOTHING))
    assert count(wet, style.RED) < 0.75 * count(dry, style.RED)
    dashes = dash(path, 0.3, 0.21)
    lengths = [np.linalg.norm(np.diff(piece, axis=0), axis=1).sum() for piece in dashes]
    np.testing.assert_allclose(lengths[:-1], 0.3)
    gaps = [np.linalg.norm(b[0] - a[-1]) for a, b in itertools.pairwise(dashes)]
    np.testing.assert_allclose(gaps, 0.21)


def test_near_hides_far():
    """A sphere between the eye and another one hides it; under water everything takes the colour of the surface."""
    scene = Scene((-10.0, -10.0, -5.0), (10.0, 10.0, 10.0), azimuth=-60.0)
    eye = scene.camera[2]
    far, near = np.array([0.0, 0.0, 4.0]) - 3.0 * eye, np.array([0.0, 0.0, 4.0]) + 3.0 * eye
    scene.obstacles(np.array([[*near, 1.5]]), ("#00ff00", "#00ff00"))
    scene.obstacles(np.array([[*far, 1.0]]), ("#ff00ff", "#ff00ff"))
    scene.lines([np.array([far + 1.5 * eye, far - eye])], "#0000ff", 3.0)
    image = pixels(scene.figure)
    assert count(image, "#00ff00") > 3000
    assert count(image, "#ff00ff") == 0
    assert count(image, "#0000ff") == 0
    sunk = Scene((-10.0, -10.0, -5.0), (10.0, 10.0, 10.0), azimuth=-60.0)
    sunk.obstacles(np.array([[0.0, 0.0, -2.0, 1.0]]), ("#00ff00", "#00ff00"))
    image = pixels(sunk.figure)
    tinted = 0.7 * np.array(to_rgb("#00ff00")) + 0.3 * np.array(to_rgb(style.WATER))
    assert count(image, "#00ff00") == 0
    assert count(image, tuple(tinted)) > 3000


def test_scales_are_equal_on_all_axes():
    scene = Scene((-10.0, -10.0, -5.0), (10.0, 10.0, 10.0))
    scene.obstacles(np.array([[0.0, 0.0, 5.0, 2.0]]), ("#00ff00", "#00ff00"))
    image = pixels(scene.figure)
    rows, columns = np.nonzero(np.abs(image - to_rgb("#00ff00")).max(axis=-1) < 0.02)
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), abs=3)


def test_position_and_attitude_show_executed_reference_and_zone(dive):
    t, path = dive
    plain = pixels(plot_position(t, path, path + 0.3))
    assert count(plain, style.RED) > 2000
    assert count(plain, style.BLACK) > 1000
    assert count(plain, style.BLUE, 0.1) > 500
    band = 0.78 * np.ones(3) + 0.22 * np.array(to_rgb(style.WATER))
    shaded = count(plain, tuple(band))
    assert shaded > 5000
    assert count(pixels(plot_position(t, path + [0, 0, 20], path + [0, 0, 20])), tuple(band)) < 0.2 * shaded
    wave = 0.2 * np.sin(np.column_stack((t, 2 * t, 3 * t)))
    angles = plot_attitude(t, wave, np.full_like(wave, np.nan), path[:, 2])
    assert count(pixels(angles), style.RED) > 2000
    # degrees, not radians
    low, high = angles.axes[0].get_ylim()
    assert 10.0 < high < 13.0
    assert -13.0 < low < -10.0


def test_yaw_is_drawn_without_jumps():
    t = np.linspace(0.0, 10.0, 201)
    yaw = (0.8 * t + np.pi) % (2.0 * np.pi) - np.pi
    flat = np.zeros_like(t)
    attitudes = np.column_stack((flat, flat, yaw))
    figure = plot_attitude(t, attitudes, attitudes, flat + 5.0)
    executed, reference = (line.get_ydata() for line in figure.axes[2].lines[:2])
    np.testing.assert_allclose(executed, np.degrees(0.8 * t), atol=1e-9)
    np.testing.assert_allclose(reference, executed, atol=1e-9)


def test_tree_has_red_branches_in_air_and_purple_ones_under_water():
    rng = np.random.default_rng(0)
    begin = rng.uniform([-9, -9, 1], [9, 9, 9], size=(60, 3))
    air = np.stack((begin, begin + [0.5, 0.5, 0.5]), axis=1)
    water = air * [1.0, 1.0, -0.45]
    edges, medium, none = np.concatenate((air, water)), np.arange(120) < 60, np.zeros(0, int)
    scenario = Scenario(start=(-9.0, -9.0, 8.0, 0.0), goal=(9.0, 9.0, -3.0), obstacles=NOTHING)

    def drawn(edges, air, path=none, scenario=scenario):
        return pixels(plot_tree(TreeView(edges, air, np.zeros(len(edges)), path), scenario, World()))

    both, dry, wet = drawn(edges, medium), drawn(air, medium[:60]), drawn(water, medium[60:])
    assert count(both, style.RED) > 300
    assert count(dry, style.RED) > 300
    assert count(wet, style.RED) == 0
    assert count(both, style.PURPLE) > count(dry, style.PURPLE) + 50
    path = np.array([((-9.0, -9.0, 8.0), (9.0, 9.0, 1.0)), ((9.0, 9.0, 1.0), (9.0, 9.0, -3.0))])
    world = Scenario(start=scenario.start, goal=scenario.goal, obstacles=[(0.0, 0.0, 5.0, 1.0)])
    known = drawn(np.concatenate((edges, path)), np.append(medium, [True, False]), np.array([120, 121]), world)
    assert count(known, style.BLACK) > count(both, style.BLACK) + 500
    assert count(known, style.DETECTED[0]) > 500


def test_equal_flights_give_equal_files(dive, tmp_path):
    _, path = dive
    for name in ("a", "b"):
        written = save_figure(plot_path(path, path[-1], NOTHING, NOTHING), tmp_path / name)
        assert [file.name for file in written] == [f"{name}.png", f"{name}.pdf"]
    for suffix in ("png", "pdf"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    assert b"CreationDate" not in (tmp_path / "a.pdf").read_bytes()


def test_files_hold_real_fonts_and_text(dive, tmp_path):
    _, path = dive
    figure = plot_path(path, path[-1], NOTHING, NOTHING, title="Somewhere")
    pdf, svg = save_figure(figure, tmp_path / "a", formats=("pdf", "svg"))
    assert b"/Type3" not in pdf.read_bytes()
    assert b"/CIDFontType2" in pdf.read_bytes()
    assert ">Somewhere</text>" in svg.read_text()


def test_a_width_is_that_of_the_page_and_leaves_text_at_8_points(dive, tmp_path):
    t, path = dive
    figure = plot_position(t, path, path, title="Somewhere")
    png, pdf, svg = save_figure(figure, tmp_path / "a", width=3.5, titled=False, formats=("png", "pdf", "svg"))
    assert int.from_bytes(png.read_bytes()[16:20], "big") == 3.5 * 400  # pixels
    assert b"MediaBox [ 0 0 252 " in pdf.read_bytes()
    text = svg.read_text()
    assert 'width="252pt"' in text
    assert 'viewBox="0 0 378 ' in text  # half as wide again, for text of 12 points
    assert "Somewhere" not in text
    assert figure.get_figwidth() == 7.6  # as before
    assert "Somewhere" in save_figure(figure, tmp_path / "b", formats=("svg",))[0].read_text()


def extent(image, colour):
    """Height and width of what has a colour, pixels."""
    rows, columns = np.nonzero(np.abs(image - to_rgb(colour)).max(axis=-1) < 0.02)
    return np.ptp(rows), np.ptp(columns)


def test_the_radius_of_arrival_is_to_scale(dive):
    """A circle of a radius is as large as the obstacle of that radius at its place."""
    centre = (2.0, -3.0, 5.0)
    ball, ring = (Scene((-10.0, -10.0, -5.0), (10.0, 10.0, 10.0)) for _ in range(2))
    ball.obstacles(np.array([[*centre, 1.5]]), ("#00ff00", "#00ff00"))
    ring.circle(centre, 1.5, "#00ff00")
    np.testing.assert_allclose(extent(pixels(ring.figure), "#00ff00"), extent(pixels(ball.figure), "#00ff00"), atol=5)
    _, path = dive
    sizes = []
    for radius in (1.0, 2.0):
        figure = plot_path(path, (5.0, 5.0, 6.0), NOTHING, NOTHING, world=World(goal_radius=radius))
        sizes.append(extent(pixels(figure), style.PURPLE))
        assert f"arrival ({radius:g} m)" in [text.get_text() for text in figure.legends[0].get_texts()]
    np.testing.assert_allclose(sizes[1], 2.0 * np.array(sizes[0]), atol=5)


def test_matplotlib_is_loaded_only_to_draw():
    program = "import sys, hydrone_gym.rendering.figures; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False, timeout=120).returncode == 0
