"""The options of pictures, checked in one place, and the screen of an environment; nothing heavy is imported here."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import logger
from numpy.typing import NDArray

from hydrone_gym.simulation.simulation import Simulation

if TYPE_CHECKING:
    from hydrone_gym.rendering.track import Track

MODES = ("rgb_array", "human")
CAMERAS = ("overview", "chase")
LEAST, MOST = 64, 4096  # pixels


@dataclass(frozen=True, kw_only=True)
class View:
    """What a picture is like; see the docstring of `HydroneEnv`.

    Attributes:
        size: width and height, pixels; even, as video codecs demand.
        camera: "overview" or "chase".

    Raises:
        ValueError: a value out of range, naming the option, its rule and the value.
    """

    size: tuple[int, int] = (640, 480)
    camera: str = "overview"

    def __post_init__(self) -> None:
        """Check every option."""
        if self.camera not in CAMERAS:
            raise ValueError(f"camera must be one of {', '.join(map(repr, CAMERAS))}, got {self.camera!r}")
        if not _is_size(self.size):
            raise ValueError(
                f"render_size must be two even whole numbers from {LEAST} to {MOST} (pixels), got {self.size!r}"
            )
        object.__setattr__(self, "size", tuple(map(int, self.size)))


def _is_size(size: Any) -> bool:
    """Whether something is a width and a height."""
    if not isinstance(size, tuple | list) or len(size) != 2:
        return False
    return all(isinstance(n, int) and not isinstance(n, bool) and LEAST <= n <= MOST and n % 2 == 0 for n in size)


class Blank:
    """The screen of an environment that is not drawn: it keeps nothing and shows nothing."""

    def begin(self, n: int, rows: np.ndarray, seen: NDArray[np.uint8], obstacles: NDArray[np.float64]) -> None:
        """Row n begins a flight where it is now.

        Args:
            n: which row.
            rows: (rows,) dtype `ROW`.
            seen: (rows, M) 1 for a detected obstacle.
            obstacles: (k, 4) spheres x, y, z, r in m, k at most M.
        """

    def add(self, n: int, rows: np.ndarray, references: NDArray[np.float64]) -> None:
        """Row n is about to fly a period with its reference of (rows, 4), m and rad."""

    def update(self, rows: np.ndarray, seen: NDArray[np.uint8]) -> None:
        """A period has been flown."""

    def render(self, n: int, rows: np.ndarray, seen: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
        """Return a new picture of row n (height, width, 3), or None if it is shown in a window."""
        logger.warn('render() draws nothing without a render_mode; give one when making it: render_mode="rgb_array"')
        return None

    def track(self, n: int) -> "Track | None":
        """Return a copy of what row n has flown, if that is kept."""
        return None

    def restore(self, n: int, rows: np.ndarray, obstacles: NDArray[np.float64], track: "Track | None") -> None:
        """Row n goes on from another state, with what was flown up to there if that is known."""

    def close(self) -> None:
        """Nothing is drawn from now on."""


def new_screen(
    mode: str | None,
    size: tuple[int, int],
    camera: str,
    simulation: Simulation,
    modes: tuple[str, ...] = MODES,
) -> Blank:
    """Return what draws an environment.

    Args:
        mode: of `modes`, or None to draw nothing.
        size, camera: see `View`.
        simulation: the environment's.
        modes: those it knows.

    Raises:
        ValueError: an option out of range.
        DependencyNotInstalled: mode "human" without pygame.
    """
    view = View(size=size, camera=camera)
    if mode is None:
        return Blank()
    if mode not in modes:
        raise ValueError(f"render_mode must be one of None, {', '.join(map(repr, modes))}, got {mode!r}")
    from hydrone_gym.rendering.screen import Screen

    return Screen(view, simulation, window=mode == "human")
