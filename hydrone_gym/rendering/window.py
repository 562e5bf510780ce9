"""A window on the screen through pygame, for `render_mode="human"`."""

import os
from typing import Any, ClassVar

import numpy as np
from gymnasium import logger
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray


class Window:
    """Shows pictures until it is closed, by its user or by the program.

    A process has one window; environments that are shown at the same time share it. A copy of a window stays closed.
    Without a display it warns once and shows nothing.

    Args:
        size: width and height, pixels.

    Raises:
        DependencyNotInstalled: pygame is missing.
    """

    _shown: ClassVar[int] = 0  # windows of this process that are open

    def __init__(self, size: tuple[int, int]) -> None:
        """Look for pygame; the window opens with its first picture."""
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
