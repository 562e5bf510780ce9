"""What an environment holds to be drawn: the tracks of its rows, and pictures or a window made of them."""

import os
import time
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium import logger
from gymnasium.error import DependencyNotInstalled, ResetNeeded
from numpy.typing import NDArray

from hydrone_gym.rendering.camera import View
from hydrone_gym.rendering.track import Moment, Track, moments
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.simulation import STILL, TICK, Simulation

MODES = ("rgb_array", "human")


class Screen:
    """Draws the rows of one environment and never changes them; without a mode it keeps nothing and shows nothing.

    Args:
        mode: of `modes`; "human" shows row 0 in a window, tick by tick and in real time, instead of returning pictures.
        size, camera: see `View`.
        simulation: the environment's; a twin is made, as its working storage is in use.
        modes: those that the environment knows; ValueError for another.
    """

    def __init__(
        self, mode: str | None, size: tuple[int, int], camera: str, simulation: Simulation, modes: Sequence[str] = MODES
    ) -> None:
        view = View(size=size, camera=camera)
        if mode is not None and mode not in modes:
            raise ValueError(f"render_mode must be one of None, {', '.join(map(repr, modes))}, got {mode!r}")
        self._tracks: dict[int, Track] = {}
        self._shown = 0  # ticks of row 0 that the window has shown
        self._painter, self._window = None, None
        if mode is not None:  # what is heavy is imported by environments that are drawn
            from hydrone_gym.rendering.frame import Painter

            self._simulation = Simulation(simulation.vehicle, simulation.world, simulation.period, law=simulation.law)
            self._painter = Painter(view, simulation.world, simulation.vehicle)
            self._window = Window(view.size) if mode == "human" else None

    def begin(
        self,
        n: int,
        rows: np.ndarray,
        seen: NDArray[np.uint8],
        obstacles: NDArray[np.float64],
        conditions: NDArray[np.float64] = STILL,
    ) -> None:
        """Row n of rows (N,) of dtype `ROW` begins a flight where it is, among obstacles (k, BODY), in its conditions.

        Of `seen` (N, M), M at least k, a detected obstacle has 1.
        """
        self.restore(n, rows, obstacles, None, conditions)
        self._shown = 0
        self.update(rows, seen)

    def add(
        self, n: int, rows: np.ndarray, references: NDArray[np.float64], conditions: NDArray[np.float64] = STILL
    ) -> None:
        """Row n is about to fly a period with its reference of (rows, 4), m and rad, in its conditions, if any."""
        if n in self._tracks:
            self._tracks[n].add(rows[n : n + 1], references[n], conditions)

    def go_out(self, weathered: bool, extra: type | None) -> None:
        """From now on fly in weather, with a disturbance of a class, or without."""
        if self._painter is not None:
            self._simulation = self._simulation.flown_in(weathered, extra)

    def update(self, rows: np.ndarray, seen: NDArray[np.uint8]) -> None:
        """Show the rest in the window, if any, in real time; a machine too slow skips pictures, never the last."""
        window = self._window
        if self._painter is None or window is None or window.closed:
            return
        last = self._moment(0, rows, seen)
        counts = range(self._shown + 1, len(last.ticks) + 1)
        self._shown = len(last.ticks)
        due = time.monotonic()
        for moment in moments(last, counts, self._simulation.world.sensor_range):
            due += TICK
            if moment is not last and time.monotonic() > due:
                continue
            window.show(self._painter.paint(moment))
            if window.closed:
                return
            time.sleep(max(0.0, due - time.monotonic()))

    def render(self, n: int, rows: np.ndarray, seen: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
        """Return a new picture of row n (height, width, 3), or show it; ResetNeeded before its first episode."""
        if self._painter is None:
            logger.warn('render() draws nothing without a render_mode, such as render_mode="rgb_array"')
            return None
        if n not in self._tracks:
            raise ResetNeeded("there is nothing to draw before the first reset: call reset()")
        if self._window is None:
            return self._painter.paint(self._moment(n, rows, seen))
        self._shown -= 1
        self.update(rows, seen)
        return None

    def track(self, n: int) -> Track | None:
        """Return a copy of what row n has flown, if that is kept."""
        return self._tracks[n].copy() if n in self._tracks else None

    def restore(
        self,
        n: int,
        rows: np.ndarray,
        obstacles: NDArray[np.float64],
        track: Track | None,
        conditions: NDArray[np.float64] = STILL,
    ) -> None:
        """Row n goes on from another state, in conditions (1, CONDITIONS); without a track its path begins there."""
        if self._painter is not None:
            begun = Track(rows[n : n + 1], obstacles, conditions) if track is None else track.copy()
            self._tracks[n] = begun
            self._shown = len(self._tracks[n].ticks(self._simulation))

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def _moment(self, n: int, rows: np.ndarray, seen: NDArray[np.uint8]) -> Moment:
        track = self._tracks[n]
        detected = seen[n, : len(track.obstacles)] != 0
        clock, outcome = float(rows["ticks"][n]) * TICK, Outcome(int(rows["outcome"][n]))
        return Moment(track.ticks(self._simulation), track.goal, track.obstacles, detected, clock, outcome)


class Window:
    """Shows pictures of a size through pygame, from the first on, until its user or the program closes it.

    A process has one window; environments that are shown at the same time share it. A copy of a window stays closed.
    Without a display it warns once and shows nothing; without pygame it raises DependencyNotInstalled.
    """

    _shown: ClassVar[int] = 0  # windows of this process that are open

    def __init__(self, size: tuple[int, int]) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # it would stand in the output of programs
        try:
            import pygame
        except ImportError as error:
            raise DependencyNotInstalled(
                'render_mode="human" needs pygame, part of the extra "render": pip install "hydrone-gym[render]"'
            ) from error
        self.size, self._pygame = size, pygame
        self.closed = False
        self._surface: Any = None

    def show(self, image: NDArray[np.uint8]) -> None:
        """Show a picture (height, width, 3); a window that its user has closed stays closed."""
        if self.closed or (self._surface is None and not self._open()):
            return
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            self.close()
            return
        self._pygame.surfarray.blit_array(self._surface, image.swapaxes(0, 1))
        self._pygame.display.flip()

    def _open(self) -> bool:
        """Open the window; return whether there is one now."""
        try:
            self._pygame.display.init()
            self._surface = self._pygame.display.set_mode(self.size)
        except self._pygame.error as error:
            logger.warn(f'render_mode="human" shows nothing: {error}')
            self.closed = True
            return False
        self._pygame.display.set_caption("hydrone_gym")
        Window._shown += 1
        return True

    def close(self) -> None:
        """Close the window for good; a second call does nothing."""
        self.closed = True
        if self._surface is None:
            return
        self._surface = None
        Window._shown -= 1
        if Window._shown == 0:
            self._pygame.display.quit()

    def __getstate__(self) -> dict[str, Any]:
        return {"size": self.size, "closed": True, "_surface": None}


new_screen = Screen  # what environments call
