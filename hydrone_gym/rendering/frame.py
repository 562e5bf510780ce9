"""One picture of a mission: what is known of a moment becomes shapes, and a ray caster paints them."""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering import caption, shapes
from hydrone_gym.rendering.backdrop import Box
from hydrone_gym.rendering.camera import Pose, chase, overview
from hydrone_gym.rendering.raycast import Canvas
from hydrone_gym.rendering.figures import camera_azimuth
from hydrone_gym.rendering.moment import Moment
from hydrone_gym.rendering.view import View
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World

_ELEVATION = 20.0  # degrees
_VEHICLE_PIXELS = 34.0  # how wide the vehicle is at least, from the overview
_OVERVIEW_SCALE = 2.5  # times its true size


class Painter:
    """Paints moments of one world with one vehicle.

    Args:
        view: size and camera.
        world: bounds, transition zone and what counts as arrival.
        vehicle: its arms are drawn as long as they are, times a scale for the overview.
    """

    def __init__(self, view: View, world: World, vehicle: Vehicle) -> None:
        """Work out what stays the same."""
        self.view, self.world, self.vehicle = view, world, vehicle
        bounds = np.array([world.lower, world.upper])
        self._canvas = Canvas(view.size)
        self._corners = np.array([[x, y, z] for x in bounds[:, 0] for y in bounds[:, 1] for z in bounds[:, 2]])

    def paint(self, moment: Moment) -> NDArray[np.uint8]:
        """Return a new picture (height, width, 3); equal moments give equal bytes."""
        following = self.view.camera == "chase"
        pose = self.pose(moment)
        position = moment.ticks[-1, :3]
        unit = self._unit(pose, position if following else np.zeros(3))
        widest = _VEHICLE_PIXELS * unit / (2.0 * self.vehicle.radius)
        scale = 1.0 if following else max(_OVERVIEW_SCALE, widest)
        box = Box(self.world.lower, self.world.upper, self.world.zone, float(following))
        image = self._canvas.picture(self._shapes(moment, pose, unit, scale), pose, box)
        caption.write(image, *caption.describe(moment.time, position[2], self.world.zone, moment.outcome))
        return image

    def pose(self, moment: Moment) -> Pose:
        """Return where a picture is taken from."""
        width, height = self.view.size
        if self.view.camera == "chase":
            return chase(moment.ticks[:, :3], moment.goal)
        azimuth = camera_azimuth(moment.ticks[0, :3].tolist(), moment.goal.tolist())
        return overview(self._corners, azimuth, _ELEVATION, width / height)

    def _unit(self, pose: Pose, point: NDArray[np.float64]) -> float:
        """How much a pixel covers at a point (m): thin things are measured in it, to stay visible in any picture."""
        return pose.pixel(self.view.size[1]) * float(np.linalg.norm(point - pose.eye))

    def _shapes(self, moment: Moment, pose: Pose, unit: float, scale: float) -> shapes.Shapes:
        """Everything that is drawn; `unit` (m) is a pixel at the path."""
        now = moment.ticks[-1]
        end, sent = (self._unit(pose, point) for point in (moment.goal, now[12:15]))
        return np.vstack(
            (
                shapes.spheres(moment.obstacles, moment.detected, self._veiled(moment, pose)),
                shapes.vehicle(now[:12], self.vehicle.arm, scale),
                shapes.shadow(now[:3], self.world.lower[2], 1.15 * scale * self.vehicle.radius),
                shapes.path(moment.ticks[:, :3], max(0.02, 1.6 * unit)),
                shapes.plumb(now[:3], 0.8 * unit),
                shapes.plumb(moment.goal, 0.8 * end),
                shapes.goal(moment.goal, self.world.goal_radius, pose, max(0.35, 8.0 * end), 1.6 * end),
                shapes.reference(now[12:15], pose, max(0.15, 4.5 * sent), max(0.014, 1.1 * sent)),
            )
        )

    def _veiled(self, moment: Moment, pose: Pose) -> NDArray[np.bool_]:
        """Which obstacles would hide the vehicle from a camera that follows it (M,); the overview hides nothing."""
        if self.view.camera == "overview":
            return np.zeros(len(moment.obstacles), bool)
        way = moment.ticks[-1, :3] - pose.eye
        offsets = moment.obstacles[:, :3] - pose.eye
        share = np.clip(offsets @ way / (way @ way), 0.0, 1.0)
        distance = np.linalg.norm(offsets - share[:, None] * way, axis=1)
        return distance < moment.obstacles[:, 3] + self.vehicle.radius
