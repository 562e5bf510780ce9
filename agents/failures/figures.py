"""Failures as pictures: where flights ended, how, and in which worlds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from agents.failures import causes
from agents.failures.causes import Failure
from agents.failures.tables import short_name
from agents.failures.worlds import BESIDE_COLUMN, BESIDE_LINE, MEDIA, Features
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.rendering import style
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.world.world import World

# Shape and colour tell causes apart, each alone.
_MARKS = {
    causes.SLID: ("o", style.BLUE),
    causes.SLID_LATE: ("^", style.WATER),
    causes.ROSE_OR_SANK: ("d", style.GREEN),
    causes.SEEN: ("s", style.RED),
    causes.LATE: ("v", style.ORANGE),
    causes.NEVER: ("*", style.BLACK),
    causes.SLID_OUT: (">", style.BLUE),
    causes.LEFT: (">", style.PURPLE),
    causes.ROUGH_SPEED: ("P", style.PURPLE),
    causes.ROUGH_TILT: ("P", style.ORANGE),
    causes.ROUGH_BOTH: ("P", style.RED),
    causes.WAITED_IN_ZONE: ("X", style.ORANGE),
    causes.WAITED: ("X", style.BLACK),
    causes.CIRCLED: ("X", style.PURPLE),
    causes.MADE_WAY: ("X", style.GREEN),
    causes.DIVERGED: ("h", style.BLACK),
}
_SERIES = (("o", style.BLUE), ("s", style.RED), ("^", style.GREEN))  # one a mission
_GREY = "#888888"
_TICKS = (0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)  # s
_KINDS = (4, 3, len(MEDIA))  # of worlds that the panels tell apart: 3 or more, and 2 or more spheres, are one kind
_FEWEST = 30  # worlds that a point needs, or its interval says nothing


def draw_where(failures: Sequence[Failure], missions: Sequence[str], world: World) -> Figure:
    """Draw from the side where flights failed, a panel a mission: their paths and a mark of the cause at the end."""
    figure, panels = _panels(len(missions), (10.0, 5.0), sharey=True)
    for panel, mission in zip(panels, missions, strict=True):
        those = [failure for failure in failures if failure.mission == mission]
        panel.axhspan(-world.zone, world.zone, color=style.WATER, alpha=0.22, linewidth=0)
        panel.axhline(0.0, color=style.BLUE, linewidth=1.0)
        for failure in those:
            panel.plot(*failure.path.T, color=_GREY, linewidth=0.5, alpha=min(1.0, 8.0 / len(those)))
        _mark(panel, those, [(failure.end.share_of_way, failure.end.z_m) for failure in those])
        panel.set(title=f"{short_name(mission)}: {len(those)} failures", xlabel="share of the way")
        panel.set(xlim=(-0.15, 1.15), ylim=(world.lower[2], world.upper[2]))
    panels[0].set_ylabel("height z (m)")
    return _finished(figure, panels)


def draw_how(failures: Sequence[Failure]) -> Figure:
    """Draw how flights failed: speeds at the end but for time-outs, and for collisions how long there was to act."""
    figure, panels = _panels(2, (10.0, 5.0))
    moving = [failure for failure in failures if failure.outcome is not Outcome.TIMEOUT]
    panels[0].axhline(0.0, color=_GREY, linewidth=0.8)
    _mark(panels[0], moving, [(f.end.horizontal_speed_m_s, f.end.vertical_speed_m_s) for f in moving])
    panels[0].set(xlabel="horizontal speed at the end (m/s)", ylabel="vertical speed at the end (m/s)")
    those, known, chance = [], [], []
    for f in failures:
        if f.contact is not None and f.chance is not None and f.contact.known_s is not None:
            those.append(f)
            known.append(f.contact.known_s)
            chance.append(f.chance.last_chance_s)
    left, right = 0.8 * min([0.5, *known]), 1.2 * max([10.0, *known])
    bottom, top = 0.8 * min([0.2, *chance]), 1.2 * max([3.0, *chance])
    panels[1].fill_between([left, top], [left, top], top, color=_GREY, alpha=0.15, linewidth=0)
    _mark(panels[1], those, list(zip(known, chance, strict=True)))
    panels[1].text(0.03, 0.95, "seen too late", transform=panels[1].transAxes)
    panels[1].set(xscale="log", yscale="log", xlim=(left, right), ylim=(bottom, top))
    for axis, least, most in ((panels[1].xaxis, left, right), (panels[1].yaxis, bottom, top)):
        ticks = [tick for tick in _TICKS if least <= tick <= most]
        axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.set_ticks([], minor=True)
    panels[1].set(xlabel="sphere known before the contact (s)", ylabel="last chance before the contact (s)")
    return _finished(figure, panels)


def draw_worlds(worlds: Sequence[tuple[str, Features, NDArray[np.bool_]]]) -> Figure:
    """Draw success against what worlds have in common, with 95 % Wilson intervals.

    `worlds` has for each mission its environment id, the features of its worlds, and (n,) which flights arrived.
    """
    figure, panels = _panels(3, (10.0, 4.4), sharey=True)
    for number, (mission, features, arrived) in enumerate(worlds):
        line, column = np.minimum(features.beside_line, 3), np.minimum(features.beside_column, 2)
        for panel, values, kinds in zip(panels, (line, column, features.media), _KINDS, strict=True):
            _rates(panel, values, kinds, arrived, number, short_name(mission))
    panels[0].set(ylabel="at the goal (%)", xlabel=f"spheres within {BESIDE_LINE:g} m\nof the straight line")
    panels[1].set_xlabel(f"spheres in the zone within {BESIDE_COLUMN:g} m\nof the column at the water end")
    panels[2].set_xlabel("start and goal")
    media = [name.replace(" to ", "\nto ") for name in MEDIA]
    for panel, labels in zip(panels, (("0", "1", "2", "3+"), ("0", "1", "2+"), media), strict=True):
        panel.set_xticks(range(len(labels)), labels)
        panel.set_xlim(-0.5, len(labels) - 0.5)
        panel.grid(axis="y", alpha=0.3)
    panels[0].set_ylim(top=100.0 + 0.03 * (100.0 - panels[0].get_ylim()[0]))
    return _finished(figure, panels)


def _rates(
    panel: Axes, values: NDArray[np.int64], kinds: int, arrived: NDArray[np.bool_], number: int, label: str
) -> None:
    """Draw the rate of success of a mission's worlds of each kind, values 0 to `kinds` - 1; others are left out."""
    points = []
    for kind in range(kinds):
        those = arrived[values == kind]
        if len(those) >= _FEWEST:
            points.append((kind, those.mean(), *wilson_interval(int(those.sum()), len(those))))
    if not points:
        return
    kind, rate, low, high = np.array(points).T
    shape, colour = _SERIES[number % len(_SERIES)]
    x, interval = kind + 0.12 * (number - 1), 100.0 * np.array([rate - low, high - rate])
    panel.errorbar(x, 100.0 * rate, interval, fmt=shape, color=colour, capsize=3, label=label)


def _panels(count: int, size: tuple[float, float], *, sharey: bool = False) -> tuple[Figure, list[Axes]]:
    with rc_context(style.FONTS):
        figure = Figure(figsize=size, dpi=style.DOTS_PER_INCH, layout="constrained")
        return figure, list(figure.subplots(1, count, sharey=sharey, squeeze=False)[0])


def _mark(panel: Axes, failures: Sequence[Failure], points: Sequence[tuple[float, float]]) -> None:
    """Put a mark of its cause at each failure's point; causes in one order, so that legends agree."""
    for cause, (shape, colour) in _MARKS.items():
        those = [point for failure, point in zip(failures, points, strict=True) if failure.cause == cause]
        if those:
            drawn: dict[str, Any] = {"s": 34, "edgecolor": "white", "linewidth": 0.4, "zorder": 3}
            panel.scatter(*zip(*those, strict=True), marker=shape, color=colour, label=cause, **drawn)


def _finished(figure: Figure, panels: Sequence[Axes]) -> Figure:
    """Put one legend below the panels, each label once; say so in panels that have nothing to show."""
    handles: dict[str, Any] = {}
    for panel in panels:
        shown, labels = panel.get_legend_handles_labels()
        handles |= dict(zip(labels, shown, strict=True))
        if not labels:
            panel.text(0.5, 0.5, "none", ha="center", transform=panel.transAxes)
    if handles:
        with rc_context(style.FONTS):
            figure.legend(handles.values(), handles, loc="outside lower center", ncols=3, frameon=False)
    return figure
