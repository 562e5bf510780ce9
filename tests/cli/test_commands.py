"""The command itself: which subcommands there are, what its help costs, and that compiling is told."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import gymnasium
import pytest

import hydrone_gym
from agents import load_agent
from hydrone_gym.cli import main
from hydrone_gym.cli.missions import MissionOptions
from hydrone_gym.evaluation.policies import find_policy
from hydrone_gym.evaluation.suites import load_suite
from planners import Shield

ROOT = Path(__file__).resolve().parents[2]

NAMES = ("demonstrate", "evaluate", "failures", "fly", "list", "replay", "train")


@pytest.fixture
def yachting(tmp_path, monkeypatch):
    """Somebody else's package with two subcommands, one of which cannot be imported."""
    info = tmp_path / "yachting-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: yachting\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[hydrone_gym.commands]\nsail = yachting:Sail\nsink = no_such_module:Sink\n")
    (tmp_path / "yachting.py").write_text(
        "from dataclasses import dataclass\n"
        "@dataclass\n"
        "class Sail:\n"
        "    '''Put to sea.\n\n    And come home.'''\n"
        "    knots: int = 3\n"
        "    def run(self):\n"
        "        if self.knots > 9:\n"
        "            raise ValueError('too\\n fast')\n"
        "        print(self.knots)\n"
        "        return 0\n"
    )
    monkeypatch.syspath_prepend(tmp_path)


def test_help_lists_every_command_in_a_line(capsys, yachting):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    for name in NAMES:
        assert f"\n  {name} " in shown
    assert "  sail          Put to sea.\n" in shown
    assert "cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'" in " ".join(shown.split())
    assert max(map(len, shown.splitlines())) <= 80


def test_a_command_of_another_package(capsys, yachting):
    assert main(["sail", "--knots", "7"]) == 0
    assert capsys.readouterr().out == "7\n"
    assert main(["sail", "--knots", "10"]) == 2
    assert capsys.readouterr().err == "hydrone: error: too fast\n"
    assert main(["sink"]) == 2
    assert capsys.readouterr().err == (
        "hydrone: error: sink cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'\n"
    )


@pytest.fixture
def narrow(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.usefixtures("narrow")
@pytest.mark.parametrize("name", NAMES)
def test_every_command_has_help_and_json(name, capsys):
    with pytest.raises(SystemExit) as stop:
        main([name, "--help"])
    assert stop.value.code == 0
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    assert f"usage: hydrone {name}" in shown
    assert "--json" in shown


def test_list_names_what_commands_take(capsys):
    assert main(["list", "--json"]) == 0
    names = json.loads(capsys.readouterr().out)
    assert list(names) == ["policies", "suites", "agents", "missions"]
    assert main(["list"]) == 0
    columns = capsys.readouterr().out
    assert max(map(len, columns.splitlines())) <= 80
    words = columns.split()
    assert all(name in words for kind, each in names.items() for name in (kind, *each))
    for policy in names["policies"]:
        find_policy(policy)
    for suite in names["suites"]:
        load_suite(suite, 1)
    for agent in names["agents"]:
        load_agent(agent)
        assert agent in names["policies"]
    for mission in names["missions"]:
        assert MissionOptions(mission=mission, policy="straight-line", obstacles=0).prepare()[0].name == mission


def test_tables_name_what_commands_take():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    tables = re.findall(r"^\| policy \|.*\n\|[-|: ]+\n((?:\|.*\n)+)", readme, re.MULTILINE)
    assert tables
    for row in "".join(tables).splitlines():
        find_policy(row.split("|")[1].strip(" `"))


@pytest.mark.parametrize("mission", ["random", "air-to-water", "HydroneGym/AirToWater-v0"])
def test_a_mission_has_a_name_and_the_id_of_its_environment(mission):
    (prepared,) = MissionOptions(mission=mission, policy="straight-line", obstacles=0).prepare()
    assert prepared.name == ("random" if mission == "random" else "air-to-water")


@pytest.mark.parametrize("options", [[], ["--shield"]])
def test_an_agent_of_a_name_flies_the_same_wherever_it_is_named(options, tmp_path, monkeypatch):
    """`ppo-shield` is behind the shield, once, as `hydrone evaluate` flies it."""
    flown = []
    report = "agents.failures.report.write_failure_report"
    monkeypatch.setattr(report, lambda agent, *_, **__: flown.append(agent) or ([], {}))
    assert main(["failures", "--agent", "ppo-shield", "--out", str(tmp_path), *options]) == 0
    env = gymnasium.make("HydroneGym/Mission-v0")
    shield = find_policy(flown[0]).make(env, 0)
    assert isinstance(shield, Shield)
    assert shield.policy.file.name == "ppo-shield"


def test_version_and_module(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"hydrone {hydrone_gym.__version__}\n"
    shown = subprocess.run(
        [sys.executable, "-m", "hydrone_gym", "--version"], capture_output=True, text=True, timeout=120
    )
    assert shown.stdout == f"hydrone {hydrone_gym.__version__}\n"


def test_the_version_is_the_same_wherever_it_stands():
    version = re.escape(hydrone_gym.__version__)
    assert re.search(rf"^version: {version}$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.MULTILINE)
    newest = re.search(r"^## \[(.*)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)[1]
    assert newest in (hydrone_gym.__version__, "Unreleased")


def test_a_command_spelt_wrong_is_guessed(capsys):
    with pytest.raises(SystemExit):
        main(["fyl"])
    assert "no command 'fyl' (did you mean 'fly'?): known are" in capsys.readouterr().err


def test_an_install_that_is_named_exists():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    folders = [ROOT / name for name in ("hydrone_gym", "planners", "agents", "docs", "examples")]
    files = [ROOT / "README.md", *(file for folder in folders for file in folder.rglob("*.*"))]
    text = "".join(file.read_text(encoding="utf-8") for file in files if file.suffix in (".py", ".md", ".html"))
    named = re.findall(r'pip install (?:-e )?"(?:hydrone-gym|\.)\[([\w,-]+)\]"|EXTRA: ClassVar = "([\w,]+)"', text)
    named = {extra for names in named for extra in "".join(names).split(",")}
    assert {"agents", "demonstrations", "replay", "render", "tensorboard"} <= named <= set(extras)
    assert all(extras[name] for name in ("dask", "ray"))  # told by the name of the backend


def test_help_needs_neither_torch_nor_kernels():
    program = """if True:
        import json, sys
        from numba.core import event
        compiled = []
        class Listener(event.Listener):
            def on_start(self, event):
                compiled.append(event.data["dispatcher"].py_func.__name__)
            def on_end(self, event):
                pass
        event.register("numba:compile", Listener())
        from hydrone_gym.cli import main
        main(["--help"])
        print(json.dumps([compiled, sorted({"torch", "stable_baselines3", "matplotlib", "minari"} & set(sys.modules))]))
    """
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == [[], []]


KERNEL = """
import sys
from hydrone_gym._jit import inlined, kernel
from hydrone_gym.cli import tell_compiling

@inlined
def twice(x):
    return 2.0 * x

@kernel
def sum_twice(x):
    return twice(x) + x

tell_compiling()
tell_compiling()
assert sum_twice(1.0) == 3.0
"""


def test_a_kernel_is_named_while_it_is_compiled_and_not_when_it_is_loaded(tmp_path, monkeypatch):
    (tmp_path / "kernels.py").write_text(KERNEL)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=":")
    told = []
    for _ in range(2):
        command = [sys.executable, "-c", "import kernels"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
        told.append(done.stderr)
    assert told == ["hydrone: compiling kernels.sum_twice (once after an install)\n", ""]
