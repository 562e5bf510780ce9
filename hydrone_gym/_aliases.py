"""`hydrone_gym.planners` and `hydrone_gym.agents`: the packages `planners` and `agents` by names that are taken once.

The same modules under two names, and imported when asked for: this package itself knows neither.
"""

import importlib
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType

_NAMES = ("hydrone_gym.planners", "hydrone_gym.agents")


class _Aliases(MetaPathFinder, Loader):
    """Finds a module of one of the names, or below it, as the one without `hydrone_gym` before it."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return a spec for what there is under the other name; None for anything else."""
        if not fullname.startswith(_NAMES) or ".".join(fullname.split(".")[:2]) not in _NAMES:
            return None
        found = find_spec(fullname.removeprefix("hydrone_gym."))
        return found and ModuleSpec(fullname, self, is_package=found.submodule_search_locations is not None)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module itself; its own spec waits in the other one."""
        module = importlib.import_module(spec.name.removeprefix("hydrone_gym."))
        spec.loader_state = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module, which has run already, its own spec back."""
        if module.__spec__ is not None:
            module.__spec__ = module.__spec__.loader_state


sys.meta_path.insert(0, _Aliases())
