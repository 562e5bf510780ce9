"""Why nothing seems to happen on the first run after an install: each kernel that is compiled is named meanwhile."""

import functools
import sys
from typing import Any


@functools.cache
def tell_compiling() -> None:
    """From now on say on stderr which kernel is being compiled; one that is loaded from the cache is not told."""
    from numba.core import event

    class Teller(event.Listener):
        depth = 0  # kernels compile others that they are made of

        def on_start(self, event: Any) -> None:
            if self.depth == 0:
                function = event.data["dispatcher"].py_func
                print(COMPILING.format(f"{function.__module__}.{function.__name__}"), file=sys.stderr, flush=True)
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1

    event.register("numba:compile", Teller())


COMPILING = "hydrone: compiling {} (once after an install)"
