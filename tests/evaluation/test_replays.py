"""The flights that show a policy: which they are, and that those linked from a page are those of the rows."""

import json
import shlex
from dataclasses import replace
from html import unescape
from urllib.parse import unquote

import numpy as np
import pytest

from hydrone_gym.cli import main
from hydrone_gym.evaluation.page import write_report
from hydrone_gym.evaluation.plan import make_plan, plan_of
from hydrone_gym.evaluation.records import read_records
from hydrone_gym.evaluation.run import carry_out
from hydrone_gym.evaluation.run_folder import RunFolder, write_results
from hydrone_gym.evaluation.shown import shown_flights
from hydrone_gym.evaluation.suites import load_suite
from tests.evaluation.test_page import Page, store
from tests.evaluation.test_records import ROW


def test_best_median_and_worst():
    ends = [("GOAL", 30.0), ("GOAL", 20.0), ("GOAL", 25.0), ("TIMEOUT", 120.0), ("COLLISION", 9.0), ("COLLISION", 4.0)]
    rows = [replace(ROW, world=w, outcome=o, success=o == "GOAL", time=t) for w, (o, t) in enumerate(ends)]
    (shown,) = shown_flights(rows)
    assert (shown.best.world, shown.median.world, shown.worst.world) == (1, 2, 5)
    (shown,) = shown_flights(rows[:4])
    assert shown.worst.outcome == "TIMEOUT"
    (shown,) = shown_flights(rows[:3])
    assert shown.worst.time == 30.0
    (shown,) = shown_flights([replace(row, policy="lost") for row in rows[3:]])
    assert (shown.best.world, shown.median.world, shown.worst.world) == (3, 4, 5)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A real evaluation of two policies in four worlds."""
    folder = tmp_path_factory.mktemp("flown")
    plan = make_plan("paper-20", ["straight-line", "potential-field"], worlds=2)
    records = carry_out(plan, RunFolder(folder, plan))
    write_results(plan, records, folder)
    return folder


def test_replays_are_those_of_the_rows(flown, tmp_path):
    seen = {}

    def write(flight, simulation, path, *, title):
        seen[path] = flight, simulation, title
        path.write_text(title)

    page = Page(write_report(flown, into=tmp_path, replay=write))
    links = {(tmp_path / unquote(link)) for link in page.all("href", "a") if link.startswith("replays/")}
    assert links == set(seen)
    assert "flown again" not in page.text
    shown = shown_flights(read_records(flown / "rows.csv"))
    times = {record.time for entry in shown for record in (entry.best, entry.median, entry.worst)}
    assert {flight.time for flight, _, _ in seen.values()} == times
    worst = tmp_path / "replays" / "1-straight-line-worst.html"
    assert seen[worst][2] == f"straight-line, worst flight: paper-20-v1, {shown[0].worst.mission}, world " + str(
        shown[0].worst.world
    )
    np.testing.assert_array_equal(
        seen[worst][0].scenario.obstacles,
        {m.name: m for m in load_suite("paper-20").missions}[shown[0].worst.mission]
        .scenarios[shown[0].worst.world]
        .obstacles,
    )


def test_a_flight_that_ends_otherwise_is_marked(flown, tmp_path):
    rows = read_records(flown / "rows.csv")
    plan = make_plan("paper-20", ["straight-line", "potential-field"], worlds=2)
    store(tmp_path, plan, [replace(row, time=row.time + 1.0) for row in rows])
    page = Page(write_report(tmp_path, replay=lambda flight, simulation, path, *, title: path.write_text(title)))
    assert page.text.count("flown again") == sum(link.startswith("replays/") for link in page.all("href", "a"))


def test_without_replays_the_page_tells_how_to_make_one(flown, tmp_path, monkeypatch):
    text = write_report(flown, into=tmp_path).read_text(encoding="utf-8")
    command = shlex.split(unescape(text[text.index("<pre>") + 5 : text.index("</pre>")]))
    worst = shown_flights(read_records(flown / "rows.csv"))[0].worst
    assert command[:3] == ["hydrone", "replay", "."]
    assert f"--world={worst.world}" in command
    monkeypatch.chdir(tmp_path)
    assert main(command[1:]) == 0
    assert "straight-line" in (tmp_path / "replay.html").read_text(encoding="utf-8")


def test_the_command_writes_the_report(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["evaluate", "--policies", "straight-line", "--worlds", "1", "--backend", "threading", "--report"]
    assert main([*options, "page"]) == 0
    assert "page/report.html" in capsys.readouterr().out
    links = Page(tmp_path / "page" / "report.html").all("href", "a")
    assert all((tmp_path / "page" / unquote(link)).is_file() for link in links if not link.startswith("#"))
    assert any(link.startswith("replays/") for link in links)
    assert main([*options, "bare", "--no-replays"]) == 0
    assert "hydrone replay ." in (tmp_path / "bare" / "report.html").read_text(encoding="utf-8")
    (tmp_path / "file").touch()
    assert main([*options, "file"]) == 2
    assert "file" in capsys.readouterr().err


def test_the_plan_is_found_again_or_refused(flown):
    arguments = json.loads((flown / "summary.json").read_text())["arguments"]
    plan = make_plan("paper-20", ["straight-line", "potential-field"], worlds=2)
    assert plan_of(arguments).keys() == plan.keys()
    assert plan_of(arguments).suites == plan.suites
    with pytest.raises(ValueError, match="suite paper-20-v1: its worlds are not those that were flown"):
        plan_of({**arguments, "suites": {"paper-20-v1": "0"}})
    with pytest.raises(FileNotFoundError, match="no suite 'gone'"):
        plan_of({**arguments, "suites": {"gone": "0"}, "worlds": {"gone": {"m": 1}}})
