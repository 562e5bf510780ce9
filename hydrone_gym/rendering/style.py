"""Colours and fonts of every figure.

The colours are the Okabe-Ito palette, which colour-blind readers can tell apart.
"""

from contextlib import AbstractContextManager

RED = "#D55E00"  # vermillion: executed paths, branches in air
PURPLE = "#CC79A7"  # reddish purple: branches under water, the goal
BLUE = "#0072B2"  # crossings
WATER = "#56B4E9"  # the water surface and the transition zone
GREEN = "#009E73"  # bluish green: a mission that ended at its goal
ORANGE = "#E69F00"  # what the others leave over
BLACK = "#000000"  # references, the start
DETECTED = ("#1c1c1c", "#747474")  # darkest and lightest shade of an obstacle the vehicle knows
FAINT = ("#e3e3e3", "#fafafa")  # the same for one it never came near
GLASS = ("#78838e", "#fafafa")  # rim and middle of the same where it is drawn see-through

DOTS_PER_INCH = 150
FONTS: dict[str, object] = {
    "font.size": 12,
    "axes.labelsize": 13,
    "axes.titlesize": 13,
    "legend.fontsize": 11,
    "xtick.labelsize": 11,
    "ytick.labelsize": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "pdf.fonttype": 42,  # text stays text, in fonts that journals take
    "svg.fonttype": "none",
}


def applied(salt: str = "") -> AbstractContextManager[None]:
    """Return the fonts to be applied, and to SVG that is equal for equal `salt`; a dollar in a name is a dollar."""
    from matplotlib import rc_context

    return rc_context({**FONTS, "text.parse_math": False, "svg.hashsalt": f"hydrone-{salt}"})


def rgb(colour: str) -> tuple[float, float, float]:
    """Return the parts of a colour "#rrggbb", from 0 to 1."""
    red, green, blue = (part / 255.0 for part in bytes.fromhex(colour[1:]))
    return red, green, blue
