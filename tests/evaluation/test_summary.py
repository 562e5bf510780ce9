"""Summaries and tables against sums by hand over records made up for it."""

import statistics
from dataclasses import replace

import numpy as np
import pytest

from hydrone_gym.evaluation.statistics import interquartile_mean, wilson_interval
from hydrone_gym.evaluation.summary import ALL_MISSIONS, summarise
from hydrone_gym.evaluation.tables import latex, markdown, overview, print_tables, tables_of
from tests.evaluation.test_records import ROW

ENDS = ("GOAL", "COLLISION", "ROUGH_TRANSITION", "TIMEOUT", "OUT_OF_BOUNDS", "DIVERGED")


def record(policy, world, outcome="GOAL", time=20.0, mission="m", **changes):
    changed = {"clearance": 0.5, "policy": policy, "world": world, "mission": mission, "time": time, **changes}
    return replace(ROW, outcome=outcome, success=outcome == "GOAL", **changed)


@pytest.fixture
def records():
    """Sixty worlds: "quick" loses some of every kind, "safe" arrives slowly, "lost" never."""
    random = np.random.default_rng(3)
    ends = random.choice(ENDS, 60, p=(0.7, 0.1, 0.05, 0.05, 0.05, 0.05))
    rows = []
    for world, end in enumerate(ends):
        quick = {"energy": random.normal(900.0, 50.0), "clearance": random.normal(0.3, 0.2)}
        rows.append(record("quick", world, str(end), 19.0 + random.random(), **quick))
        rows.append(record("safe", world, "GOAL", 21.0 + random.random(), interventions=world % 3))
        none = dict.fromkeys(("lateral_speed", "tilt", "zone_speed", "clearance"))
        rows.append(record("lost", world, "TIMEOUT", 120.0, crossings=0, **none))
    return rows


def test_a_policy_is_summed_up(records):
    (summary,) = summarise(records)
    flown = [row for row in records if row.policy == "quick"]
    (quick,) = [entry for entry in summary.policies if entry.policy == "quick"]
    arrived = [row for row in flown if row.outcome == "GOAL"]
    assert quick.worlds == 60
    assert quick.success == (len(arrived) / 60, *wilson_interval(len(arrived), 60))
    counted = (quick.collisions, quick.rough_crossings, quick.timeouts, quick.out_of_bounds, quick.diverged)
    assert counted == tuple(sum(row.outcome == end for row in flown) for end in ENDS[1:])
    assert len(arrived) + sum(counted) == 60
    for name in ("time", "energy", "length"):
        assert getattr(quick, name) == interquartile_mean([getattr(row, name) for row in arrived])
    assert quick.clearance == min(row.clearance for row in flown)
    assert quick.lateral_speed_max == ROW.lateral_speed
    assert quick.interventions is None
    assert quick.decision_ms_p99 == ROW.decision_ms_p99


def test_what_there_is_none_of_is_none(records):
    (lost,) = [entry for entry in summarise(records)[0].policies if entry.policy == "lost"]
    assert lost.success.value == 0.0
    assert lost.success.low == 0.0
    assert [lost.time, lost.length, lost.energy, lost.clearance, lost.lateral_speed, lost.tilt_max] == [None] * 6
    assert (lost.crossed, lost.rough) == (0, None)
    (safe,) = [entry for entry in summarise(records)[0].policies if entry.policy == "safe"]
    assert safe.interventions == statistics.fmean(world % 3 for world in range(60))


def test_policies_rank_by_success_then_time():
    rows = [record("slow", world, time=30.0) for world in range(4)]
    rows += [record("fast", world, time=20.0) for world in range(4)]
    rows += [record("fails", world, "GOAL" if world else "COLLISION", time=10.0) for world in range(4)]
    rows += [record("never", world, "TIMEOUT") for world in range(4)]
    (summary,) = summarise(rows)
    assert [(p.rank, p.policy) for p in summary.policies] == [(1, "fast"), (2, "slow"), (3, "fails"), (4, "never")]


def test_a_comparison_is_over_the_same_worlds(records):
    shuffled = [records[k] for k in np.random.default_rng(0).permutation(len(records))]
    (summary,) = summarise(shuffled, baseline="quick")
    (safe,) = [entry for entry in summary.comparisons if entry.policy == "safe"]
    quick = {row.world: row for row in records if row.policy == "quick"}
    differences = [
        row.time - quick[row.world].time for row in records if row.policy == "safe" and quick[row.world].success
    ]
    failed = sum(not row.success for row in quick.values())
    assert (safe.worlds, safe.both, safe.only_policy, safe.only_baseline) == (60, 60 - failed, failed, 0)
    assert safe.success.value == pytest.approx(failed / 60)
    assert safe.time.value == pytest.approx(interquartile_mean(differences).value)
    assert 1.0 < safe.time.low < safe.time.value < safe.time.high < 3.0
    (lost,) = [entry for entry in summary.comparisons if entry.policy == "lost"]
    assert (lost.both, lost.time, lost.energy) == (0, None, None)


def test_missions_are_told_apart_and_pooled():
    rows = [record(name, world, mission=mission) for mission in ("b", "a") for world in range(3) for name in ("x", "y")]
    rows += [replace(row, suite="other", mission="a") for row in rows[:2]]
    found = [(s.suite, s.mission, s.policies[0].worlds) for s in summarise(rows)]
    assert found == [
        (ROW.suite, "b", 3),
        (ROW.suite, "a", 3),
        (ROW.suite, ALL_MISSIONS, 6),
        ("other", "a", 1),
    ]


def test_worlds_of_different_missions_are_no_pair():
    rows = [record("x", 0, mission="a", time=10.0), record("x", 0, mission="b", time=20.0)]
    rows += [record("y", 0, mission="a", time=11.0), record("y", 0, mission="b", time=22.0)]
    pooled = summarise(rows)[-1]
    assert pooled.comparisons[0].time.value == 1.5


def test_an_unfinished_evaluation_compares_what_there_is(records):
    (summary,) = summarise(records[:-2])
    assert {c.policy: c.worlds for c in summary.comparisons} == {"safe": 59, "lost": 59}
    first = summarise([record("x", 0), record("y", 1)])[0]
    assert first.comparisons == ()


def test_an_unknown_baseline_is_refused(records):
    with pytest.raises(ValueError, match="baseline must be one of quick, safe, lost, got 'quik'"):
        summarise(records, baseline="quik")


def test_crossings_are_summed_up_over_the_flights_that_crossed():
    speeds, tilts = (0.1, 0.02, 0.3, 0.04), (0.01, 0.1, 0.0, 0.02)  # the third too fast, the second tilted by 5.7°
    rows = [record("x", k, lateral_speed=speeds[k], tilt=tilts[k], crossings=1) for k in range(4)]
    rows.append(record("x", 4, "TIMEOUT", crossings=0, lateral_speed=None, tilt=None, zone_speed=None))
    rows.append(record("x", 5, "ROUGH_TRANSITION", lateral_speed=0.2, tilt=0.0, crossings=1))  # at the limit, rounded
    (summary,) = summarise(rows)
    (x,) = summary.policies
    assert x.crossed == 5
    assert x.rough == (3 / 5, *wilson_interval(3, 5))
    assert x.lateral_speed == interquartile_mean([*speeds, 0.2])
    assert x.lateral_speed_max == 0.3
    assert x.tilt == interquartile_mean([*tilts, 0.0])
    table = tables_of([summary])[1]
    low, high = (100.0 * end for end in wilson_interval(3, 5))
    assert table.title.endswith(": flights that crossed the surface")
    assert table.rows[0][1:3] == ("5", f"60.0 [{low:.1f}, {high:.1f}]")
    assert table.rows[0][4] == "0.300"
    assert table.rows[0][6] == f"{np.degrees(0.1):.2f}"
    assert "0.2 m/s" in table.notes[0]
    assert "5°" in table.notes[0]
    assert len(tables_of(summarise([rows[4]]))) == 3  # nobody crossed


def test_what_is_over_all_flights_stands_apart_from_those_that_arrived(records):
    outcomes, crossings, arrived, bounded, decisions, differences = tables_of(summarise(records))
    assert arrived.title.endswith(": flights that arrived")
    assert arrived.heads == ("policy", "time (s)", "length (m)", "energy (J)")
    assert decisions.title.endswith(": decisions of all flights")
    assert decisions.heads == ("policy", "p50 (ms)", "p99 (ms)")
    for table, words in (
        (outcomes, ("Interventions", "Other", "Least clearance", "95 % Wilson interval")),
        (crossings, ("Rough", "Lateral speed, tilt", "95 % bootstrap interval")),
        (arrived, ("interquartile mean", "95 % bootstrap interval")),
        (bounded, ("Bound", "Rule of the zone: within ±0.8 m", "at most 0.2 m/s sideways")),
        (differences, ("Only it / baseline", "McNemar", "Newcombe's 95 % interval")),
    ):
        assert all(any(word in note for note in table.notes) for word in words)
        assert all(f"\n- {note}\n" in markdown([table]) for note in table.notes)


def test_negative_numbers_have_minus_signs_and_zero_has_none():
    rows = [record("x", k, time=20.0, energy=900.0) for k in range(3)]
    rows += [record("y", k, time=19.0, energy=899.9, clearance=-0.05) for k in range(3)]
    outcomes, *_, differences = tables_of(summarise(rows, "x"))
    assert [row[7] for row in outcomes.rows] == ["−0.05", "0.50"]
    assert differences.rows[0][5] == "−1.00 [−1.00, −1.00]"
    assert differences.rows[0][6] == "+0 [+0, +0]"  # not -0
    assert "-" not in "".join(cell for row in (*outcomes.rows, *differences.rows) for cell in row[1:])


def test_an_overview_fits_in_80_columns(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    names = ("straight-line-shield", "clrrt", "ppo-shield", "somewhere/my_policies.py:TheVeryBest+shield")
    rows = [record(n, k, mission=m, decision_ms_p99=123.4, time=119.9) for n in names for k in range(9) for m in "ab"]
    (table,) = overview(summarise([*rows, *(replace(row, suite="other", mission="a") for row in rows)]))[:1]
    print_tables([table])
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    shown = [line for line in lines if " [" in line and line[0] not in " p"] + [x for x in lines if x.startswith("ppo")]
    assert len(shown) == 4  # a line a policy
    assert all(any(line.startswith(name) for line in shown) for name in names[:3])
    assert any("somewhere…est+shield" in line for line in shown)
    assert "100.0 [82, 100]" in shown[0]
    assert "119.9" in shown[0]
    assert "123.4" in shown[0]
    assert (table.heads[1], table.heads[6]) == ("score", "rule\n(%)")
    assert (table.rows[0][1], table.rows[0][6]) == ("–", "100")


def test_latex_has_every_cell_and_escapes_what_would_break_it(records):
    rows = [record("50%_&#{x}$~^\\", k, clearance=-0.1) for k in range(2)] + [record("b", k) for k in range(2)]
    text = latex(tables_of(summarise(rows)))
    assert text.startswith("% \\usepackage{booktabs}\n")
    name = r"50\%\_\&\#\{x\}\$\textasciitilde{}\textasciicircum{}\textbackslash{}"
    assert rf"{name} & 2 & 100.0 [34.2, 100.0] & 0 & 0 & 0 & 0 & $-$0.10 & -- \\" in text
    assert text.count(r"\begin{tabular}") == text.count(r"\toprule") == text.count(r"\bottomrule") == 6
    assert r"\shortstack[r]{least clear-\\ance (m)}" in text
    assert r"tilt ($^\circ$)" in text
    assert text.count("{") == text.count("}")
    body = [line for line in text.splitlines() if line.endswith(r" \\") and "shortstack" not in line]
    assert {line.replace(r"\&", "").count(" & ") for line in body} == {8, 6, 3, 2}


def test_tables_show_the_figures(records, capsys):
    summaries = summarise(records)
    outcomes, _, measures, bounded, decisions, differences = tables_of(summaries)
    (quick,) = [entry for entry in summaries[0].policies if entry.policy == "quick"]
    assert outcomes.rows[0][:3] == ("1. safe", "60", "100.0 [94.0, 100.0]")
    assert outcomes.rows[1][:2] == ("2. quick", "60")
    assert outcomes.rows[1][3:] == (
        *map(str, (quick.collisions, quick.rough_crossings, quick.timeouts, quick.out_of_bounds + quick.diverged)),
        f"−{-quick.clearance:.2f}",
        "–",
    )
    assert quick.clearance < 0.0  # of a flight that did not arrive: it stands among the outcomes
    assert not any("clearance" in head for head in measures.heads)
    assert measures.rows[2] == ("lost", "–", "–", "–")
    assert decisions.rows[2] == ("lost", "1.50", "9.50")
    time = summaries[0].comparisons[0].time
    assert differences.rows[0][5] == f"{time.value:+.2f} [{time.low:+.2f}, {time.high:+.2f}]"
    text = markdown([outcomes, measures, differences])
    lines = text.splitlines()
    assert lines.count("| 1. safe | 60 | 100.0 [94.0, 100.0] | 0 | 0 | 0 | 0 | 0.50 | 1.0 |") == 1
    for line in lines:
        assert not line or line.startswith(("| ", "### ", "|---|", "- "))
    print_tables([outcomes, measures, bounded, differences])
    shown = capsys.readouterr().out
    for table in (outcomes, measures, bounded, differences):
        for row in table.rows:
            assert any(all(cell in line for cell in row) for line in shown.splitlines())
    assert all(len(line) <= 120 for line in shown.splitlines())


def test_markdown_escapes_what_would_break_a_table():
    (summary,) = summarise([record("a|b", 0), record("[red]c", 0)])
    outcomes = tables_of([summary])[0]
    assert "| 1. a\\|b | 1 |" in markdown([outcomes])


def test_names_are_not_taken_for_markup(capsys):
    print_tables(tables_of(summarise([record("[red]c", 0)])))
    assert "1. [red]c" in capsys.readouterr().out
