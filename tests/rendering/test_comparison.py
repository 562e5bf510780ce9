"""Comparing figures are read back: what is drawn where, and in which colour."""

import subprocess
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from hydrone_gym.rendering.comparison import (
    COLOURS,
    colour,
    plot_decisions,
    plot_distributions,
    plot_rates,
    plot_success,
    shortened,
)
from hydrone_gym.rendering.files import to_svg

SVG = "{http://www.w3.org/2000/svg}"


def texts(figure, salt="t"):
    return ["".join(node.itertext()) for node in ET.fromstring(to_svg(figure, salt)).iter(f"{SVG}text")]


def names(axes):
    return [label.get_text() for label in axes.get_yticklabels()]


def points(axes):
    """(x, y) of every line drawn in data coordinates."""
    return [np.column_stack(line.get_data()).astype(float) for line in axes.lines]


def test_eight_policies_have_colours_of_their_own():
    assert len({colour(index) for index in range(8)}) == 8
    assert colour(9) == colour(1)


def test_success_shows_rates_and_intervals_in_per_cent():
    figure = plot_success({"a": (0.75, 0.5, 0.9), "gone": None, "b": (1.0, 0.8, 1.0)}, title="here")
    (axes,) = figure.axes
    assert [bar.get_width() for bar in axes.patches] == [75.0, 100.0]
    rows = [bar.get_y() + 0.5 * bar.get_height() for bar in axes.patches]
    assert rows == [0.0, 2.0]  # a policy that did not fly keeps its row, and the others their colours
    assert [bar.get_facecolor()[:3] for bar in axes.patches] == [to_rgb(COLOURS[0]), to_rgb(COLOURS[2])]
    drawn = [line.tolist() for line in points(axes)]
    assert [[50.0, 0.0], [90.0, 0.0]] in drawn
    assert [[80.0, 2.0], [100.0, 2.0]] in drawn
    assert names(axes) == ["a", "gone", "b"]
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first is on top
    assert {"here", "75.0 %", "100.0 %", "flights that arrived (%)"} <= set(texts(figure))


def test_boxes_span_quartiles_and_whiskers_leave_a_tenth():
    values = np.arange(101.0)
    figure = plot_distributions({"a": values, "none": [], "one": [7.0]}, "time (s)", limit=90.0, limit_label="late")
    (axes,) = figure.axes
    box = axes.patches[0]
    assert (box.get_x(), box.get_x() + box.get_width()) == (25.0, 75.0)
    drawn = [line.tolist() for line in points(axes)]
    assert [[50.0, -0.3], [50.0, 0.3]] in drawn
    assert [[25.0, 0.0], [5.0, 0.0]] in drawn
    assert [[75.0, 0.0], [95.0, 0.0]] in drawn
    assert [[float(x), 0.0] for x in (*range(5), *range(96, 101))] in drawn
    assert [90.0, 90.0] in [line[:, 0].tolist() for line in points(axes)]
    low, high = axes.get_xlim()
    assert low < 0.0
    assert high > 100.0
    assert {"n = 101", "n = 0", "n = 1", "late", "time (s)"} <= set(texts(figure))


def test_density_joins_rates_and_leaves_gaps():
    rates = {"a": [(1.0, 0.8, 1.0), (0.5, 0.3, 0.7)], "b": [(np.nan,) * 3, (0.9, 0.8, 1.0)]}
    figure = plot_rates([0, 20], rates, "spheres")
    (axes,) = figure.axes
    first, second = (bar.lines[0].get_data() for bar in axes.containers)
    assert first[1].tolist() == [100.0, 50.0]
    assert np.isnan(second[1][0])
    assert second[1][1] == 90.0
    assert np.abs(first[0] - [0, 20]).max() < 10.0  # beside their number, never near the next
    ends = axes.containers[0].lines[2][0].get_segments()
    np.testing.assert_allclose([end[:, 1] for end in ends], [[80.0, 100.0], [30.0, 70.0]])
    with pytest.raises(ValueError, match=r"rates of a must have shape \(2, 3\), got \(1, 3\)"):
        plot_rates([0, 20], {"a": [(1.0, 1.0, 1.0)]}, "spheres")


def test_decisions_are_on_a_logarithmic_axis():
    figure = plot_decisions({"quick": (0.02, 0.1), "slow": (8.0, 25.0)})
    (axes,) = figure.axes
    assert axes.get_xscale() == "log"
    drawn = [line.tolist() for line in points(axes)]
    assert [[0.02, 0.0], [0.1, 0.0]] in drawn
    assert [[8.0, 1.0], [25.0, 1.0]] in drawn
    assert {"0.02 / 0.1", "8 / 25", "0.1", "10"} <= set(texts(figure))


def test_names_are_drawn_as_they_are_and_long_ones_shortened():
    figure = plot_success({"$x^2$ & <b>": (0.5, None, None), "runs/of/a/very/long/folder/agent": (0.5, 0.4, 0.6)})
    shown = texts(figure)
    assert "$x^2$ & <b>" in shown
    assert "runs/of/a/…older/agent" in shown
    assert shortened("123456", 6) == "123456"
    assert shortened("1234567", 6) == "12…567"


def test_equal_figures_give_equal_bytes():
    one, other = (to_svg(plot_success({"a": (0.5, 0.4, 0.6)}), "same") for _ in range(2))
    assert one == other


def test_matplotlib_is_imported_when_a_figure_is_drawn():
    code = "import sys, hydrone_gym.rendering.comparison; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=120, check=False).returncode == 0
