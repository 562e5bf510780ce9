"""What the documentation says of a million flights is what was measured."""

import json
from pathlib import Path

from benchmarks.scale import sheets

ROOT = Path(__file__).resolve().parents[2]


def test_the_tables_of_the_documentation_are_those_of_the_results():
    measured = json.loads((ROOT / "benchmarks" / "results" / "scale.json").read_text(encoding="utf-8"))
    page = (ROOT / "docs" / "evaluation.md").read_text(encoding="utf-8")
    flights, drivers, folder = sheets(measured)
    for sheet in (flights, drivers):
        assert sheet.markdown().partition("\n\n")[2].strip() in page
    assert all(figure in page for _, figure in folder.rows)


def test_a_million_of_what_takes_a_second():
    measured = {
        "flights": {"clrrt": 0.09, "fast": 0.0005},
        "driver": {"ray": 0.003},
        "checkpoint": {"bytes": 250.0, "read": 5e-5, "memory": 1000.0, "sum": 0.0001},
    }
    flights, drivers, folder = sheets(measured)
    assert flights.rows == [("clrrt", "90.0", "11", "25.0"), ("fast", "0.5", "2,000", "0.1")]
    assert drivers.rows == [("ray", "3.00", "50", "30")]
    assert [figure for _, figure in folder.rows] == ["250 MB", "50 s", "1.0 GB", "100 s"]
