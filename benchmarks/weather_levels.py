"""At which level of weather policies lose five points of success, each under the control law it is meant for.

    python -m benchmarks.weather_levels                                # ten entrants, six levels: hours
    python -m benchmarks.weather_levels --worlds 100 --slow-worlds 10 --levels 0 2 --out /tmp/trial --runs /tmp/runs
    python -m benchmarks.weather_levels --slow-worlds 40 --picture docs/images/weather-levels.png

All fly the same held-out worlds of every mission at every level, those that take long to decide the first of them. What
was not made for weather flies under both laws, which tells what the law does from what the policy does. The same
command goes on where it was stopped.
"""

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import tyro
from rich.console import Console

from benchmarks.tables import Sheet
from benchmarks.timing import RESULTS, save
from hydrone_gym.evaluation import Record, Suite, evaluate
from hydrone_gym.evaluation.levels import by_policy, flown_levels, level_tables, plot_levels
from hydrone_gym.evaluation.statistics import Estimate, paired_success
from hydrone_gym.evaluation.summary import ALL_MISSIONS, summarise
from hydrone_gym.evaluation.tables import markdown
from hydrone_gym.rendering.files import save_figure
from hydrone_gym.weather.weather import LEVELS

FAST = {"paper": ("ppo",), "robust": ("ppo", "ppo-weather")}  # by law
SLOW = {
    "paper": ("clrrt", "ppo-shield"),
    "robust": ("clrrt", "clrrt-weather", "ppo-shield", "ppo-shield-weather", "ppo-weather-shield"),
}
LOSS = 0.05  # of success, against level 0
PICTURED = (
    "clrrt-weather, robust",
    "ppo-weather, robust",
    "ppo, robust",
    "clrrt, robust",
    "ppo, paper",
    "clrrt, paper",
)


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to fly, and where the figures go."""

    worlds: int = 1000
    """Held-out worlds a mission and level that agents fly which are on their own."""
    slow_worlds: int = 200
    """The same of planners and of what is behind the shield; 0 for none."""
    levels: tuple[int, ...] = tuple(range(len(LEVELS)))
    """Levels of weather; 0 must be among them."""
    runs: Path = Path("evaluations") / "weather-levels"
    """Folder of the flights."""
    out: Path = RESULTS
    """Folder of weather_levels.json."""
    picture: Path | None = None
    """PNG of success against the level, of some of them."""


def flown(a: Arguments) -> list[Record]:
    """Fly all entrants, called by name and law; raises ValueError for worlds or levels that there are not."""
    if 0 not in a.levels or not set(a.levels) <= set(range(len(LEVELS))):
        raise ValueError(f"levels must be some of 0 to {len(LEVELS) - 1} and 0 itself, got {a.levels}")
    records = []
    for (entrants, worlds), law in product(((FAST, a.worlds), (SLOW, a.slow_worlds)), FAST):
        if worlds == 0:
            continue
        for level in a.levels:
            suite = Suite.held_out(worlds, {"weather": level, "controller": law}, name=f"weather-{level}")
            for policy in entrants[law]:
                out = a.runs / f"{policy}-{law}-{level}-{worlds}"
                rows = evaluate(suite, policy, worlds=worlds, out=out)
                records += [replace(row, policy=f"{policy}, {law} law") for row in rows]
    return records


def change(records: Sequence[Record], policy: str, level: int) -> Estimate:
    """Success of an entrant at a level less that at level 0 in the same worlds, with Newcombe's interval for pairs."""
    suites = (f"weather-{level}", "weather-0")
    here, still = ([r.success for r in records if (r.policy, r.suite) == (policy, suite)] for suite in suites)
    return paired_success(here, still).difference


def first_loss(changes: dict[int, Estimate]) -> str:
    """The least level whose change is a loss of `LOSS`; in brackets from and to where the intervals would have it."""

    def first(end: str) -> str:
        lost = [level for level, each in sorted(changes.items()) if getattr(each, end) <= -LOSS]
        return str(lost[0]) if lost else "none"

    least, told, most = map(first, ("low", "value", "high"))
    return told if least == most else f"{told} ({least} to {most})"


def sheet(records: Sequence[Record], levels: Sequence[int]) -> Sheet:
    """A row an entrant: change at each level in points, and where five of them are lost."""
    rows, higher = [], sorted(set(levels) - {0})
    for policy in dict.fromkeys(record.policy for record in records):
        changes = {level: change(records, policy, level) for level in higher}
        cells = (f"{100 * c.value:.1f} [{100 * c.low:.1f}, {100 * c.high:.1f}]" for c in changes.values())
        rows.append((policy, *cells, first_loss(changes)))
    note = "Points of success against level 0 in the same worlds, Newcombe's 95 % interval for pairs."
    columns = ("entrant", *(f"level {level}" for level in higher), "loses 5 points at level")
    return Sheet("What weather costs", columns, rows, [note])


def draw(records: Sequence[Record], path: Path) -> None:
    """Draw success of the entrants in `PICTURED` against the level, the best first."""
    shown = [replace(row, policy=row.policy.removesuffix(" law")) for row in records]
    levels = flown_levels(summarise([row for row in shown if row.policy in PICTURED]))[ALL_MISSIONS]
    figure = plot_levels(list(by_policy(levels)), levels, title="Success by weather and law")
    save_figure(figure, path.with_suffix(""), formats=("png",))


def main(arguments: Sequence[str] | None = None) -> int:
    given = sys.argv[1:] if arguments is None else list(arguments)
    a = tyro.cli(Arguments, args=given, description=__doc__)
    try:
        records = flown(a)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    costs = sheet(records, a.levels)
    told = costs.markdown() + "\n" + markdown(level_tables(summarise(records)))
    Console().print(told, soft_wrap=True, markup=False)
    if a.picture is not None:
        draw(records, a.picture)
    command = shlex.join(["python", "-m", "benchmarks.weather_levels", *given])
    measured = {"worlds": a.worlds, "slow_worlds": a.slow_worlds, "tables": told.splitlines()}
    print(save("weather_levels", command, measured, a.out))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
