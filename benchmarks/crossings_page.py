"""The tables and figures of docs/crossings.md, from what `crossings` and `crossing_lag` last measured of each law."""

import json
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from benchmarks.results import origin_of
from benchmarks.tables import Sheet, put_into
from benchmarks.timing import RESULTS, ROOT
from hydrone_gym.rendering import style

PAGE, IMAGES = ROOT / "docs" / "crossings.md", ROOT / "docs" / "images"
ENOUGH = 0.99  # of the flights
DIRECTIONS = {"entry": "water entry", "exit": "water exit"}
RULES = ("smooth", "aggressive")
_DARK = 55.0  # %: numbers on less are white

Cells = dict[tuple[str, float, float, float], dict[str, Any]]


def by_place(measured: dict[str, Any]) -> Cells:
    """Cells by direction, wind (m/s), height of waves (m) and speed (m/s)."""
    return {(c["direction"], c["wind"], c["height"], c["speed"]): c for c in measured["cells"]}


def axes_of(cells: Cells) -> tuple[list[float], list[float], list[float]]:
    """Winds, heights and speeds that were flown."""
    winds, heights, speeds = (sorted({place[k] for place in cells}) for k in (1, 2, 3))
    return winds, heights, speeds


def fastest(cells: Cells, place: tuple[str, float, float], rule: str) -> dict[str, Any] | None:
    """The cell of the greatest speed at which enough flights keep a rule; place: direction, wind, height of waves."""
    flown = [c for where, c in cells.items() if where[:3] == place and c[rule][0] >= ENOUGH]
    return max(flown, key=lambda c: c["speed"], default=None)


def _fastest(cells: Cells, place: tuple[str, float, float], rule: str) -> str:
    found = fastest(cells, place, rule)
    if found is None:
        return "–"
    value, low, high = (100.0 * part for part in found[rule])
    return f"{found['speed']:g}: {value:.1f} [{low:.1f}, {high:.1f}]"


def fastest_sheet(law: str, measured: dict[str, Any]) -> Sheet:
    """The fastest crossing of each sea and wind."""
    cells, rows = by_place(measured), []
    winds, heights, _ = axes_of(cells)
    kinds = [(direction, rule) for direction in DIRECTIONS for rule in RULES]
    for wind in winds:
        for height in heights:
            shown = [_fastest(cells, (direction, wind, height), rule) for direction, rule in kinds]
            rows.append((f"{wind:g}", f"{height:g}", *shown))
    columns, limits = [f"{DIRECTIONS[direction]}, {rule}" for direction, rule in kinds], measured["limits"]
    return Sheet(
        f"Fastest crossing, `{law}`",
        ("wind m/s", "waves m", *columns),
        rows,
        [
            f"Greatest vertical speed (m/s) at which at least {100 * ENOUGH:g} % of the flights cross so, and their "
            f"share [95 %] in %. Aggressive: at most {limits['lateral']:g} m/s sideways, {limits['tilt']:g}° and "
            f"{limits['acceleration']:g} m/s²."
        ],
    )


def full_sheet(law: str, measured: dict[str, Any], direction: str) -> Sheet:
    """All there is about a direction, a column a speed."""
    cells, rows = by_place(measured), []
    winds, heights, speeds = axes_of(cells)
    for wind in winds:
        for height in heights:
            found = [cells[direction, wind, height, speed] for speed in speeds]
            rows.append((f"{wind:g}", f"{height:g}", *map(_summary, found)))
    columns = ("wind m/s", "waves m", *(f"{speed:g} m/s" for speed in speeds))
    note = (
        "Flights that cross smoothly / within the aggressive limits, in % · peak acceleration, m/s² · peak tilt, ° · "
        "time through the zone, s; peaks: 95 % of the flights that come through stay below, times: their median."
    )
    return Sheet(f"{DIRECTIONS[direction].capitalize()}, `{law}`", columns, rows, [note])


def _summary(c: dict[str, Any]) -> str:
    rates = " / ".join(f"{100.0 * c[rule][0]:.0f}" for rule in RULES)
    if c["seconds"][0] is None:
        return rates
    return f"{rates} · {c['acceleration'][1]:.0f} · {c['tilt'][1]:.0f} · {c['seconds'][0]:.1f}"


def lag_sheet(law: str, measured: dict[str, Any]) -> Sheet:
    """Crossings with lag and late notice."""
    found = {(s["lag"], s["delay"], s["direction"], s["hull"]): s for s in measured["settings"]}
    lags, delays, _, hulls = (sorted({place[k] for place in found}) for k in range(4))
    kinds = [(direction, hull) for direction in DIRECTIONS for hull in hulls]
    rows = [
        (f"{1000 * lag:g}", f"{1000 * delay:g}", *(_came(found[lag, delay, *kind]) for kind in kinds))
        for lag in lags
        for delay in delays
    ]
    names = [f"{DIRECTIONS[direction]}, {f'hull {hull:g} m' if hull else 'abrupt'}" for direction, hull in kinds]
    return Sheet(
        f"Lag and late notice, `{law}`",
        ("rotor lag ms", "noticed after ms", *names),
        rows,
        [
            "Flights that come through for good, in %, the median time until then, and the median number of crossings "
            f"where it is not one; {measured['settings'][0]['flights']} flights each, 12 s."
        ],
    )


def _came(s: dict[str, Any]) -> str:
    words = [f"{100.0 * s['through'] / s['flights']:.0f} %"]
    words += [] if s["seconds"] is None else [f"{s['seconds']:.1f} s"]
    words += [] if s["crossings"] == 1.0 else [f"{s['crossings']:.0f} crossings"]
    return ", ".join(words)


def draw(law: str, measured: dict[str, Any]) -> Figure:
    """Success over speed and waves: a panel for each wind, direction and rule."""
    cells = by_place(measured)
    winds, heights, speeds = axes_of(cells)
    kinds = [(direction, rule) for direction in DIRECTIONS for rule in RULES]
    with plt.rc_context(style.FONTS):
        figure, panels = plt.subplots(
            len(kinds), len(winds), figsize=(13.0, 9.6), sharex=True, sharey=True, layout="constrained"
        )
        for line, (direction, rule) in zip(panels, kinds, strict=True):
            for panel, wind in zip(line, winds, strict=True):
                shares = [[cells[direction, wind, h, v][rule][0] for v in speeds] for h in heights]
                image = _heat(panel, 100.0 * np.array(shares))
            line[0].set_ylabel(f"{DIRECTIONS[direction]},\n{rule}\nwaves (m)")
            line[0].set_yticks(range(len(heights)), [f"{h:g}" for h in heights])
        for panel, wind in zip(panels[0], winds, strict=True):
            panel.set_title(f"wind {wind:g} m/s")
        for panel in panels[-1]:
            panel.set(xlabel="vertical speed (m/s)")
            panel.set_xticks(range(len(speeds)), [f"{v:g}" for v in speeds])
        figure.colorbar(image, ax=panels, label="flights that come through so (%)", shrink=0.6)
        figure.suptitle(f'Crossing the surface, controller="{law}"')
    return figure


def _heat(panel: Any, shares: np.ndarray) -> Any:
    """Draw shares (heights, speeds) in percent, each with its number."""
    image = panel.imshow(shares, cmap="cividis", vmin=0.0, vmax=100.0, origin="lower", aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        text = f"{share:.1f}" if 98.0 < share < 100.0 else f"{share:.0f}"
        colour = "white" if share < _DARK else style.BLACK
        panel.text(column, row, text, ha="center", va="center", color=colour, fontsize=10)
    return image


def _records(study: str, results: Path) -> dict[str, dict[str, Any]]:
    """What a study last measured, by law."""
    records = [json.loads(path.read_text(encoding="utf-8")) for path in results.glob(f"{study}-*.json")]
    return {record["law"]: record for record in sorted(records, key=lambda record: record["law"])}


def section(results: Path = RESULTS) -> str:
    """All tables in Markdown, law by law."""
    parts = []
    for law, record in _records("crossings", results).items():
        parts += [fastest_sheet(law, record).markdown(), f"![Success over speed and waves](images/{_image(law)})\n"]
        parts += [full_sheet(law, record, direction).markdown() for direction in DIRECTIONS]
        parts.append(origin_of(record))
    for law, record in _records("crossing_lag", results).items():
        parts += [lag_sheet(law, record).markdown(), origin_of(record)]
    return "\n".join(parts)


def _image(law: str) -> str:
    return f"crossing-speeds-{law}.png"


def write() -> None:
    """Draw what there is, and put the tables into the page."""
    for law, record in _records("crossings", RESULTS).items():
        figure = draw(law, record)
        figure.savefig(IMAGES / _image(law), dpi=style.DOTS_PER_INCH)
        plt.close(figure)
    put_into(PAGE, section())
