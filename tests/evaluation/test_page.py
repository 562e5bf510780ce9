"""The report page is read back as a browser would: structure, links, numbers, and what it makes of hostile names."""

import json
import math
import xml.etree.ElementTree as ET
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
from urllib.parse import unquote

import numpy as np
import pytest

from hydrone_gym.evaluation import page_figures
from hydrone_gym.evaluation.page import write_report
from hydrone_gym.evaluation.plan import Plan, make_plan
from hydrone_gym.evaluation.policies import PolicySource
from hydrone_gym.evaluation.records import HEADER, read_records, to_line
from hydrone_gym.evaluation.run_folder import write_results
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.evaluation.suites import Mission, Suite
from hydrone_gym.evaluation.summary import summarise
from hydrone_gym.evaluation.tables import tables_of
from hydrone_gym.world.scenario import Scenario
from tests.evaluation.test_records import ROW

EVIL = "<script>alert('x')</script> $x$ & \"co\".py:make"
POLICIES = ("good", EVIL, "lost")
WORLDS = 6
VOID = {"meta", "link", "img", "br"}


class Page(HTMLParser):
    """Reads a page and fails on a tag that is not closed where it should be."""

    def __init__(self, path):
        super().__init__()
        self.open, self.tags, self.rows, self.text, self.styles = [], [], [], "", ""
        self.feed(path.read_text(encoding="utf-8"))
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")
        elif tag == "br":
            self.handle_data("\n")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "style":
            self.styles += data
            return
        self.text += data
        if {"td", "th"} & set(self.open):
            self.rows[-1][-1] += data

    def all(self, name, tag=None):
        return [attrs[name] for kind, attrs in self.tags if name in attrs and tag in (None, kind)]


def scenario(world, obstacles):
    spheres = np.tile([0.0, 0.0, 5.0, 1.0], (obstacles, 1))
    return Scenario(start=(-8.0, -8.0, 4.0 + 0.1 * world, 0.0), goal=(8.0, 8.0, -3.0), obstacles=spheres)


def made_plan():
    """Two missions at two densities, and a suite of one mission without crossings."""

    def mission(name, obstacles):
        scenarios = tuple(scenario(world, obstacles) for world in range(WORLDS))
        options = {"num_obstacles": obstacles}
        return Mission(name=name, env_id="HydroneGym/Mission-v0", options=options, scenarios=scenarios)

    suites = (
        Suite(name="mine", missions=(mission("few", 5), mission("many", 30))),
        Suite(name='dry "<b>"', missions=(mission("air", 0),)),
    )
    policies = tuple(PolicySource(label=label, factory="nowhere:nothing") for label in POLICIES)
    return Plan(suites=suites, policies=policies, seed=3, vehicle="physical")


def all_keys(plan):
    return plan.keys()


def made_records(plan):
    random = np.random.default_rng(0)
    obstacles = {m.name: m.options["num_obstacles"] for suite in plan.suites for m in suite.missions}
    for suite, mission, world, policy in all_keys(plan):
        outcome = {"good": "GOAL", EVIL: ("GOAL", "COLLISION")[world % 2], "lost": "TIMEOUT"}[policy]
        row = replace(ROW, suite=suite, mission=mission, world=world, policy=policy, outcome=outcome)
        time = 120.0 if outcome == "TIMEOUT" else 20.0 + random.random()
        row = replace(row, success=outcome == "GOAL", time=time, energy=50.0 * time, obstacles=obstacles[mission])
        if suite != "mine":
            none = dict.fromkeys(("crossing_time", "lateral_speed", "tilt", "vertical_speed", "zone_speed"))
            row = replace(row, crossings=0, **none)
        yield replace(row, clearance=random.random() if suite == "mine" else None)


def store(folder, plan, records):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "rows.csv").write_text(HEADER + "\n" + "".join(map(to_line, records)), encoding="utf-8")
    return write_results(plan, records, folder, baseline=records[0].policy)[0]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder, plan = tmp_path_factory.mktemp("made"), made_plan()
    store(folder, plan, list(made_records(plan)))
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return Page(folder / "report.html")


def test_the_page_is_whole_and_loads_nothing(folder, page):
    tags = [tag for tag, _ in page.tags]
    assert tags.count("h1") == tags.count("main") == tags.count("title") == 1
    assert "width=device-width" in dict(page.tags[2][1], **page.tags[3][1])["content"]
    assert not {"script", "iframe", "object", "embed"} & set(tags)
    assert all(source.startswith("data:image/svg+xml;base64,") for source in page.all("src"))
    assert page.all("href", "link") == ["data:,"]
    assert "url(" not in page.styles
    assert "@import" not in page.styles
    for image in (attrs for tag, attrs in page.tags if tag == "img"):
        assert image["alt"]
        for node in ET.fromstring(b64decode(image["src"].partition(",")[2])).iter():
            assert not node.tag.endswith("script")
            assert all(not value.startswith("http") for name, value in node.attrib.items() if name.endswith("href"))


def test_every_link_leads_somewhere(folder, page):
    ids = page.all("id")
    assert len(set(ids)) == len(ids)
    links = page.all("href", "a")
    assert {"rows.csv", "summary.json", "tables.md", "tables.tex", "#replays"} <= set(links)
    assert all(link[1:] in ids if link.startswith("#") else (folder / unquote(link)).is_file() for link in links)


def test_every_name_and_number_of_the_summary_is_there(folder, page):
    document = json.loads((folder / "summary.json").read_text())
    for name in (*POLICIES, "mine", "few", "many", 'dry "<b>"', "air", "physical", document["machine"]["processor"]):
        assert name in page.text
    for name in ("date", "commit"):
        assert document[name] is None or document[name] in page.text
    shown = [[cell.strip() for cell in row] for row in page.rows]
    tables = tables_of(summarise(read_records(folder / "rows.csv"), "good"))
    assert len(tables) == 3 * 6 + 4  # two missions and both together, and the other suite, without crossings
    for table in tables:
        assert table.title in page.text
        assert all(note in page.text for note in table.notes)
        assert list(table.heads) in shown
        assert all(list(row) in shown for row in table.rows)


def test_figures_are_there_for_what_there_is(page):
    words = [alt.partition(":") for alt in page.all("alt")]
    success = [place.strip() for kind, _, place in words if kind == "Success"]
    assert success == ["mine, few", "mine, many", 'dry "<b>", air']
    assert [place.strip() for kind, _, place in words if kind.startswith("Success against")] == ["mine"]
    for kind in ("Time to the goal (s)", "Energy of the rotors (kJ)"):
        assert len([1 for word in words if word[0] == kind]) == 3
    for kind in ("Least clearance (m)", "Lateral speed (m/s)", "Tilt (°)", "Vertical speed (m/s)"):
        assert [place.strip() for word, _, place in words if word == kind] == ["mine, few", "mine, many"]


def test_figures_stand_in_the_order_of_the_tables(page):
    kinds = list(dict.fromkeys(alt.partition(":")[0] for alt in page.all("alt")))
    crossings = ["Lateral speed (m/s)", "Tilt (°)", "Vertical speed (m/s)"]
    outcomes = ["Success", "Success against density", "Least clearance (m)"]
    assert kinds == [
        *outcomes, *crossings, "Time to the goal (s)", "Energy of the rotors (kJ)", "Times of decisions"
    ]  # fmt: skip


def test_every_figure_is_a_file_for_a_paper(folder, page, tmp_path):
    shown = page.all("alt")
    files = sorted(path.name for path in (folder / "figures").iterdir())
    assert len(files) == 2 * len(shown)
    assert {f"figures/{name}" for name in files} <= set(page.all("href", "a"))
    write_report(folder, into=tmp_path, width=3.5, titled=False)
    for name in (name for name in files if name.endswith(".svg")):
        there, here = (ET.parse(place / "figures" / name).getroot() for place in (folder, tmp_path))
        assert "mine" in "".join(there.itertext()) or "dry" in "".join(there.itertext()) or "decisions" in name
        assert "mine, few" not in "".join(here.itertext())
        assert here.get("width") == "252pt"
    drawn = Page(tmp_path / "report.html")
    assert [a["src"] for t, a in drawn.tags if t == "img"] == [a["src"] for t, a in page.tags if t == "img"]


def test_success_against_density_counts_every_flight_once(monkeypatch):
    drawn = []
    plot = page_figures.plot_rates
    monkeypatch.setattr(page_figures, "plot_rates", lambda *args, **kwargs: drawn.append(args) or plot(*args, **kwargs))
    records = list(made_records(made_plan()))
    page_figures.charts_of(records, summarise(records, "good"))
    ((counts, rates, _),) = drawn
    assert counts == [5, 30]
    np.testing.assert_allclose(rates["good"], [(1.0, *wilson_interval(WORLDS, WORLDS))] * 2)


def test_names_do_no_harm(folder, page):
    assert "<script" not in (folder / "report.html").read_text(encoding="utf-8").lower()
    assert page.text.count(EVIL) > 10


def test_missions_of_a_large_suite_are_folded(tmp_path):
    plan = make_plan("density", ["straight-line", "potential-field"], worlds=1)
    keys = [dict(zip(("suite", "mission", "world", "policy"), key, strict=True)) for key in all_keys(plan)]
    rows = [replace(ROW, **key, obstacles=int(key["mission"][-2:])) for key in keys]
    store(tmp_path, plan, rows)
    page = Page(write_report(tmp_path))
    assert page.all("alt").count("Success: density-v1, all missions") == 1
    assert "Tables of each of the 10 missions" in page.text
    assert "Each of 10 missions" in page.text
    assert "Success: density-v1, water-to-air-40" in page.all("alt")


def test_an_unfinished_evaluation_says_so(tmp_path):
    plan = made_plan()
    records = list(made_records(plan))[:20]
    store(tmp_path, plan, records)
    page = Page(write_report(tmp_path, into=tmp_path / "a" / "page"))
    assert "20 of 54: the evaluation was stopped before its end" in page.text
    assert (tmp_path / "a" / "page" / "rows.csv").read_bytes() == (tmp_path / "rows.csv").read_bytes()
    assert not (tmp_path / "report.html").exists()


@pytest.mark.parametrize("name", ["rows.csv", "summary.json"])
def test_missing_input_is_named(folder, tmp_path, name):
    for kept in {"rows.csv", "summary.json"} - {name}:
        (tmp_path / kept).write_bytes((folder / kept).read_bytes())
    with pytest.raises(FileNotFoundError, match=f"there is no {name}: a report needs the folder of an evaluation"):
        write_report(tmp_path)


def test_damaged_input_is_named(folder, tmp_path):
    rows, document = (folder / "rows.csv").read_bytes(), json.loads((folder / "summary.json").read_text())
    (tmp_path / "rows.csv").write_bytes(rows)

    def refused(content, match):
        text = content if isinstance(content, str) else json.dumps(content)
        (tmp_path / "summary.json").write_text(text)
        with pytest.raises(ValueError, match=match):
            write_report(tmp_path)

    refused("{", r"summary.json: damaged: JSONDecodeError")
    refused([], r"summary.json: damaged")
    refused({**document, "version": 9}, "must be a hydrone_gym evaluation summary of version 1, got .* version 9")
    refused({key: document[key] for key in document if key != "machine"}, "lacks machine")
    broken = json.loads(json.dumps(document))
    del broken["missions"][0]["policies"][0]["policy"]
    refused(broken, r"summary.json: damaged: KeyError: 'policy'")
    refused({**document, "machine": "a fast one"}, "machine must be a dict, got str")
    named = {**document["arguments"], "policies": {"other": "nowhere:nothing"}}
    refused({**document, "arguments": named}, "summary.json does not sum up rows.csv")
    refused({**document, "rows": math.inf}, "summary.json does not sum up rows.csv")
    (tmp_path / "rows.csv").write_bytes(rows.replace(b",GOAL,", b",GOAAL,", 1))
    refused(document, "rows.csv, line 2: column outcome")
    assert not (tmp_path / "report.html").exists()
