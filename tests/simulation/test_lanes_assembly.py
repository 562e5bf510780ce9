"""The sixteen-lane kernel really runs its lanes side by side: its machine code shows it.

A building block that is not inlined, an exception below the substep, a call into the C library, or a value loaded on
one side of a choice only: each leaves results right and turns a loop over lanes into sixteen scalar passes.
"""

import platform
import re

import llvmlite.binding
import pytest

from hydrone_gym import _jit
from hydrone_gym.control.laws import LAWS
from hydrone_gym.simulation.advance import compiled
from hydrone_gym.simulation.storage import LANES

LIBM = ("sin", "cos", "sincos", "tan", "atan", "atan2", "hypot", "pow", "fmod", "exp", "log")
# LLVM finds lanes of two, all that SSE has, not worth the selects.
wide_x86_only = pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or not llvmlite.binding.get_host_cpu_features().get("avx2"),
    reason="reads the names of x86-64 instructions, and needs AVX2",
)


@pytest.fixture(scope="module", params=LAWS)
def library(request):
    """Compiled anew, as Numba keeps no assembly of cached kernels."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_jit, "cache_root", lambda: None)
        return compiled.__wrapped__(request.param, LANES)._library


@pytest.fixture(scope="module")
def assembly(library):
    return library.get_asm_str()


def count(assembly, operation, kind):
    """Number of instructions: operation add, sub, mul, div or sqrt; kind "pd" packed, "sd" scalar doubles."""
    return len(re.findall(rf"^\s+v?{operation}{kind}\s", assembly, re.MULTILINE))


def test_nothing_calls_the_c_library_for_arithmetic(assembly):
    # acos is allowed: it is called once a crossing, outside the loops over lanes
    instructions = [line for line in assembly.splitlines() if re.match(r"^\s+[a-z]", line)]
    called = {name for line in instructions for name in LIBM if re.search(rf"[\s$]{name}(@\w+)?(,|\s|$)", line)}
    assert not called, f"calls to {sorted(called)} keep lanes from running side by side"


def test_every_building_block_is_inlined(assembly):
    names = re.findall(r"^(\S*hydrone_gym\S*):", assembly, re.MULTILINE)
    outside = [name for name in names if "unit_of_law" not in name.split("B")[0]]
    assert not outside, f"not inlined: {outside}"


@wide_x86_only
def test_square_roots_are_packed(assembly, library):
    # six drags, three lengths in air, a length and four thrusts in water, one distance to a sphere
    assert count(assembly, "sqrt", "pd") >= 15
    # the log of crossings, which is not a loop over lanes, and the sweep's way out for overlapping arrays
    assert library.get_llvm_str().count("call double @llvm.sqrt.f64") <= 2


@wide_x86_only
@pytest.mark.parametrize("operation", ["mul", "add"])
def test_hardly_any_arithmetic_is_scalar(assembly, operation):
    """Also finds a loop without roots that fell back: the judgement of a tick has only products and sums."""
    packed, scalar = count(assembly, operation, "pd"), count(assembly, operation, "sd")
    assert scalar <= 0.15 * packed, f"{scalar} scalar {operation}, {packed} packed"
