"""Records survive the file bit for bit, and damage is found where it is."""

import csv
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hydrone_gym.evaluation.records import COLUMNS, HEADER, Record, from_line, parse_records, read_records, to_line

ROW = Record(
    suite="paper-20-v1",
    mission="air-to-water",
    world=3,
    obstacles=20,
    policy="clrrt",
    outcome="GOAL",
    success=True,
    time=20.35,
    energy=997.1234567890123,
    length=29.4,
    clearance=None,
    crossings=1,
    crossing_time=14.9,
    lateral_speed=1e-17,
    tilt=0.001,
    vertical_speed=0.5,
    zone_speed=0.125,
    interventions=None,
    episode_return=-0.25,
    decisions=41,
    decision_ms_p50=1.5,
    decision_ms_p99=9.5,
    decision_ms_max=10.0,
)
number = st.floats(allow_nan=False, allow_infinity=False)
text = st.text(st.characters(exclude_categories=["Cc", "Cs"]), min_size=1)


@given(number, number, st.none() | number, st.none() | st.integers(0, 10**9), text)
def test_a_line_gives_the_record_back(time, energy, clearance, interventions, policy):
    record = replace(ROW, time=time, energy=energy, clearance=clearance, interventions=interventions, policy=policy)
    assert from_line(to_line(record).removesuffix("\n")) == record


def test_the_file_is_csv_for_any_reader(tmp_path):
    path = tmp_path / "rows.csv"
    rows = [ROW, replace(ROW, policy='mine, "two"', success=False, outcome="TIMEOUT", interventions=4)]
    path.write_text(HEADER + "\n" + "".join(map(to_line, rows)))
    with path.open(newline="") as stream:
        first, second = csv.DictReader(stream)
    assert list(first) == list(COLUMNS) == [field.name for field in fields(Record)]
    assert (first["success"], first["clearance"], float(first["energy"])) == ("1", "", ROW.energy)
    assert (second["success"], second["policy"], second["interventions"]) == ("0", 'mine, "two"', "4")
    assert read_records(path) == rows


@pytest.mark.parametrize(
    ("column", "cell", "message"),
    [
        ("world", "x", "column world: must be a whole number, got 'x'"),
        ("world", "-1", "column world: must be a whole number, got '-1'"),
        ("time", "", "column time: must be a number, got ''"),
        ("energy", "nan", "column energy: must be a number, got 'nan'"),
        ("clearance", "0.1.2", "column clearance: must be a number, got '0.1.2'"),
        ("success", "True", "column success: must be 0 or 1, got 'True'"),
        ("success", "0", "column outcome: 'GOAL' does not fit success 0"),
        ("outcome", "RUNNING", "column outcome: 'RUNNING' does not fit success 1"),
        ("outcome", "GAOL", "column outcome: 'GAOL' does not fit success 1"),
        ("decisions", None, "there must be 23 cells, got 22"),
    ],
)
def test_damage_names_line_and_column(column, cell, message):
    cells = to_line(ROW).strip().split(",")
    position = COLUMNS.index(column)
    cells[position : position + 1] = [] if cell is None else [cell]
    content = f"{HEADER}\n{to_line(ROW)}{','.join(cells)}\n{to_line(ROW)}".encode()
    with pytest.raises(ValueError) as stop:  # noqa: PT011
        parse_records(content, "rows.csv")
    assert str(stop.value) == f"rows.csv, line 3: {message}"


def test_other_damage():
    with pytest.raises(ValueError, match=r"rows\.csv, line 1: must name the columns suite,mission"):
        parse_records(b"a,b\n", "rows.csv")
    with pytest.raises(ValueError, match=r"rows\.csv, line 2: 'utf-8' codec can't decode"):
        parse_records(HEADER.encode() + b"\n\xff\xfe\n", "rows.csv")
    with pytest.raises(ValueError, match=r"rows\.csv, line 2: unexpected end of data"):
        parse_records(HEADER.encode() + b'\n"paper-20-v1,\n', "rows.csv")
    with pytest.raises(ValueError, match=r"rows\.csv, line 2: there must be 23 cells, got 0"):
        parse_records(HEADER.encode() + b"\n\n", "rows.csv")


def test_an_outcome_that_there_is_not():
    line = to_line(replace(ROW, success=False, outcome="SUNK"))
    with pytest.raises(ValueError, match="column outcome: 'SUNK' does not fit success 0"):
        from_line(line)


def test_a_line_cut_off_is_left_out():
    whole = f"{HEADER}\n{to_line(ROW)}".encode()
    cut = to_line(replace(ROW, world=4)).encode()
    for end in range(len(cut)):
        assert parse_records(whole + cut[:end], "rows.csv") == [ROW]
    for end in range(len(HEADER) + 1):
        assert parse_records(HEADER.encode()[:end], "rows.csv") == []
