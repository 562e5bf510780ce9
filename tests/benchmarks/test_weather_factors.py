"""One kind of weather at a time: what the command flies and writes, and what it refuses."""

import json

from benchmarks import weather_factors


def test_a_cell_says_what_was_flown_and_how_it_ended(tmp_path):
    given = ["--worlds", "2", "--factors", "wind 1", "--policies", "straight-line", "--out", str(tmp_path)]
    assert weather_factors.main(given) == 0
    cells = json.loads((tmp_path / "weather_factors.json").read_text())["cells"]
    assert [cell["mission"] for cell in cells] == ["air to water", "water to air"]
    for cell in cells:
        assert (cell["factor"], cell["policy"], cell["law"]) == ("wind 1", "straight-line", "paper")
        arrived = cell["outcomes"].get("GOAL", 0)
        assert sum(cell["outcomes"].values()) == 2 == arrived + len(cell["failures"])
        assert 0.0 <= cell["success"][0] <= arrived / 2 <= cell["success"][1] <= 1.0


def test_promises_fly_beside_policies(tmp_path):
    given = ["--worlds", "1", "--factors", "level 1", "--policies", "straight-line", "--promises", "0.9"]
    assert weather_factors.main([*given, "--controller", "robust", "--out", str(tmp_path)]) == 0
    cells = json.loads((tmp_path / "weather_factors.json").read_text())["cells"]
    flown = ["straight-line", "clrrt-promise-0.9", "ppo-shield-promise-0.9"]
    assert [cell["policy"] for cell in cells] == [name for name in flown for _ in range(2)]


def test_what_it_does_not_know(capsys):
    assert weather_factors.main(["--factors", "fog"]) == 2
    assert "no factor 'fog': known are 'none', 'wind 1'" in capsys.readouterr().err
    assert weather_factors.main(["--worlds", "0"]) == 2
