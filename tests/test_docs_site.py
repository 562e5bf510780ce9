"""The documentation builds as a site, without a warning, and its pages are all reachable."""

import re
import sys
from pathlib import Path

from tests.processes import completed

DOCS = Path(__file__).resolve().parent.parent / "docs"


def test_the_site_builds_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", str(DOCS), str(tmp_path / "site")]
    done = completed([*command, "-d", str(tmp_path / "trees")], 300.0)
    assert done.returncode == 0, done.stderr
    index = (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    for page in DOCS.glob("*.md"):
        built = tmp_path / "site" / f"{page.stem}.html"
        assert built.exists()
        assert page.stem == "index" or f'href="{page.stem}.html"' in index
    api = (tmp_path / "site" / "api.html").read_text(encoding="utf-8")
    assert len(re.findall(r'<dt class="sig', api)) > 60
    assert "Observation Space" in (tmp_path / "site" / "environment.html").read_text(encoding="utf-8")
