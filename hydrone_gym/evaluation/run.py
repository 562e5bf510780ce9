"""Carrying an evaluation out: jobs to the workers, rows to the disk, and what happens when something stops it."""

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tqdm import tqdm

from hydrone_gym._folder_lock import held
from hydrone_gym.evaluation.backends import runner
from hydrone_gym.evaluation.plan import Plan, PoliciesLike, SuiteLike, fly_job, make_plan
from hydrone_gym.evaluation.policies import DEFAULT_POLICIES, Factory
from hydrone_gym.evaluation.records import Key, Record
from hydrone_gym.evaluation.run_folder import RunFolder, write_results
from hydrone_gym.evaluation.suites import DEFAULT_SUITES, Suite
from hydrone_gym.evaluation.summary import scores_of


class EvaluationStopped(RuntimeError):
    """An evaluation ended before its last flight; `records` are those that were finished, also on disk."""

    def __init__(self, message: str, records: list[Record]) -> None:
        """Keep what was finished."""
        super().__init__(message)
        self.records = records


def evaluate(
    suites: SuiteLike | Sequence[SuiteLike] = DEFAULT_SUITES,
    policies: PoliciesLike = DEFAULT_POLICIES,
    *,
    worlds: int | None = 50,
    seed: int = 0,
    vehicle: str = "paper",
    controller: str | None = None,
    jobs: int | None = None,
    backend: str | None = None,
    out: str | os.PathLike[str] | None = None,
) -> list[Record]:
    """Fly policies through the same worlds and return one record a flight.

    Records are the same, times of decisions aside, whatever backend and number of jobs.

    Args:
        suites: names of frozen suites, "weather" for those of all levels, files or folders of your own (see
            `load_suite`), or `Suite` objects.
        policies: registered names, "module:attribute", "file.py:attribute", folders of trained agents (see
            `find_policy`), or a mapping from labels to these or to factories, callables that take the environment.
        worlds: the first so many of each mission, None for all.
        seed: given to policies that draw; every flight starts with it anew.
        vehicle: parameter set, "paper" or "physical".
        controller: control law, "paper" or "robust"; None for that of the suites, in frozen ones the paper's.
        jobs: flights at once.
        backend: of joblib, "loky", "threading", "dask" or "ray"; None for the one `joblib.parallel_config` has set,
            this process unless told otherwise. With processes, a script needs `if __name__ == "__main__":`.
        out: folder for rows, written as they are finished, and results, ready for `page.write_report`. Flights that
            are there are not flown again, unless the code of their policy has changed: an evaluation that was stopped
            goes on where it was, and one with more worlds or policies extends it.

    Raises:
        ValueError, TypeError, FileNotFoundError: an argument out of range, an unknown suite or policy, a folder with
            another evaluation, damaged rows.
        BlockingIOError: another run is writing into `out`.
        EvaluationStopped: a policy raised in a flight, a worker died, or the disk is full. Finished rows are kept.
    """
    plan = make_plan(suites, policies, worlds=worlds, seed=seed, vehicle=vehicle, controller=controller)
    if out is None:
        return carry_out(plan, jobs=jobs, backend=backend)
    with held(out):
        folder = RunFolder(Path(out), plan)
        records = carry_out(plan, folder, jobs=jobs, backend=backend)
        write_results(plan, records, folder.folder, seconds=folder.seconds)
    return records


def evaluate_held_out(
    policy: str | Factory, *, worlds: int = 1000, options: Mapping[str, Any] | None = None
) -> tuple[list[Record], list[dict[str, Any]]]:
    """Fly a policy in batches through so many worlds of every mission that training does not see.

    `policy` is what `find_policy` takes, or a factory; `options` are those of the environments, among them "vehicle"
    by its name. Returns the records, and their scores (see `scores_of`).
    """
    others = dict(options or {})
    vehicle = others.pop("vehicle", "paper")
    records = evaluate(Suite.held_out(worlds, others), {"agent": policy}, worlds=worlds, vehicle=vehicle)
    return records, scores_of(records)


def carry_out(
    plan: Plan,
    folder: RunFolder | None = None,
    *,
    jobs: int | None = None,
    backend: str | None = None,
    progress: bool = False,
) -> list[Record]:
    """Fly what of a plan is not finished yet in a folder, as `evaluate` does; `progress` shows a bar on stderr."""
    keys = plan.keys()
    records = [] if folder is None else list(folder.records)
    calls = list(_calls(plan, {record.key for record in records}))
    if calls:
        with runner(backend, jobs, most=len(calls)) as run:
            plan.check()
            if folder is not None:
                folder.begin()
            bar = tqdm(total=len(keys), initial=len(records), unit="flight", disable=None if progress else True)
            with bar, contextlib.closing(run(calls)) as results:
                _gather(results, records, bar, folder)
    rows = {record.key: record for record in records}
    ordered = [rows[key] for key in keys]
    if folder is not None:
        folder.arrange(ordered)
    return ordered


def _gather(results: Iterator[Any], records: list[Record], bar: tqdm, folder: RunFolder | None) -> None:
    """Append what workers return to the records and to the folder, until every flight is finished."""

    def stopped(reason: str) -> EvaluationStopped:
        place = "" if folder is None else f" and kept in {folder.rows}; the same evaluation goes on from there"
        return EvaluationStopped(f"{reason}; {len(records)} of {bar.total} flights are finished{place}", records)

    while len(records) < bar.total:
        try:
            finished, broken = next(results)
        except Exception as error:  # a backend's own: a worker killed, a cluster lost, a policy that cannot be sent
            raise stopped(f"workers failed: {type(error).__name__}: {error}") from error
        try:
            if folder is not None:
                folder.append(finished)
        except OSError as error:
            raise stopped(str(error)) from error
        records += finished
        bar.update(len(finished))
        if finished:
            bar.set_description(finished[-1].suite, refresh=False)
        if broken is not None:
            suite, mission, world, policy = broken.key
            failed = stopped(
                f"policy {policy!r} failed in suite {suite}, mission {mission}, world {world}: {broken.reason}"
            )
            failed.add_note(broken.details)
            raise failed


def _calls(plan: Plan, done: set[Key]) -> Iterator[Any]:
    """Yield what joblib is to call: the jobs of a plan without the flights that are done."""
    import joblib

    for job in plan.jobs():
        worlds = tuple(world for world, key in zip(job.worlds, job.keys) if key not in done)
        if worlds:
            yield joblib.delayed(fly_job)(replace(job, worlds=worlds))
