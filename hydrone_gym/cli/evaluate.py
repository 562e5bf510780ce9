"""The subcommand `hydrone evaluate`: policies on the same worlds, rows, statistics and tables."""

import contextlib
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from gymnasium.error import DependencyNotInstalled

from hydrone_gym._folder_lock import held
from hydrone_gym.cli import refused
from hydrone_gym.evaluation.backends import check_jobs
from hydrone_gym.evaluation.ompl_log import write_ompl_logs
from hydrone_gym.evaluation.page import write_report
from hydrone_gym.evaluation.plan import Plan, make_plan
from hydrone_gym.evaluation.policies import DEFAULT_POLICIES
from hydrone_gym.evaluation.provenance import machine
from hydrone_gym.evaluation.run import carry_out
from hydrone_gym.evaluation.run_folder import LATEX, ROWS, SUMMARY, TABLES, RunFolder, write_results
from hydrone_gym.evaluation.shown import Writer
from hydrone_gym.evaluation.suites import DEFAULT_SUITES, in_short
from hydrone_gym.evaluation.tables import print_tables
from hydrone_gym.rendering.files import Width, inches
from hydrone_gym.rendering.replay import load_viser, write_replay

LOCAL = ("loky", "threading")  # backends whose workers share this machine


@dataclass(frozen=True, kw_only=True)
class Evaluate:
    """Fly policies through the same worlds and say how they compare.

    The same command goes on where it was stopped, and flies only what is missing.
    """

    suites: tuple[str, ...] = DEFAULT_SUITES
    """Frozen suites paper-20, dense-40, missions, density, weather-0 to weather-5, weather for these six; held-out,
    flown in batches; or files or folders of yours."""
    policies: tuple[str, ...] = DEFAULT_POLICIES
    """Registered names, module:attribute, file.py:attribute or an agent's folder, also as LABEL=… and …+shield."""
    worlds: int = 50  # First so many worlds of each mission.
    seed: int = 0  # Seed for policies that draw; the worlds are those of the suite.
    vehicle: Literal["paper", "physical", "hydrone-2021", "hydrone-agile"] = "paper"  # Parameter set of the vehicle.
    controller: Literal["paper", "robust"] | None = None  # Control law; that of the suite, the paper's, unless given.
    baseline: str | None = None  # Policy that the others are compared with; clrrt if it is among them, else the first.
    jobs: int | None = None  # Flights at once, as many as there are cores unless given.
    backend: str = "loky"  # Backend of joblib: loky, threading, dask, ray.
    out: Path | None = None
    """Folder for rows.csv, summary.json, tables.md and .tex, evaluations/<suites> unless given; made if missing."""
    report: Path | None = None
    """Folder for report.html and figures/: tables, figures, replays of best, median and worst flight of each policy."""
    width: Width | None = None
    """Width of the files in figures/: inches, or column (3.5) or text (7.16); as on the page unless given."""
    no_title: bool = False  # Leave the titles out of the files in figures/.
    no_replays: bool = False  # Leave the replays out of the report.
    export: Literal["ompl-log"] | None = None
    """ompl-log also writes the folder's ompl/, a benchmark log of OMPL for each mission, for Planner Arena."""
    overwrite: bool = False  # Begin anew in a folder that holds another evaluation.
    json: bool = False  # Print the summary as one JSON document instead of the tables, and show no progress bar.

    def run(self) -> int:
        """Fly, report and return the exit code."""
        try:
            return self._run()
        except KeyboardInterrupt:
            raise KeyboardInterrupt("finished flights are kept, the same command goes on") from None

    def _run(self) -> int:
        """Check the input, hold the folder and fly."""
        check_jobs(self.jobs)
        if self.report is None and (self.width is not None or self.no_title):
            raise ValueError("--width and --no-title are about the figures of a --report")
        inches(self.width)
        flown = {name: getattr(self, name) for name in ("worlds", "seed", "vehicle", "controller")}
        plan = make_plan(self.suites, self.policies, **flown)
        labels = [policy.label for policy in plan.policies]
        if self.baseline is not None and self.baseline not in labels:
            raise ValueError(f"--baseline must be one of {', '.join(labels)}, got {self.baseline!r}")
        names = in_short([suite.name for suite in plan.suites])
        out = Path("evaluations") / "+".join(names) if self.out is None else self.out
        with held(out):
            folder = RunFolder(out, plan, overwrite=self.overwrite)
            if self.report is not None:
                self.report.mkdir(parents=True, exist_ok=True)
            for note in self._notes(plan, folder):
                print(f"hydrone: {note}", file=sys.stderr)
            try:
                return self._fly(plan, folder)
            except OSError as error:  # a full disk, after the input was found good
                return refused(error, 1)

    def _notes(self, plan: Plan, folder: RunFolder) -> Iterator[str]:
        """Yield what may surprise, a line each."""
        for suite in plan.suites:
            if self.worlds > (most := max(len(mission.scenarios) for mission in suite.missions)):
                yield f"suite {suite.name} has {most} worlds a mission, all are flown: --worlds is {self.worlds}"
        cores = machine()["cores"]
        if self.backend in LOCAL and self.jobs is not None and self.jobs > cores:
            yield f"--jobs {self.jobs} is more than the {cores} cores here: flights wait for each other"
        if folder.records:
            yield f"{len(folder.records)} of {len(plan.keys())} flights are taken from {folder.rows}"
        if folder.changed:
            yield f"flown anew, since the code is not what it was: {', '.join(folder.changed)}"

    def _fly(self, plan: Plan, folder: RunFolder) -> int:
        """Carry the plan out, write and show what came of it, and return the exit code."""
        with _stdout_to_stderr():
            records = carry_out(plan, folder, jobs=self.jobs, backend=self.backend, progress=not self.json)
        document, overview = write_results(plan, records, folder.folder, baseline=self.baseline, seconds=folder.seconds)
        paths = [folder.folder / name for name in (ROWS, SUMMARY, TABLES, LATEX)]
        if self.export == "ompl-log":
            paths += write_ompl_logs(folder.folder, plan)
        if self.report is not None:
            writer = None if self.no_replays else _replay_writer()
            width, titled = inches(self.width), not self.no_title
            page = write_report(folder.folder, into=self.report, plan=plan, replay=writer, width=width, titled=titled)
            paths.append(page)
        if self.json:
            print(json.dumps(document, indent=1, allow_nan=False))
        else:
            print_tables(overview)
            print("\nEach mission, crossings, energy, clearance and differences: in tables.md")
            print(*paths, sep="\n")
        return 0


@contextlib.contextmanager
def _stdout_to_stderr() -> Iterator[None]:
    """What policies print, also in worker processes, must not get into the results."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


def _replay_writer() -> Writer | None:
    """Return what writes replays, None where that is not installed."""
    try:
        load_viser()
    except DependencyNotInstalled as error:
        print(f"hydrone: the report has no replays: {error}", file=sys.stderr)
        return None
    return write_replay
