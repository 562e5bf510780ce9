"""`hydrone replay`: fresh flights, saved ones, those of an evaluation."""

import json
import sys

import pytest

from hydrone_gym import cli
from hydrone_gym.evaluation.records import read_records
from tests.rendering.replay_pages import read_page

FLIGHT = ["--mission", "air-to-water", "--seed", "4"]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """The folder of a saved flight and its fresh page."""
    folder = tmp_path_factory.mktemp("flown")
    assert cli.main(["fly", *FLIGHT, "--no-figures", "--json", "--out", str(folder)]) == 0
    assert cli.main(["replay", *FLIGHT, "--out", str(folder / "fresh.html")]) == 0
    return folder


@pytest.fixture(scope="module")
def evaluated(tmp_path_factory):
    """The folder of an evaluation of two policies in two worlds."""
    folder = tmp_path_factory.mktemp("evaluated") / "run"
    options = ["--suites", "paper-20", "--worlds", "2", "--policies", "straight-line", "clrrt", "--jobs", "1"]
    assert cli.main(["evaluate", *options, "--backend", "threading", "--json", "--out", str(folder)]) == 0
    return folder


def test_a_saved_flight_gives_the_page_of_the_fresh_one(flown, capsys):
    page = flown / "saved.html"
    assert cli.main(["replay", str(flown / "flight.json"), "--out", str(page)]) == 0
    assert capsys.readouterr().out == f"{page}\n"
    assert read_page(page)[1] == read_page(flown / "fresh.html")[1]
    assert "tree of the planner" in page.read_text()


def test_a_saved_flight_gives_the_mcap_file_of_the_fresh_one(flown, tmp_path, capsys):
    fresh, saved = tmp_path / "fresh.mcap", tmp_path / "new" / "saved.mcap"
    assert cli.main(["replay", *FLIGHT, "--out", str(fresh)]) == 0
    assert cli.main(["replay", str(flown / "flight.json"), "--out", str(saved)]) == 0
    assert capsys.readouterr().out == f"{fresh}\n{saved}\n"
    assert saved.read_bytes() == fresh.read_bytes()


def test_json_names_page_outcome_and_trees(flown, tmp_path, capsys):
    assert cli.main(["replay", str(flown / "flight.json"), "--json", "--out", str(tmp_path / "new")]) == 0
    (shown,) = json.loads(capsys.readouterr().out)["replays"]
    (record,) = json.loads((flown / "flight.json").read_text())["flights"]
    assert (shown["name"], shown["outcome"], shown["time"]) == ("air-to-water", "GOAL", record["time"])
    assert shown["title"] == "Air to water, clrrt, seed 4"
    assert shown["file"] == str(tmp_path / "new" / "replay.html")
    assert shown["trees"] == len(record["references"])


def test_a_flight_whose_policy_flies_otherwise_now_has_no_trees(flown, tmp_path, capsys):
    document = json.loads((flown / "flight.json").read_text())
    for policy, told in (("straight-line", "shown without trees: straight-line flies otherwise now"), ("my:own", "")):
        (tmp_path / "flight.json").write_text(json.dumps({**document, "policy": policy}))
        assert cli.main(["replay", str(tmp_path / "flight.json"), "--out", str(tmp_path / "a.html")]) == 0
        assert told in capsys.readouterr().err
        page, timeline = read_page(tmp_path / "a.html")
        assert "tree of the planner" not in page
        assert timeline.seconds == read_page(flown / "fresh.html")[1].seconds


def test_several_flights_have_several_pages_and_one_can_be_chosen(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    empty = ["--policy", "straight-line", "--obstacles", "0"]
    assert cli.main(["fly", *empty, "--no-figures", "--out", "."]) == 0
    capsys.readouterr()
    assert cli.main(["replay", *empty]) == 0
    pages = ["replay-air-to-water.html", "replay-water-to-air.html"]
    assert capsys.readouterr().out.split() == pages
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    assert cli.main(["replay", "flight.json", "--flight", "water-to-air", "--out", "two.html", "--open"]) == 0
    assert opened == [(tmp_path / "two.html").as_uri()]
    assert read_page(tmp_path / "two.html")[1] == read_page(tmp_path / pages[1])[1]


def test_a_row_of_an_evaluation_is_flown_again(evaluated, tmp_path, capsys):
    rows = {record.key[1:]: record for record in read_records(evaluated / "rows.csv")}
    mission = next(iter(rows))[0]
    for policy in ("clrrt", "straight-line"):
        options = ["--policy", policy, "--mission", mission, "--world", "1", "--json", "--out", str(tmp_path)]
        assert cli.main(["replay", str(evaluated), *options]) == 0
        out, err = capsys.readouterr()
        (shown,) = json.loads(out)["replays"]
        record = rows[mission, 1, policy]
        assert (shown["outcome"], shown["time"]) == (record.outcome, record.time)
        assert shown["trees"] == (record.decisions if policy == "clrrt" else 0)
        assert "differs" not in err
        assert f"paper-20-v1, {mission}, world 1" in shown["title"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--seed", "-1"], "--seed must not be negative, got -1"),
        (["--world", "3"], "--world cannot be used with a fresh flight"),
        (["nowhere.json"], "nowhere.json"),
        (["FLIGHT", "--mission", "air-to-water"], "--mission cannot be used with a saved flight"),
        (["FLIGHT", "--world", "1", "--policy", "mppi"], "--policy, --world cannot be used with a saved flight"),
        (["FLIGHT", "--flight", "b"], "--flight must be one of air-to-water, got 'b'"),
        (["FOREIGN"], 'must be a file "hydrone_gym flights" of version 1'),
        (["RUN", "--seed", "4"], "--seed cannot be used with an evaluation"),
        (["RUN"], "--mission must be one of"),
        (["RUN", "--policy", "mppi"], "--policy must be one of straight-line, clrrt, got 'mppi'"),
        (["RUN", "--mission", "MISSION"], "--world must be one of 0, 1, got None"),
        (["RUN", "--mission", "MISSION", "--world", "7"], "--world must be one of 0, 1, got 7"),
        (["EMPTY"], "there is no rows.csv"),
        (["FLIGHT", "--open", "--out", "a.mcap"], "--open shows pages, .html, not a.mcap"),
    ],
)
def test_bad_input_gives_2_and_one_line(options, message, flown, evaluated, tmp_path, capsys):
    (tmp_path / "foreign.json").write_text('{"flights": []}')
    (tmp_path / "empty").mkdir()
    mission = read_records(evaluated / "rows.csv")[0].mission
    stand_for = {"FLIGHT": flown / "flight.json", "FOREIGN": tmp_path / "foreign.json", "RUN": evaluated}
    stand_for |= {"EMPTY": tmp_path / "empty", "MISSION": mission}
    arguments = [str(stand_for.get(option, option)) for option in options]
    assert cli.main(["replay", "--out", str(tmp_path / "new"), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    (line,) = [line for line in err.splitlines() if not line.startswith("hydrone: compiling ")]
    assert line.startswith("hydrone: error: ")
    assert message in line
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("module", "file", "message"),
    [
        ("viser", "a.html", 'replay pages need viser, part of the extra "replay"'),
        ("mcap_protobuf.writer", "a.mcap", 'MCAP files need mcap-protobuf-support, part of the extra "mcap"'),
    ],
)
def test_without_the_extra_nothing_is_flown(module, file, message, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr("hydrone_gym.cli.replay.fly", lambda *arguments, **options: pytest.fail("flown in vain"))
    assert cli.main(["replay", *FLIGHT, "--out", str(tmp_path / file)]) == 2
    assert f"hydrone: error: {message}" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
