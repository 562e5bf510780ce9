"""The planner's tree edges: one period of closed loop each, alone or sixteen side by side, and their strict C limit."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.c_reference.build import CReference, compiler
from benchmarks.flying import flying_rows, lane_major, near_references, simulation, spheres_out_of_the_way
from benchmarks.timing import Contestant
from hydrone_gym._jit import kernel
from planners import CLRRT
from planners.cl_rrt.edge import BLOCKED, edge
from planners.cl_rrt.execute import Query, planner_of
from planners.cl_rrt.tree import BACKUP, Workspace, new_nodes

COUNT = 256
MARGIN = 0.12  # m


@kernel
def propagate_edges(work, query, constants, references):
    """Propagate an edge from every node, as `expand_tree` does; return how many were free."""
    p, free = planner_of(work, query, constants), 0
    slot = references.shape[0]
    for k in range(references.shape[0]):
        r = references[k]
        kind, _ = edge(p, k, slot, (r[0], r[1], r[2], r[3]), MARGIN)
        if kind != BLOCKED:
            free += 1
    return free


def edge_query(start: np.ndarray, goal: np.ndarray) -> Query:
    """What edges are asked for: a vessel (21,) that tells the margin there is, and the goal (3,) in m."""
    return Query(
        start=start,
        goal=goal,
        eye=start[:3],
        draws=np.zeros(0),
        size=1,
        root=-1,
        known_before=0,
        held=start[-4:],
        holds=False,
        roam=0,
        iterations=0,
        begin=True,
        finish=False,
    )


def _planner_edges(rows: np.ndarray, references: np.ndarray, spheres: np.ndarray) -> Contestant:
    """Edges as CL-RRT propagates them: node to node, one at a time."""
    nodes, planner = new_nodes(COUNT), CLRRT(simulation(1))
    for field in ("state", "integral", "reference"):
        nodes[field][:COUNT] = rows[field]
    work = Workspace.around(nodes, np.zeros((BACKUP, 4)), planner.simulation, spheres[0])
    start = np.concatenate([rows["state"][0], rows["integral"][0], [0.0], rows["reference"][0]])
    query = edge_query(start, np.full(3, 100.0))

    def run() -> float:
        propagate_edges(work, query, planner._constants, references)
        return COUNT

    return Contestant("CL-RRT, one at a time", run)


def _batch(name: str, runner: Any, rows: np.ndarray, references: np.ndarray, spheres: np.ndarray) -> Contestant:
    """Edges as rows of a batch."""
    flat = lane_major(spheres, runner.lanes)
    closest = np.zeros((len(flat), spheres.shape[1] * runner.lanes))
    work = rows.copy()

    def run() -> float:
        work[:] = rows
        closest[:] = np.inf
        runner.advance(work, references, flat, closest, spheres.shape[1])
        return COUNT

    return Contestant(name, run)


def contestants(folder: Path) -> list[Contestant]:
    """All ways to propagate edges; C only where there is a compiler."""
    rng = np.random.default_rng(2)
    rows = flying_rows(rng, COUNT)
    references = near_references(rng, rows)
    spheres = np.repeat(spheres_out_of_the_way(rng, 1), COUNT, axis=0)
    listed = [
        _planner_edges(rows, references, spheres),
        _batch("kernel, one lane", simulation(1), rows, references, spheres),
        _batch("kernel, 16 lanes", simulation(16), rows, references, spheres),
    ]
    if compiler() is not None:
        for lanes, words in ((1, "one lane"), (16, "16 lanes")):
            ours = simulation(lanes)
            limit = CReference(lanes, ours.values, ours.ticks, folder)
            listed.append(_batch(f"strict C, {words}", limit, rows, references, spheres))
    return listed
