"""The Python in docs/ runs, page by page."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parent.parent / "docs"
# training.md trains for minutes; tests/agents/test_train_command.py runs its example with fewer steps.
PAGES = sorted(
    page for page in DOCS.glob("*.md") if "```python" in page.read_text(encoding="utf-8") and page.name != "training.md"
)


def test_there_is_code_to_run():
    assert PAGES


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_blocks_run_in_order(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in re.findall(r"^```python\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        exec(compile(block, page.name, "exec"), names)
