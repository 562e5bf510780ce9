"""`hydrone failures`: where and why an agent fails, in words and figures; docs/failures.md explains the columns."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from agents.failures.causes import Failure, examine
from agents.failures.figures import draw_how, draw_where, draw_worlds
from agents.failures.flights import fly_failed
from agents.failures.tables import failure_tables, write_failures
from agents.failures.worlds import features_of
from hydrone_gym.evaluation.plan import Plan, make_plan
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run import carry_out
from hydrone_gym.evaluation.run_folder import write_whole
from hydrone_gym.evaluation.suites import HELD_OUT, MISSIONS, Suite
from hydrone_gym.evaluation.summary import scores_of, summarise
from hydrone_gym.evaluation.tables import Table, markdown, tables_of
from hydrone_gym.rendering.style import DOTS_PER_INCH


def find_failures(plan: Plan, *, progress: bool = False) -> tuple[list[Record], list[Failure]]:
    """Fly a plan of `Suite.held_out` worlds and one policy, and those flights that failed once more, singly.

    Returns:
        The records of all flights, and the failures in the same order; bars on stderr show the `progress`.

    Raises:
        EvaluationStopped: the policy raised.
        ValueError: a policy that flies otherwise alone than in a batch.
    """
    records, failures = carry_out(plan, progress=progress), []
    failed = [record for record in records if not record.success]
    for record in tqdm(failed, desc="failures", unit="flight", disable=None if progress else True):
        job = plan.job_of(record)
        env = job.make_env()
        told = {"mission": job.env_id, "seed": HELD_OUT + record.world, "outcome": record.outcome}
        failures.append(examine(fly_failed(env, job.policy.make(env, job.seed), job.worlds[0][1], **told)))
    return records, failures


def write_failure_report(
    policy: str, folder: Path, *, worlds: int, options: Mapping[str, Any], progress: bool = False
) -> tuple[list[Table], dict[str, Any]]:
    """Fly held-out worlds and write tables, `failures.csv` and figures; return the tables and the same as plain data.

    Arguments are those of `evaluate_held_out`; the folder is made if missing. Raises what `find_failures` and
    `make_plan` do.
    """
    others = {name: value for name, value in options.items() if name != "vehicle"}
    plan = make_plan(Suite.held_out(worlds, others), policy, worlds=worlds, vehicle=options["vehicle"])
    folder.mkdir(parents=True, exist_ok=True)
    records, failures = find_failures(plan, progress=progress)
    env: Any = next(plan.jobs()).make_env().unwrapped
    reach = env.world.zone + env.vehicle.radius
    seen = []
    for mission in plan.suites[0].missions:
        arrived = np.array([record.success for record in records if record.mission == mission.name])
        seen.append((mission.env_id, features_of(mission.scenarios, reach), arrived))
    drawn = (draw_where(failures, MISSIONS, env.world), draw_how(failures), draw_worlds(seen))
    for name, figure in zip(("where", "how", "worlds"), drawn, strict=True):
        figure.savefig(folder / f"failures-{name}.png", dpi=DOTS_PER_INCH)
    write_failures(failures, folder / "failures.csv")
    outcomes = [table for table in tables_of(summarise(records)) if table.title.endswith("outcomes")]
    tables = [*outcomes, *failure_tables(failures, MISSIONS, worlds)]
    write_whole(folder / "failures.md", markdown(tables))
    told = [{"mission": f.mission, "seed": f.seed, "outcome": f.outcome.name, "cause": f.cause} for f in failures]
    return tables, {"folder": str(folder), "scores": scores_of(records), "failures": told}
