"""A complete snapshot of an environment: enough to go on bit for bit, in this process or another."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs.options import Options
from hydrone_gym.envs.task import Episodes
from hydrone_gym.rendering.track import Track
from hydrone_gym.world.scenario import Scenario


@dataclass(frozen=True, kw_only=True, eq=False)
class Snapshot:
    """What `HydroneEnv.get_state` returns; picklable, shares no memory with the environment.

    Attributes:
        options: the options of the environment it was taken from; only such an environment can restore it.
        scenario: the mission being flown.
        episodes: state, memory, distances and detections.
        transitions: the crossings so far.
        random_state: state of the bit generator that draws scenarios.
        seed: the seed it was made from.
        egocentric: memory and last observation of `interface="egocentric"`.
        track: the path flown so far, for pictures; None from an environment without `render_mode`.
    """

    options: Options
    scenario: Scenario
    episodes: Episodes
    transitions: tuple[dict[str, Any], ...]
    random_state: dict[str, Any]
    seed: int | None
    egocentric: tuple[NDArray[np.float64], NDArray[np.float32]]
    track: Track | None = None

    def check_options(self, options: Options) -> None:
        """Raise ValueError naming every option in which another environment differs."""
        differing = [
            f"{name} (snapshot {getattr(self.options, name)!r}, here {getattr(options, name)!r})"
            for name in self.options.differences(options)
        ]
        if differing:
            raise ValueError(f"snapshot is of an environment with other options: {', '.join(differing)}")
