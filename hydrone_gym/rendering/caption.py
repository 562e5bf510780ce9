"""A line of text on a picture, in the font that Pillow brings along."""

import functools

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from hydrone_gym.rendering import style
from hydrone_gym.simulation.outcome import Outcome

_ENDS = {
    Outcome.GOAL: "goal reached",
    Outcome.COLLISION: "collision",
    Outcome.OUT_OF_BOUNDS: "out of bounds",
    Outcome.ROUGH_TRANSITION: "rough crossing",
    Outcome.TIMEOUT: "time is up",
    Outcome.DIVERGED: "out of control",
}
_GROUND, _GOOD, _BAD = "#1f2d3a", style.GREEN, "#b04a00"  # behind white letters
_OPACITY = 0.85


def describe(time: float, z: float, zone: float, outcome: Outcome) -> tuple[str, str]:
    """Return what is written about a moment, and the colour behind it.

    Args:
        time: s.
        z: height of the vehicle, m.
        zone: half-height of the transition zone, m.
        outcome: of the mission.
    """
    if outcome is not Outcome.RUNNING:
        return f"{time:.1f} s   {_ENDS[outcome]}", _GOOD if outcome is Outcome.GOAL else _BAD
    medium = "in the air" if z > 0.0 else "under water"
    return f"{time:.1f} s   {'crossing' if abs(z) <= zone else medium}", _GROUND


@functools.cache
def _label(text: str, colour: str, size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a label's colours (h, w, 3), 0 to 255, and its opacity (h, w, 1)."""
    font = ImageFont.load_default(size)
    left, _, right, _ = font.getbbox(text)
    width, height = int(right - left) + size, int(1.6 * size)
    label = Image.new("RGB", (width, height), colour)
    ImageDraw.Draw(label).text((0.5 * width, 0.5 * height), text, fill="white", font=font, anchor="mm")
    shape = Image.new("L", (4 * width, 4 * height))
    ImageDraw.Draw(shape).rounded_rectangle((0, 0, 4 * width - 1, 4 * height - 1), 2 * size, fill=255)
    cover = np.asarray(shape.resize((width, height), Image.Resampling.BOX), dtype=np.float64)[:, :, None]
    return np.asarray(label, dtype=np.float64), _OPACITY * cover / 255.0


def write(image: NDArray[np.uint8], text: str, colour: str) -> None:
    """Write a line in white on a colour into the lower left corner of a picture (h, w, 3)."""
    size = max(12, image.shape[0] // 24)
    margin = size // 2
    paint, opacity = _label(text, colour, size)
    paint, opacity = paint[:, : image.shape[1] - margin], opacity[:, : image.shape[1] - margin]
    part = image[-margin - paint.shape[0] : -margin, margin : margin + paint.shape[1]]
    part[:] = np.rint(part + opacity * (paint - part))
