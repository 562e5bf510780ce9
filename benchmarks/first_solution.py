"""Time from an empty tree to the first path to the goal in a known map: CL-RRT, and OMPL's control RRT beside it.

    python -m benchmarks.first_solution                      # 300 worlds a set, OMPL in the first 30 of each
    python -m benchmarks.first_solution --worlds 50 --ompl 0 # without OMPL

World k of a set is drawn from seed k, and every sphere of it is known. CL-RRT grows one sample at a time until a node
lies at the goal; no path is chosen, verified or sent. OMPL plans in the same worlds with the same edge (one period of
the kernel, the same clearance and crossing limits), a moment after CL-RRT did. It gets an environment of its own,
filled by pip on the first run; `peers/ompl_worker.py` says what its Python interface allows.
"""

import dataclasses
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tyro

from benchmarks.peers.ompl_run import TUNINGS, OmplWorker, Planned
from benchmarks.peers.run import default_cache
from benchmarks.planning import DENSITIES, SETS, law_of
from benchmarks.tables import Sheet, number
from benchmarks.timing import save
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import VESSEL
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.world.generator import generate
from hydrone_gym.world.scenario import Scenario
from hydrone_gym.world.world import World
from planners import CLRRT
from planners.cl_rrt.execute import Query, cycle
from planners.cl_rrt.expand import DRAWS
from planners.cl_rrt.memory import first_memory
from planners.cl_rrt.tree import Workspace

PERIOD = 0.5  # s
SAMPLES = 4  # between looks at the tree
FULL = 0.8  # share of the tree's capacity at which it is cut back, as a new cycle would
WARM_UPS = 20


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What to plan."""

    worlds: int = 300
    """Worlds a set."""
    sets: tuple[str, ...] = ("experiment-1", "experiment-2")
    """Mission types, named as in benchmarks.planning."""
    density: tuple[int, ...] = tuple(DENSITIES)
    """Numbers of spheres."""
    vehicle: Literal["paper", "physical"] = "paper"
    """Parameter set."""
    objective: Literal["time", "energy", "length", "paper"] = "time"
    """What the planner minimises."""
    ompl: int = 30
    """Worlds of each set in which OMPL plans too."""
    limit: float = 1.0
    """Seconds of wall-clock time before a world counts as not solved."""
    cache: Path = field(default_factory=default_cache)
    """Where OMPL's environment is kept."""


class Grower:
    """CL-RRT's growth alone: from an empty tree to the first node at the goal."""

    def __init__(self, a: Settings) -> None:
        """Make the planner's parameters."""
        self._planner = CLRRT(Simulation(named_vehicle(a.vehicle), World(), PERIOD), objective=a.objective)
        self._limit = a.limit

    def plan(self, row: np.ndarray, scenario: Scenario, seed: int) -> Planned:
        """Grow until the goal is reached; the time includes the storage of the tree."""
        obstacles, goal = np.array(scenario.obstacles), np.array(scenario.goal)
        wall, cpu = time.perf_counter(), time.process_time()
        random = np.random.Generator(np.random.Philox(key=seed))
        planner, most = self._planner, self._planner.settings.max_nodes
        memory = first_memory(most, row[-4:])
        work = Workspace.around(memory.nodes, memory.backup, planner.simulation, obstacles)
        ends, dead = work.nodes["goal"], work.nodes["dead"]
        size, root, begin, solved = 0, -1, True, False
        while not solved and time.perf_counter() - wall < self._limit:
            before = 0 if begin else size
            query = Query(
                start=row,
                goal=goal,
                eye=row[:3],
                draws=random.random(SAMPLES * DRAWS),
                size=size,
                root=root,
                known_before=len(obstacles),
                held=row[-4:],
                holds=False,
                roam=0,
                iterations=SAMPLES,
                begin=begin,
                finish=False,
            )
            size = cycle(work, query, planner._constants)[0]
            root, begin = 0, size > FULL * most
            solved = bool((ends[before:size] > dead[before:size]).any())
        return Planned(solved, time.perf_counter() - wall, time.process_time() - cpu, int(work.edges[0]))


def start_row(scenario: Scenario) -> np.ndarray:
    """A vessel at rest: state, controller memory, energy, reference, (21,)."""
    x, y, z, yaw = scenario.start
    row = np.zeros(VESSEL)
    row[:3], row[5], row[-4:] = (x, y, z), yaw, (x, y, z, yaw)
    return row


def summary(planned: list[Planned], limit: float) -> dict[str, Any]:
    """Figures of a set; a world that was not solved counts as infinitely long."""
    wall, cpu = ([getattr(p, clock) if p.solved else np.inf for p in planned] for clock in ("wall", "cpu"))
    figures: dict[str, Any] = {"worlds": len(planned), "limit_s": limit, "solved": sum(p.solved for p in planned)}
    for clock, values in (("wall", wall), ("cpu", cpu)):
        for name, share in (("median", 0.5), ("p99", 0.99)):
            value = float(np.quantile(values, share, method="higher"))
            figures[f"{clock}_{name}_ms"] = 1e3 * value if np.isfinite(value) else None
    edges = [p.edges for p in planned]
    figures["edges_median"] = float(np.median(edges))
    figures["edges_per_cpu_second"] = sum(edges) / sum(p.cpu for p in planned)
    figures["edges_per_second"] = sum(edges) / sum(p.wall for p in planned)
    return figures


def compare(ours: list[Planned], theirs: list[Planned], limit: float) -> dict[str, Any]:
    """OMPL's figures and its medians over CL-RRT's; where OMPL's is beyond the limit, a lower bound."""
    fast, slow = summary(ours, limit), summary(theirs, limit)
    for clock in ("wall", "cpu"):
        median = slow[f"{clock}_median_ms"]
        slow[f"{clock}_ratio"] = (1e3 * limit if median is None else median) / fast[f"{clock}_median_ms"]
        slow[f"{clock}_ratio_is_bound"] = median is None
    return slow


def run_set(mission: str, density: int, a: Settings, grower: Grower, worker: OmplWorker | None) -> dict[str, Any]:
    """Plan in the worlds of a set, in turns."""
    law, radius = law_of(mission, density), named_vehicle(a.vehicle).radius
    ours: list[Planned] = []
    theirs: dict[str, list[Planned]] = {tuning: [] for tuning in TUNINGS}
    for seed in range(a.worlds):
        scenario = generate(law, World(), radius, np.random.default_rng(seed))
        row = start_row(scenario)
        ours.append(grower.plan(row, scenario, seed))
        if worker is not None and seed < a.ompl:
            for name, tuning in TUNINGS.items():
                theirs[name].append(worker.plan(row, scenario, a.limit, tuning))
    figures = summary(ours, a.limit)
    figures["unsolved"] = [seed for seed, p in enumerate(ours) if not p.solved]
    if worker is not None:
        same = ours[: a.ompl]
        figures["same_worlds"] = summary(same, a.limit)
        figures["ompl"] = {name: compare(same, planned, a.limit) for name, planned in theirs.items()}
    return figures


def cells(figures: dict[str, Any]) -> tuple[str, ...]:
    """Numbers of a row."""
    times = []
    for clock in ("wall", "cpu"):
        found = (figures[f"{clock}_{name}_ms"] for name in ("median", "p99"))
        words = (f"> {1e3 * figures['limit_s']:.0f}" if value is None else number(value) for value in found)
        times.append(" / ".join(words))
    share = f"{figures['solved']}/{figures['worlds']}"
    rates = (number(figures["edges_per_second"]), number(figures["edges_per_cpu_second"]))
    return (share, *times, number(figures["edges_median"]), *rates)


def sheet(measured: dict[str, Any]) -> Sheet:
    """The table: every set, then both planners in the worlds they share."""
    rows, notes = [], []
    for name, figures in measured["sets"].items():
        rows.append((f"CL-RRT; {name}", *cells(figures), "–"))
        if "ompl" in figures:
            rows.append((f"CL-RRT; {name}, OMPL's worlds", *cells(figures["same_worlds"]), "1"))
        for tuning, theirs in figures.get("ompl", {}).items():
            ratio = f"{'≥ ' if theirs['wall_ratio_is_bound'] else ''}{theirs['wall_ratio']:.0f}"
            rows.append((f"OMPL {measured['ompl']} RRT, {tuning}; {name}", *cells(theirs), ratio))
    if "ompl" in measured:
        held = "; ".join(f"{name}: {t.goal_bias}, 1 to {t.longest}" for name, t in TUNINGS.items())
        notes.append(
            "Edges are propagations over one period, blocked ones included. OMPL's medians are of few worlds "
            f"and one random stream. Its goal bias, and periods a control is held for: {held}."
        )
    if "ompl_missing" in measured:
        notes.append(f"OMPL: not measured ({measured['ompl_missing'].splitlines()[0]}).")
    columns = (
        "planner, set",
        "solved",
        "wall ms, median / p99",
        "CPU ms, median / p99",
        "edges, median",
        "edges/s",
        "edges/CPU s",
        "wall median / CL-RRT's",
    )
    return Sheet("First solution in a known map", columns, rows, notes)


def start_ompl(a: Settings, measured: dict[str, Any]) -> OmplWorker | None:
    """Start OMPL if it is wanted and can be had; say so in `measured`."""
    if a.ompl < 1:
        return None
    try:
        worker = OmplWorker(a.vehicle, PERIOD, a.cache.resolve())
    except (OSError, RuntimeError) as error:
        measured["ompl_missing"] = str(error)
        print(f"OMPL: not measured.\n{error}", file=sys.stderr)
        return None
    measured["ompl"] = worker.version
    return worker


def main(a: Settings) -> None:
    """Plan, print the table and save the figures."""
    for name in a.sets:
        if name not in SETS:
            raise SystemExit(f"--sets must be among {', '.join(SETS)}, got {name!r}")
    for density in a.density:
        if density not in DENSITIES:
            raise SystemExit(f"--density must be among {', '.join(map(str, DENSITIES))}, got {density}")
    if a.worlds < 1 or not a.limit > 0.0:
        raise SystemExit(f"--worlds and --limit must be positive, got {a.worlds} and {a.limit}")
    arguments = {key: value for key, value in dataclasses.asdict(a).items() if key != "cache"}
    measured: dict[str, Any] = {"arguments": arguments, "sets": {}}
    worker = start_ompl(a, measured)
    grower = Grower(a)
    try:
        warm = dataclasses.replace(a, worlds=WARM_UPS, ompl=2)
        run_set(a.sets[0], a.density[0], warm, grower, worker)
        for density in a.density:
            for name in a.sets:
                measured["sets"][f"{name}, {density} spheres"] = run_set(name, density, a, grower, worker)
    finally:
        if worker is not None:
            worker.close()
    save("first_solution", "python -m benchmarks.first_solution", {"measured": measured})
    print(sheet(measured).markdown())


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
