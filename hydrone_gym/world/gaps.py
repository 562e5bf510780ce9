"""How near straight paths come to spheres, for Python code; kernels use `hydrone_gym.world.obstacles`."""

import sys

import numpy as np
from numpy.typing import NDArray


def gaps_along(a: NDArray[np.float64], b: NDArray[np.float64], spheres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the least distances (M,) in m from the straight path between two points (3,) to the surfaces of spheres.

    Args:
        a, b: ends of the path, m.
        spheres: (M, 4) x, y, z, r in m.
    """
    along, offset = b - a, spheres[:, :3] - a
    share = np.clip(offset @ along / max(float(along @ along), sys.float_info.min), 0.0, 1.0)
    return np.linalg.norm(offset - share[:, None] * along, axis=1) - spheres[:, 3]
