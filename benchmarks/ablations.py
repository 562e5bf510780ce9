"""The CL-RRT with one of its safety ingredients taken away, as policies for `hydrone evaluate`:

    hydrone evaluate --suites paper-20 dense-40 --worlds 200 --policies clrrt \
        no-stop=benchmarks.ablations:without_verified_stop no-replay=benchmarks.ablations:without_replay \
        no-margin=benchmarks.ablations:without_margins neither=benchmarks.ablations:with_none
"""

from typing import Any

from planners import CLRRT, CLRRTSettings


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
