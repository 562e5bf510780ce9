"""The notebook runs from top to bottom, and its policy is flown, scored and plotted."""

import json
import os
import sys
from pathlib import Path

import nbformat
import pytest
from jupyter_client.kernelspec import KernelSpec
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parent.parent
PATH = ROOT / "docs" / "notebooks" / "own_policy.ipynb"


@pytest.fixture
def notebook():
    return nbformat.read(PATH, as_version=4)


def kernel_of_this_interpreter():
    """Whatever kernels are installed beside it."""
    manager = AsyncKernelManager()
    words = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    manager._kernel_spec = KernelSpec(argv=words, display_name="this", language="python")
    return manager


def test_it_runs_with_few_worlds(notebook, tmp_path, monkeypatch):
    (install,) = [cell for cell in notebook.cells if "install" in cell.metadata.get("tags", ())]
    assert install.source.startswith("%pip install")
    notebook.cells.remove(install)
    (worlds,) = [cell for cell in notebook.cells if cell.source.startswith("WORLDS = ")]
    worlds.source = "WORLDS = 1"
    monkeypatch.delenv("MPLBACKEND", raising=False)  # else the kernel shows no figures
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    resources = {"metadata": {"path": str(tmp_path)}}
    client = NotebookClient(notebook, timeout=480, resources=resources, km=kernel_of_this_interpreter())
    client.execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert sum("image/png" in output.get("data", {}) for output in outputs) == 3
    told = "".join(output.get("text", "") for output in outputs)
    assert "GOAL" in told
    summary = json.loads((tmp_path / "evaluation" / "summary.json").read_text())
    scores = {entry["policy"]: entry["score"]["value"] for entry in summary["missions"][-1]["policies"]}
    assert scores["mine+shield"] > 0.3
    (table,) = [output["data"]["text/markdown"] for output in outputs if "text/markdown" in output.get("data", {})]
    assert "mine+shield" in table


def test_it_is_stored_without_outputs(notebook):
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)
