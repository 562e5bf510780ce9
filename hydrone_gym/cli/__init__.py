"""The command `hydrone`: one module a subcommand, whose class has the options as fields and `run`, the exit code.

Exit codes: 0 success; 1 a mission that did not end at the goal, or an evaluation that could not be finished; 2 bad
input, told in one line; 130 an evaluation stopped by Ctrl-C.
"""

import os
import sys
from collections.abc import Sequence

import tyro

from agents.clone_command import Clone, Demonstrate
from agents.train_command import Train
from hydrone_gym.cli.evaluate import Evaluate
from hydrone_gym.cli.fly import Fly
from hydrone_gym.cli.replay import Replay


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; `arguments` default to those of the process."""
    command = tyro.extras.subcommand_cli_from_dict(
        {
            "fly": Fly,
            "evaluate": Evaluate,
            "replay": Replay,
            "train": Train,
            "demonstrate": Demonstrate,
            "clone": Clone,
        },
        prog="hydrone",
        description="Fly the HyDrone in air, through the water surface and below it.",
        args=arguments,
        config=(tyro.conf.FlagCreatePairsOff,),
    )
    try:
        code = command.run()
        sys.stdout.flush()
    except BrokenPipeError:  # the reader, `head` say, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return code
