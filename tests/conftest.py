"""Tests open no window on whoever's screen they run."""

import os

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
