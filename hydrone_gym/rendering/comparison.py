"""Figures that compare policies: success, distributions, success against density or weather, times of decisions.

Every figure is one small panel, wide enough for a phone, and has all policies as rows in the same order and colours;
a policy without values keeps its row. Functions take plain arrays and return Matplotlib figures;
`rendering.files` writes them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym.rendering import style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's eight; yellow last, for it is faint on white
COLOURS = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE, style.WATER, style.RED, style.BLACK, "#F0E442")
_MARKERS = "osD^vP*X"
_WIDTH = 4.8  # inches of a panel
_ROW = 0.37  # inches a policy takes
_LINE = 0.2  # inches a line of ticks takes
_EDGE = "#333333"
_RIM: dict[str, Any] = {"markeredgecolor": _EDGE, "markeredgewidth": 0.5}
_MUTED = "#5a6570"
_LABEL, _TITLE = 22, 42  # characters that fit


def colour(index: int) -> str:
    """Return the colour of the policy with this number, from 0; they begin again after eight."""
    return COLOURS[index % len(COLOURS)]


def plot_success(rates: Mapping[str, tuple[float, float | None, float | None] | None], *, title: str = "") -> Figure:
    """Draw the share of each policy that arrived as a bar with its interval, from 0 to 1; None where it did not fly."""
    with _panel(rates, title) as (figure, axes):
        for row, entry in enumerate(rates.values()):
            if entry is None:
                continue
            value, low, high = entry
            axes.barh(row, 100.0 * value, 0.62, color=colour(row), edgecolor=_EDGE, linewidth=0.7)
            if low is not None and high is not None:
                _interval(axes, row, 100.0 * low, 100.0 * high)
            _note(axes, row, f"{100.0 * value:.1f} %")
        axes.set(xlim=(0.0, 100.0), xlabel="flights that arrived (%)")
    return figure


def plot_distributions(
    values: Mapping[str, ArrayLike], label: str, *, title: str = "", limit: float | None = None, limit_label: str = ""
) -> Figure:
    """Draw a box a policy: quartiles and median, whiskers from the 5th to the 95th percentile, single values beyond.

    A policy has any number of values; `label` is of the axis, with unit. A dashed line marks the limit.
    """
    with _panel(values, title) as (figure, axes):
        axes.use_sticky_edges = False  # else boxes would end at the frame
        for row, entry in enumerate(values.values()):
            numbers = np.asarray(entry, dtype=np.float64)
            if numbers.size:
                _box(axes, row, numbers)
            _note(axes, row, f"n = {numbers.size}")
        if limit is not None:
            _limit(axes, limit, limit_label)
        axes.set_xlabel(label)
    return figure


def plot_rates(
    counts: Sequence[int],
    rates: Mapping[str, ArrayLike],
    label: str,
    *,
    ticks: Sequence[str] = (),
    whole: bool = False,
    title: str = "",
) -> Figure:
    """Draw success against a number, such as that of obstacles: K counts, ascending.

    Each policy has rates (K, 3), else ValueError: the share that arrived and both ends of its interval, from 0 to 1;
    NaN where it did not fly. `label` is of the axis, `ticks` stand on it instead of the counts, of equally many lines
    each; with `whole` the shares are shown from 0 to 1.
    """
    gap = float(np.diff(counts).min()) if len(counts) > 1 else 1.0
    step = 0.6 * gap / max(len(rates), 1)  # side by side, so that no interval hides another
    with _drawing(4.9 + _LINE * "".join(ticks[:1]).count("\n"), title) as (figure, axes):
        for index, (policy, entry) in enumerate(rates.items()):
            shares = 100.0 * np.asarray(entry, dtype=np.float64)
            if shares.shape != (len(counts), 3):
                raise ValueError(f"rates of {policy} must have shape ({len(counts)}, 3), got {shares.shape}")
            places = np.asarray(counts) + step * (index - 0.5 * (len(rates) - 1))
            look: dict[str, Any] = {"color": colour(index), "marker": _MARKERS[index % len(_MARKERS)], **_RIM}
            look |= {"linestyle": "-" if index < len(COLOURS) else "--", "linewidth": 1.6, "elinewidth": 1.2}
            reach = np.clip([shares[:, 0] - shares[:, 1], shares[:, 2] - shares[:, 0]], 0.0, None)
            axes.errorbar(places, shares[:, 0], yerr=reach, markersize=6.5, label=shortened(policy, _LABEL), **look)
        axes.set_ylim(-2.0 if whole else None, 102.0)
        axes.set_xticks(counts, ticks or None)
        axes.set(xlabel=label, ylabel="flights that arrived (%)")
        axes.grid(color="#e6e6e6", linewidth=0.6)
        figure.legend(loc="outside lower center", ncols=2, frameon=False, handlelength=1.6, columnspacing=1.2)
    return figure


def plot_decisions(times: Mapping[str, tuple[float, float]], *, title: str = "") -> Figure:
    """Draw times of decisions, p50 and p99 of each policy (ms, positive), joined by a line, on a logarithmic axis."""
    from matplotlib.ticker import FormatStrFormatter, NullFormatter

    with _panel(times, title) as (figure, axes):
        axes.set_xscale("log")
        for row, (p50, p99) in enumerate(times.values()):
            axes.plot([p50, p99], [row, row], color=colour(row), linewidth=3.0, solid_capstyle="round")
            look: dict[str, Any] = {"color": colour(row), "markersize": 8, **_RIM, "markeredgewidth": 0.7}
            axes.plot(p50, row, "o", p99, row, "D", **look)
            _note(axes, row, f"{p50:.2g} / {p99:.2g}")
        axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("time of a decision (ms), ○ p50, ◇ p99")
    return figure


def shortened(text: str, length: int) -> str:
    """Return a text of at most so many characters, its middle left out if it is longer."""
    if len(text) <= length:
        return text
    kept = length - 1
    return f"{text[: kept // 2]}…{text[len(text) - kept + kept // 2 :]}"


@contextmanager
def _drawing(height: float, title: str) -> Iterator[tuple[Figure, Axes]]:
    """Yield a new figure and its axes, to be filled in the style."""
    from matplotlib.figure import Figure

    with style.applied():
        figure = Figure(figsize=(_WIDTH, height), dpi=style.DOTS_PER_INCH, layout="constrained")
        axes = figure.subplots()
        axes.set_axisbelow(True)
        figure.suptitle(shortened(title, _TITLE), x=0.01, ha="left", fontsize=13)
        yield figure, axes


@contextmanager
def _panel(policies: Mapping[str, Any], title: str) -> Iterator[tuple[Figure, Axes]]:
    """Yield a figure and axes with one row a policy, the first on top."""
    rows = max(len(policies), 2)
    with _drawing(1.25 + _ROW * rows, title) as (figure, axes):
        axes.grid(axis="x", color="#e6e6e6", linewidth=0.6)
        axes.set_yticks(range(len(policies)), [shortened(policy, _LABEL) for policy in policies])
        axes.tick_params(axis="y", length=0)
        axes.set_ylim(len(policies) - 0.4, -0.6)
        yield figure, axes


def _note(axes: Axes, row: int, text: str) -> None:
    """Write a short text right of a row."""
    axes.text(1.03, row, text, transform=axes.get_yaxis_transform(), va="center", fontsize=11, color=_MUTED)


def _interval(axes: Axes, row: int, low: float, high: float) -> None:
    """Draw the interval of a bar, white beneath dark so that it shows on dark bars too."""
    look: dict[str, Any] = {"solid_capstyle": "butt", "clip_on": False}
    axes.plot([low, high], [row, row], color="white", linewidth=3.6, **look)
    axes.plot([low, high], [row, row], "|-", color=_EDGE, linewidth=1.6, markersize=10.5, markeredgewidth=1.6, **look)


def _limit(axes: Axes, limit: float, label: str) -> None:
    """Mark a value by a line, with words above the first row, on the side where there is more room."""
    axes.axvline(limit, color=style.RED, linewidth=1.6, linestyle="--")
    left = limit > sum(axes.get_xlim()) / 2.0
    look: dict[str, Any] = {"color": style.RED, "fontsize": 11, "ha": "right" if left else "left", "va": "top"}
    axes.annotate(label, (limit, 1.0), (-4 if left else 4, -1), ("data", "axes fraction"), "offset points", **look)
    axes.set_ylim(bottom=axes.get_ylim()[0], top=-1.1)


def _box(axes: Axes, row: int, numbers: NDArray[np.float64]) -> None:
    """Draw one box with its whiskers and the values beyond them."""
    low, first, median, third, high = np.percentile(numbers, (5, 25, 50, 75, 95))
    for inner, outer in ((first, low), (third, high)):
        axes.plot([inner, outer], [row, row], color=_EDGE, linewidth=1.1)
        axes.plot([outer, outer], [row - 0.15, row + 0.15], color=_EDGE, linewidth=1.1)
    axes.barh(row, third - first, 0.6, left=first, color=colour(row), edgecolor=_EDGE, linewidth=0.9)
    # on black a median is white, with black around it where the box has no width
    for shade, width in (("black", 4.0), ("white", 1.8)) if colour(row) == style.BLACK else (("black", 2.0),):
        axes.plot([median, median], [row - 0.3, row + 0.3], color=shade, linewidth=width, solid_capstyle="butt")
    beyond = numbers[(numbers < low) | (numbers > high)]
    axes.plot(beyond, np.full(beyond.size, row), "o", color=colour(row), markersize=3.4, alpha=0.8, **_RIM)
