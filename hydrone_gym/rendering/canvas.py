"""From shapes and a camera to a picture: what the ray caster needs to know beforehand."""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.rendering.backdrop import Box
from hydrone_gym.rendering.camera import Pose, outlines
from hydrone_gym.rendering.raycast import TILE, cast
from hydrone_gym.rendering.solids import CAPSULE

_LAYERS = 32  # translucent things kept along one ray, the nearest


class Canvas:
    """Makes pictures of one size; from a camera that stands still it keeps the picture without shapes.

    Args:
        size: width and height, pixels.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        """Know nothing yet."""
        self.size = size
        self._view: bytes = b""
        self._still: tuple[NDArray[np.uint8], NDArray[np.int64]] | None = None

    def picture(self, shapes: NDArray[np.float64], pose: Pose, box: Box) -> NDArray[np.uint8]:
        """Return a new picture (height, width, 3), the same whether or not one from there has been made before.

        Args:
            shapes: (n, len(SHAPE_FIELDS)), m, and colours from 0 to 1.
            pose: the camera.
            box: the world.
        """
        view = np.array([*pose.eye, *pose.right, *pose.up, *pose.forward, *box]).tobytes()
        if view != self._view:
            self._view, self._still = view, None
        elif self._still is None:  # worth it from the second picture on
            self._still = self._blank()
            self._cast(*self._still, False, shapes[:0], pose, box)
        image, marks = self._still or self._blank()
        image, marks = image.copy(), marks.copy()
        self._cast(image, marks, self._still is not None, shapes, pose, box)
        return image

    def _blank(self) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        """Return an empty picture and what its pixels see."""
        width, height = self.size
        return np.zeros((height, width, 3), np.uint8), np.zeros((height, width), np.int64)

    def _cast(
        self,
        image: NDArray[np.uint8],
        marks: NDArray[np.int64],
        known: bool,
        shapes: NDArray[np.float64],
        pose: Pose,
        box: Box,
    ) -> None:
        """Paint a picture, over the one without shapes if that is known."""
        ends = np.stack((shapes[:, 1:4], np.where(shapes[:, :1] == CAPSULE, shapes[:, 4:7], shapes[:, 1:4])), axis=1)
        begins, items = _sort_into_tiles(outlines(pose, ends, shapes[:, 7], self.size, TILE), self.size)
        camera = np.array([*pose.eye, *pose.right, *pose.up, *pose.forward, pose.pixel(self.size[1])])
        geometry, layers = _prepare(shapes, pose.eye), (np.empty(_LAYERS), np.empty(_LAYERS, np.int64))
        cast(image, marks, known, shapes, geometry, begins, items, *layers, camera, np.array(box))


def _prepare(shapes: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.float64]:
    """Work out what is the same for every ray from an eye (3,) in m.

    Returns:
        (n, 9): 0-2 from a to the eye; 3-5 from a to b of a capsule, b itself of a disc; 6 that one squared; 7 its
        product with the first; 8 the first squared less the radius squared.
    """
    offset, other = eye - shapes[:, 1:4], shapes[:, 4:7] - np.where(shapes[:, :1] == CAPSULE, shapes[:, 1:4], 0.0)
    squares = [(other * other).sum(axis=1), (other * offset).sum(axis=1), (offset * offset).sum(axis=1)]
    squares[2] -= shapes[:, 7] ** 2
    return np.ascontiguousarray(np.column_stack((offset, other, *squares)))


def _sort_into_tiles(outlines: NDArray[np.int64], size: tuple[int, int]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which shapes each tile of a picture has to look for.

    Args:
        outlines: (n, 4) first column and row, last column and row of the tiles each shape can reach, last excluded.
        size: width and height of the picture, pixels.

    Returns:
        (tiles + 1,) where each tile's shapes begin in the second, and (m,) shapes, tile by tile.
    """
    columns, rows = (-(-pixels // TILE) for pixels in size)
    wide, high = outlines[:, 2] - outlines[:, 0], outlines[:, 3] - outlines[:, 1]
    counts = wide * high
    items = np.repeat(np.arange(len(outlines)), counts)
    place = np.arange(len(items)) - np.repeat(np.cumsum(counts) - counts, counts)
    column = outlines[items, 0] + place % wide[items]
    tile = (outlines[items, 1] + place // wide[items]) * columns + column
    order = np.argsort(tile, kind="stable")
    return np.searchsorted(tile[order], np.arange(columns * rows + 1)), items[order]
