"""Writes the commit into what is built to be installed, where `provenance.commit` finds it."""

import runpy
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PROVENANCE = "hydrone_gym/evaluation/provenance.py"


class CommitHook(BuildHookInterface):
    """Adds one file to a wheel and to a source distribution; one made from the latter has it already."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Ask Git, unless the build is editable and will ask for itself whenever it is run."""
        known = runpy.run_path(str(Path(self.root) / PROVENANCE))
        if version == "editable" or known["BUILT"].exists() or (commit := known["commit"]()) is None:
            return
        self._folder = tempfile.TemporaryDirectory()
        file = Path(self._folder.name) / known["BUILT"].name
        file.write_text(f"{commit}\n", encoding="utf-8")
        build_data["force_include"][str(file)] = f"{Path(PROVENANCE).parent.as_posix()}/{file.name}"
