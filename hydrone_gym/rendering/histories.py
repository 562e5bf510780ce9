"""Figures over time: position (paper, Figs. 7 and 10) and attitude (Figs. 8 and 11), executed and reference."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering import style
from hydrone_gym.surface import in_air

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
_LEAST_ANGLE_RANGE = 4.0  # degrees: a straight flight must not look wild


def plot_position(times: Array, positions: Array, references: Array, *, zone: float = 0.8, title: str = "") -> Figure:
    """Draw x, y, z over time, executed and reference (paper, Figs. 7 and 10).

    Args:
        times: (N,) s.
        positions: (N, 3) m.
        references: (N, 3) the moving reference, m.
        zone: half-height of the transition zone, m: a band in z, and the time spent inside it in every panel.
        title: shown above.
    """
    labels = ("x (m)", "y (m)", "z (m)")
    figure, panels = _three_panels(title, times, labels, positions, references)
    panels[2].axhspan(-zone, zone, color=style.WATER, alpha=0.22, linewidth=0)
    panels[2].axhline(0.0, color=style.BLUE, linewidth=1.0)
    _finish(figure, panels, times, positions[:, 2], zone)
    return figure


def plot_attitude(
    times: Array, attitudes: Array, references: Array, heights: Array, *, zone: float = 0.8, title: str = ""
) -> Figure:
    """Draw roll, pitch and yaw over time, executed and reference (paper, Figs. 8 and 11).

    Args:
        times: (N,) s.
        attitudes: (N, 3) φ, θ, ψ in rad.
        references: (N, 3) what the control laws track, rad; NaN where a law has none.
        heights: (N,) z in m, which tells when the vehicle is inside the zone.
        zone: half-height of the transition zone, m.
        title: shown above.
    """
    yaw = np.unwrap(attitudes[:, 2])
    nearest = yaw + (references[:, 2] - yaw + np.pi) % (2.0 * np.pi) - np.pi
    executed = np.degrees(np.column_stack((attitudes[:, :2], yaw)))
    wanted = np.degrees(np.column_stack((references[:, :2], nearest)))
    labels = ("roll φ (°)", "pitch θ (°)", "yaw ψ (°)")
    figure, panels = _three_panels(title, times, labels, executed, wanted)
    for panel in panels:
        low, high = panel.get_ylim()
        if high - low < _LEAST_ANGLE_RANGE:
            middle = 0.5 * (low + high)
            panel.set_ylim(middle - 0.5 * _LEAST_ANGLE_RANGE, middle + 0.5 * _LEAST_ANGLE_RANGE)
    _finish(figure, panels, times, heights, zone)
    return figure


def _three_panels(
    title: str, times: Array, labels: Sequence[str], executed: Array, references: Array
) -> tuple[Figure, list[Axes]]:
    """Return a figure with three panels that share the time axis: executed red, reference dotted black."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(style.FONTS):
        figure = Figure(figsize=(7.6, 6.4), dpi=style.DOTS_PER_INCH, layout="constrained")
        panels = list(figure.subplots(3, 1, sharex=True))
        figure.suptitle(title)
    for panel, label, flown, sent in zip(panels, labels, executed.T, references.T, strict=True):
        panel.plot(times, flown, color=style.RED, linewidth=2.4)
        panel.plot(times, sent, color=style.BLACK, linewidth=1.7, linestyle=":")
        panel.set_ylabel(label)
        panel.grid(color="#e6e6e6", linewidth=0.6)
        panel.set_axisbelow(True)
    return figure, panels


def _finish(figure: Figure, panels: list[Axes], times: Array, heights: Array, zone: float) -> None:
    """Shade the time inside the zone, mark the crossings, align the labels and add the legend."""
    from matplotlib import rc_context
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    shade: dict[str, Any] = {"color": style.WATER, "alpha": 0.22, "linewidth": 0}
    air, inside = in_air(heights), np.abs(heights) <= zone
    crossings = times[1:][air[1:] != air[:-1]]
    for panel in panels:
        panel.fill_between(times, 0.0, 1.0, inside, transform=panel.get_xaxis_transform(), **shade)
        for time in crossings:
            panel.axvline(time, color=style.BLUE, linewidth=1.2, linestyle="--")
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xlim(times[0], times[-1])
    figure.align_ylabels(panels)
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=style.RED, linewidth=2.4, label="executed"),
        Line2D([], [], color=style.BLACK, linewidth=1.7, linestyle=":", label="reference"),
        Patch(color=style.WATER, alpha=0.35, linewidth=0, label="transition zone"),
    ]
    if len(crossings):
        handles.append(Line2D([], [], color=style.BLUE, linewidth=1.2, linestyle="--", label="crossing"))
    with rc_context(style.FONTS):
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
