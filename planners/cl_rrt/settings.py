"""Settings of the CL-RRT, checked once and flattened for the kernels."""

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

from planners.caution import CALM, Caution

_SWITCHES = ("re_propagate", "verify")


class SettingParams(NamedTuple):
    """`CLRRTSettings` as the kernels read it."""

    goal_bias: float
    column_bias: float
    column_radius: float
    margin: float
    rest_margin: float
    tries: float
    extension: float
    re_propagate: float  # 1: paths are propagated again before their first edge is sent
    verify: float  # 1: an edge is sent only if it was seen to be followed by a stop
    step: float  # m an edge in air may move its reference: the safe speed times the period
    prune: float  # 1: samples that cannot beat the best path are dropped
    room: float  # distance (m) to keep from the walls
    crossing_speed: float  # limits of planned crossings: lateral, m/s
    crossing_cos_tilt: float
    drift: float  # m from the walls that a water entry keeps


@dataclass(frozen=True, kw_only=True)
class CLRRTSettings:
    """What a user may tune.

    Attributes:
        goal_bias: share of samples that are the goal.
        column_bias: share of samples that are crossing columns, while the mission must still change medium.
        column_radius: columns are sampled within this distance of the water-side end, m.
        margin: clearance that planned edges keep, m.
        rest_margin: clearance that the verified stop keeps, m.
        tries: nodes tried in sorted order for one sample.
        extension: longest extension toward one sample, edges of half a second.
        max_nodes: size of the tree.
        re_propagate: whether the path chosen is propagated again before it is sent; False only to see what that is for.
        verify: whether an edge must be seen to be followed by a stop; False only to see what it is for.

    Raises:
        ValueError: a value out of range, named.
    """

    goal_bias: float = 0.25
    column_bias: float = 0.35
    column_radius: float = 5.0
    margin: float = CALM.edge_margin
    rest_margin: float = CALM.rest_margin
    tries: int = 3
    extension: int = 12
    max_nodes: int = 2000
    re_propagate: bool = True
    verify: bool = True

    def __post_init__(self) -> None:
        """Check every field."""
        for spec in dataclasses.fields(self):
            value = getattr(self, spec.name)
            if spec.name in _SWITCHES:
                if not isinstance(value, bool):
                    raise ValueError(f"CLRRTSettings.{spec.name} must be True or False, got {value!r}")
                continue
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < 0:
                raise ValueError(f"CLRRTSettings.{spec.name} must be a number that is not negative, got {value!r}")
        if self.goal_bias + self.column_bias > 1:
            raise ValueError(
                "CLRRTSettings.goal_bias + column_bias must not exceed 1, "
                f"got {self.goal_bias!r} + {self.column_bias!r}"
            )
        for name, least in (("tries", 1), ("extension", 1), ("max_nodes", 100)):
            value = getattr(self, name)
            if not isinstance(value, int) or value < least:
                raise ValueError(f"CLRRTSettings.{name} must be a whole number of at least {least}, got {value!r}")

    def params(self, step: float, caution: Caution = CALM, *, prune: bool = True) -> SettingParams:
        """Flatten for the kernels.

        Args:
            step: how far an edge in air may move its reference, m.
            caution: what else is kept from walls and at the surface.
            prune: whether samples that cannot beat the best path are dropped.
        """
        values = (getattr(self, name) for name in SettingParams._fields[: SettingParams._fields.index("step")])
        plain = (float(value) if isinstance(value, bool) else value for value in values)
        rules = caution.room, caution.crossing_speed, math.cos(caution.crossing_tilt), caution.drift
        return SettingParams._make([*plain, step, float(prune), *rules])
