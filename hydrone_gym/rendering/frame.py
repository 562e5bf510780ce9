"""One picture of a mission: what is known of a moment becomes shapes, and a ray caster paints them."""

import functools

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from hydrone_gym.rendering import shapes, style
from hydrone_gym.rendering.backdrop import Box
from hydrone_gym.rendering.camera import Pose, View, beside, chase
from hydrone_gym.rendering.outdoors import Outdoors
from hydrone_gym.rendering.raycast import Canvas
from hydrone_gym.rendering.track import Moment
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.bodies import gaps_along
from hydrone_gym.world.world import World

_VEHICLE_PIXELS = 34.0  # how wide the vehicle is at least, from the overview
_OVERVIEW_SCALE = 2.5  # times its true size
_GROUND, _GOOD, _BAD = "#1f2d3a", style.GREEN, "#b04a00"  # behind white letters
_OPACITY = 0.85
_LABELS = 16  # captions that are kept: pictures of about the same time share one


class Painter:
    """Paints moments of one world with one vehicle, larger than it is from the overview."""

    def __init__(self, view: View, world: World, vehicle: Vehicle) -> None:
        self.view, self.world, self.vehicle = view, world, vehicle
        self._canvas, self._following = Canvas(view.size), view.camera == "chase"

    def paint(self, moment: Moment) -> NDArray[np.uint8]:
        """Return a new picture (height, width, 3); equal moments give equal bytes."""
        pose, box = self.pose(moment), Box(self.world.lower, self.world.upper, self.world.zone, float(self._following))
        unit = self._unit(pose, moment.ticks[-1, :3] if self._following else np.zeros(3))
        widest = _VEHICLE_PIXELS * unit / (2.0 * self.vehicle.radius)
        scale = 1.0 if self._following else max(_OVERVIEW_SCALE, widest)
        outdoors = moment.outdoors(self.world)
        drawn = self._shapes(moment, outdoors, pose, unit, scale)
        image = self._canvas.picture(drawn, pose, box)
        ground = {Outcome.RUNNING: _GROUND, Outcome.GOAL: _GOOD}.get(moment.outcome, _BAD)
        words = moment.words(self.world.zone) + (() if outdoors is None else (outdoors.words,))
        _write(image, "   ".join(words), ground)
        return image

    def pose(self, moment: Moment) -> Pose:
        """Return where a picture is taken from."""
        if self._following:
            return chase(moment.ticks[:, :3], moment.goal)
        return beside(self.world, moment.ticks[0, :3], moment.goal, self.view.size[0] / self.view.size[1])

    def _unit(self, pose: Pose, point: NDArray[np.float64]) -> float:
        """How much a pixel covers at a point (m): thin things are measured in it, to stay visible in any picture."""
        return pose.pixel(self.view.size[1]) * float(np.linalg.norm(point - pose.eye))

    def _shapes(
        self, moment: Moment, outdoors: Outdoors | None, pose: Pose, unit: float, scale: float
    ) -> shapes.Shapes:
        """Everything that is drawn; `unit` (m) is a pixel at the path."""
        now = moment.ticks[-1]
        end, sent = (self._unit(pose, point) for point in (moment.goal, now[12:15]))
        veiled = gaps_along(pose.eye, now[:3], moment.obstacles) < self.vehicle.radius  # they would hide the vehicle
        parts = (
            shapes.obstacles(moment.obstacles, moment.detected, veiled & self._following),
            shapes.vehicle(now[:12], self.vehicle.arm, scale),
            shapes.shadow(now[:3], self.world.lower[2], 1.15 * scale * self.vehicle.radius),
            shapes.path(moment.ticks[:, :3], max(0.02, 1.6 * unit)),
            shapes.plumb(now[:3], 0.8 * unit, outdoors.level if outdoors else 0.0),
            shapes.plumb(moment.goal, 0.8 * end),
            shapes.goal(moment.goal, self.world.goal_radius, pose, max(0.35, 8.0 * end), 1.6 * end),
            shapes.reference(now[12:15], pose, max(0.15, 4.5 * sent), max(0.014, 1.1 * sent)),
        )
        return np.vstack(parts if outdoors is None else (*parts, shapes.weather(outdoors, max(0.03, 1.4 * unit))))


@functools.lru_cache(_LABELS)
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


def _write(image: NDArray[np.uint8], text: str, colour: str) -> None:
    """Write a line in white on a colour into the lower left corner of a picture (h, w, 3)."""
    size = max(12, image.shape[0] // 24)
    margin = size // 2
    paint, opacity = _label(text, colour, size)
    if paint.shape[1] > image.shape[1] - margin:  # smaller letters rather than less of them
        size = max(8, size * (image.shape[1] - margin) // paint.shape[1])
        paint, opacity = _label(text, colour, size)
    paint, opacity = paint[:, : image.shape[1] - margin], opacity[:, : image.shape[1] - margin]
    part = image[-margin - paint.shape[0] : -margin, margin : margin + paint.shape[1]]
    part[:] = np.rint(part + opacity * (paint - part))
