"""The subcommand `hydrone list`: the names that commands take."""

import json
import textwrap
from dataclasses import dataclass
from importlib.metadata import entry_points

from hydrone_gym.cli.missions import MISSIONS
from hydrone_gym.evaluation.policies import known_policies
from hydrone_gym.evaluation.suites import frozen_suites

AGENTS = "hydrone_gym.agents"  # entry points: functions that return the names of the agents of a package


@dataclass(frozen=True, kw_only=True)
class List:
    """List the policies, suites, agents and missions that there are."""

    json: bool = False  # Print one JSON document instead of columns.

    def run(self) -> int:
        """Print the names and return the exit code."""
        agents = {name for entry in entry_points(group=AGENTS) for name in entry.load()()}
        names = {
            "policies": known_policies(),
            "suites": [*frozen_suites(), "held-out"],
            "agents": sorted(agents),
            "missions": list(MISSIONS),
        }
        if self.json:
            print(json.dumps(names, indent=1))
            return 0
        for kind, each in names.items():
            first, rest = f"{kind:<10}", " " * 10
            words = "  ".join(each)
            print(textwrap.fill(words, 80, initial_indent=first, subsequent_indent=rest, break_on_hyphens=False))
        return 0
