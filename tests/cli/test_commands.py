"""The command itself: which subcommands there are, what its help costs, and that compiling is told."""

import json
import subprocess
import sys

import pytest

from hydrone_gym.cli import main

NAMES = ("demonstrate", "evaluate", "failures", "fly", "replay", "train")


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
    assert "cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'" in shown


def test_a_command_of_another_package(capsys, yachting):
    assert main(["sail", "--knots", "7"]) == 0
    assert capsys.readouterr().out == "7\n"
    assert main(["sail", "--knots", "10"]) == 2
    assert capsys.readouterr().err == "hydrone: error: too fast\n"
    assert main(["sink"]) == 2
    assert capsys.readouterr().err == (
        "hydrone: error: sink cannot be loaded: ModuleNotFoundError: No module named 'no_such_module'\n"
    )


@pytest.mark.parametrize("name", NAMES)
def test_every_command_has_help_and_json(name, capsys):
    with pytest.raises(SystemExit) as stop:
        main([name, "--help"])
    assert stop.value.code == 0
    shown = capsys.readouterr().out
    assert f"usage: hydrone {name}" in shown
    assert "--json" in shown


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
