"""The flights that show a policy, its best, its median and its worst one: which they are, and flying them again."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from hydrone_gym.evaluation.flight import Flight, fly
from hydrone_gym.evaluation.plan import Plan
from hydrone_gym.evaluation.records import Record, record_of
from hydrone_gym.simulation.simulation import Simulation

REPLAYS = "replays"  # folder beside the page
_ENDS = ("GOAL", "TIMEOUT", "OUT_OF_BOUNDS", "DIVERGED", "ROUGH_TRANSITION", "COLLISION")  # from best to worst
Writer = Callable[..., object]  # (flight, simulation, path, *, title): writes a page, as `write_replay` of rendering


class Shown(NamedTuple):
    """The flights that show a policy."""

    policy: str  # its name
    best: Record  # arrived soonest
    median: Record  # in the middle, by time, of those that arrived
    worst: Record  # the soonest collision, else the soonest rough crossing, and so on; the slowest where all arrived


def shown_flights(records: Sequence[Record]) -> list[Shown]:
    """Choose the flights that show each policy, in the order of the policies; where none arrived, among them all."""
    shown = []
    for policy in dict.fromkeys(record.policy for record in records):
        flown = sorted((record for record in records if record.policy == policy), key=_badness)
        arrived = [record for record in flown if record.success] or flown
        shown.append(Shown(policy, flown[0], arrived[(len(arrived) - 1) // 2], flown[-1]))
    return shown


def _badness(record: Record) -> tuple[int, float]:
    return _ENDS.index(record.outcome), record.time if record.success else -record.time


def write_replays(shown: Sequence[Shown], plan: Plan, folder: Path, write: Writer) -> dict[Record, tuple[Path, Record]]:
    """Fly flights of a plan again and write a replay of each into a folder, which is made if missing.

    Returns for each record the file, and the record of the flight in it: another one for a policy that draws at random
    or stops by the clock, or whose code has changed since. Errors are those of `fly_record`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written: dict[Record, tuple[Path, Record]] = {}
    for number, (policy, *flights) in enumerate(shown, start=1):
        for name, record in zip(("best", "median", "worst"), flights, strict=True):
            if record not in written:
                flight, simulation = fly_record(record, plan)
                path = folder / f"{number}-{re.sub('[^a-zA-Z0-9.-]+', '_', policy)[-60:]}-{name}.html"
                write(flight, simulation, path, title=f"{policy}, {name} flight: {record.place}")
                written[record] = (path, record_of(record.key, flight))
    return written


def fly_record(record: Record, plan: Plan) -> tuple[Flight, Simulation]:
    """Fly what a record tells of, alone; ValueError for one that is not in the plan, or a policy no longer made."""
    job = plan.job_of(record)
    env = job.make_env()
    flight = fly(env, job.policy.make(env, job.seed), seed=job.weather_seeds[0], scenario=job.worlds[0][1])
    return flight, env.get_wrapper_attr("simulation")
