"""Sphinx settings of the documentation: `sphinx-build -W docs docs/_build`."""

import inspect
import sys
from importlib import import_module
from pathlib import Path

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

project = "hydrone_gym"
author = "The hydrone_gym developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
default_role = "code"  # docstrings quote names with single backticks
nitpicky = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_default_options = {"members": True, "show-inheritance": False}
# Only what runs without it is imported: the pages build with the core install and the extra `docs`.
autodoc_mock_imports = ["stable_baselines3", "torch", "viser", "pygame"]
html_theme = "furo"
html_title = "hydrone_gym"
suppress_warnings = ["myst.xref_missing"]  # pages link to files of the repository, which are not pages


class MarkdownDocstring(SphinxDirective):
    """Put the docstring of an object, written in Markdown with Gymnasium's headings, into a Markdown page."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Parse the docstring where the directive stands, headings one level below the page's."""
        module, _, name = self.arguments[0].rpartition(".")
        text = inspect.getdoc(getattr(import_module(module), name)) or ""
        return self.parse_text_to_nodes("\n".join(StringList(text.splitlines())), allow_section_headings=True)


def setup(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("markdown-docstring", MarkdownDocstring)
