"""Why nothing seems to happen on the first run after an install."""

import sys
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.policies import PolicySource
from hydrone_gym.simulation.rows import advance_rows
from planners.cl_rrt.execute import cycle
from planners.stop_check import guard

COMPILING = "compiling kernels (once after install, about 30 s)"

_PARTS = {"CLRRT": cycle, "shield": guard}  # what the origin of a policy that uses a kernel has in it


def kernels_of(*policies: PolicySource) -> list[Any]:
    """Return the large kernels that flights with these policies are known to need."""
    return [advance_rows, *(kernel for part, kernel in _PARTS.items() if any(part in p.origin for p in policies))]


def announce_compiling(*kernels: Any) -> None:
    """Say on stderr that kernels are compiled, if one of these large ones is not in the cache yet."""
    folders = [kernel.stats.cache_path for kernel in kernels]
    if not all(folder and any(Path(folder).glob("*.nbi")) for folder in folders):
        print(COMPILING, file=sys.stderr, flush=True)
