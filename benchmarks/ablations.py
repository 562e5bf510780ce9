"""The CL-RRT with one of its safety ingredients taken away, as policies for `hydrone evaluate`:

    hydrone evaluate --suites paper-20 dense-40 --worlds 200 --policies clrrt \
        no-stop=benchmarks.ablations:without_verified_stop no-replay=benchmarks.ablations:without_replay \
        no-margin=benchmarks.ablations:without_margins neither=benchmarks.ablations:with_none

The last four are of the CL-RRT that is ready for weather, for `benchmarks.weather_factors --policies clrrt-weather
no-estimate=benchmarks.ablations:weather_without_estimate ...`.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planners import CLRRT, CLRRTSettings
from planners.disturbance import Estimator, Sight
from planners.named import clrrt_weather, level_of
from planners.policy import Known


def without_verified_stop(env: Any) -> CLRRT:
    """Edges are sent without a look at whether the vehicle can stop after them."""
    return CLRRT.for_env(env, settings=CLRRTSettings(verify=False))


def without_replay(env: Any) -> CLRRT:
    """A path is sent as it was grown, not propagated again from the state observed now."""
    return CLRRT.for_env(env, settings=CLRRTSettings(re_propagate=False))


def without_margins(env: Any) -> CLRRT:
    """Edges and stops may graze what is known."""
    return CLRRT.for_env(env, settings=CLRRTSettings(margin=0.0, rest_margin=0.0))


def with_none(env: Any) -> CLRRT:
    """None of the three."""
    return CLRRT.for_env(env, settings=CLRRTSettings(verify=False, re_propagate=False, margin=0.0, rest_margin=0.0))


class Unmoved(Estimator):
    """Believes in still air and still water, whatever it sees."""

    def look(self, now: Known, before: Sight | None) -> None:
        """Remember nothing."""


def weather_without_estimate(env: Any) -> CLRRT:
    """Nobody estimates the disturbance; margins and rules of weather stay."""
    planner = clrrt_weather(env)
    planner.estimator = Unmoved(planner.belief, weathered=level_of(env) > 0)
    return planner


def weather_without_margins(env: Any) -> CLRRT:
    """Edges and stops keep from spheres what they keep in still weather."""
    return clrrt_weather(env, settings=CLRRTSettings())


def weather_without_verified_stop(env: Any) -> CLRRT:
    """Edges are sent without a look at whether the vehicle can stop, or get away, after them."""
    return clrrt_weather(env, settings=replace(clrrt_weather(env).settings, verify=False))


class NearWalls(CLRRT):
    """Keeps from the walls what it keeps in still weather, also where crossings begin."""

    def _packed_settings(self, share: float, prune: bool) -> NDArray[np.float64]:
        self.caution = self.caution._replace(room=0.0, drift=0.0)
        return super()._packed_settings(share, prune)


def weather_without_room(env: Any) -> CLRRT:
    """Crossings begin, and edges lead, as near to the walls as in still weather."""
    return NearWalls.for_env(env, level=level_of(env))
