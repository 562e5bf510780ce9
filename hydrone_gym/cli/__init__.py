"""The command `hydrone`, whose subcommands are found by entry points of the group `hydrone_gym.commands`.

A subcommand is a class whose fields are the options, explained by the comment or docstring of each, and whose `run`
returns the exit code; the first line of its docstring is what `hydrone --help` shows, and an extra that it needs is its
class variable `EXTRA`. Only the one asked for is imported.

Exit codes: 0 success; 1 a mission that did not end at the goal, or what could not be finished or written; 2 bad
input, told in one line; 130 stopped by Ctrl-C.
"""

import functools
import inspect
import os
import sys
import textwrap
from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from gymnasium.error import DependencyNotInstalled

from hydrone_gym import __version__
from hydrone_gym.evaluation.policies import did_you_mean
from hydrone_gym.evaluation.run import EvaluationStopped

GROUP = "hydrone_gym.commands"
MOST_OBSTACLES = 1000  # of an option; more take minutes to place


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; `arguments` default to those of the process."""
    try:
        return _main(sys.argv[1:] if arguments is None else list(arguments))
    except KeyboardInterrupt as stopped:  # which says what to do now, where a command knows
        print(f"hydrone: interrupted; {str(stopped) or 'the same command begins again'}", file=sys.stderr)
        return 130  # what shells give for Ctrl-C


def _main(given: list[str]) -> int:
    """Find the subcommand, run it and return its exit code."""
    commands = {entry.name: entry for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name)}
    if given == ["--version"]:
        print("hydrone", __version__)
        return 0
    if not given or given[0] not in commands:
        return _help(commands, given)
    import tyro

    try:
        kind = commands[given[0]].load()
    except Exception as error:  # of somebody else's package
        return refused(f"{given[0]} cannot be loaded: {type(error).__name__}: {error}")
    try:
        command = tyro.cli(kind, args=given[1:], prog=f"hydrone {given[0]}", config=(tyro.conf.FlagCreatePairsOff,))
        tell_compiling()
        code = command.run()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, `head` say, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except ImportError as error:
        extra = getattr(kind, "EXTRA", "")
        return refused(f'{error}; this needs: pip install "hydrone-gym[{extra}]"' if extra else error)
    except EvaluationStopped as error:
        return refused(error, 1)
    except (ValueError, TypeError, OSError, MemoryError, DependencyNotInstalled) as error:
        return refused(error)
    return code


@functools.cache
def tell_compiling() -> None:
    """From now on say on stderr which kernel is being compiled; one that is loaded from the cache is not told."""
    from numba.core import event

    class Teller(event.Listener):
        depth = 0  # kernels compile others that they are made of

        def on_start(self, event: Any) -> None:
            if self.depth == 0:
                function = event.data["dispatcher"].py_func
                name = f"{function.__module__}.{function.__name__}"
                print(f"hydrone: compiling {name} (once after an install)", file=sys.stderr, flush=True)
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1

    event.register("numba:compile", Teller())


def refused(reason: object, code: int = 2) -> int:
    """Tell in one line why a command ends, and return its exit code."""
    print("hydrone: error:", " ".join(str(reason).split()), file=sys.stderr)
    return code


def check_obstacles(count: int | None) -> None:
    """Raise ValueError for more spheres than an option may ask for."""
    if count is not None and count > MOST_OBSTACLES:
        raise ValueError(f"--obstacles must be at most {MOST_OBSTACLES}, got {count}")


def _help(commands: dict[str, EntryPoint], given: list[str]) -> int:
    """Print what subcommands there are; raise SystemExit if one was asked for that is not among them."""
    usage = "usage: hydrone [-h] [--version] COMMAND …"
    if not given or given[0] not in ("-h", "--help"):
        wrong = f"no command {given[0]!r}{did_you_mean(given[0], commands)}" if given else "a command is missing"
        print(f"{usage}\nhydrone: error: {wrong}: known are {', '.join(commands)}", file=sys.stderr)
        raise SystemExit(2)
    print(f"{usage}\n\nFly the HyDrone in air, through the water surface and below it.\n\ncommands:")
    for name, entry in commands.items():
        try:
            about = (inspect.getdoc(entry.load()) or "").partition("\n")[0]
        except Exception as error:
            about = f"cannot be loaded: {type(error).__name__}: {error}"
        print(textwrap.fill(about, 80, initial_indent=f"  {name:<14}", subsequent_indent=" " * 16))
    print("\n`hydrone COMMAND --help` lists the options of a command.")
    return 0
