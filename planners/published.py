"""The CL-RRT as the paper prints it, for comparison with the one that is made safe."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._memory import packed
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import row_at
from hydrone_gym.surface import in_air
from planners.belief import Belief
from planners.check import AIR_GATE, WATER_GATE
from planners.cl_rrt.execute import Constants, Query, cycle
from planners.cl_rrt.expand import DRAWS, STRAIGHT_ON
from planners.cl_rrt.objective import objective_params
from planners.cl_rrt.settings import CLRRTSettings
from planners.cl_rrt.tree import BACKUP, CROSSING, OPEN, Workspace, new_nodes
from planners.policy import Known, PlannerPolicy, whole_number

_SPEED_SHARE = 0.95  # of the speed limit, at which references move in air
_FULL = 0.75  # share of its capacity at which a tree starts anew


class PublishedMemory(NamedTuple):
    """What one environment's planner remembers between periods; never changed once returned."""

    nodes: np.ndarray  # the tree
    size: int
    root: int  # node to root the tree at, -1 for a new tree
    known: int  # spheres the tree was pruned with
    cycle: int


class PublishedCLRRT(PlannerPolicy):
    """CL-RRT with the printed Algorithms 1 and 2 and nothing that was added to make `CLRRT` safe and quick.

    The tree grows from the nearest node, without a margin, and crosses where the line to a sample meets the transition
    zone. It is kept from cycle to cycle, rooted where the vehicle is (Alg. 2, line 1). The branch that ends closest to
    the goal is re-propagated and sent if it is free, else pruned and another one chosen (lines 10-18). Where no branch
    ends closer than the vehicle is already, the vehicle hovers (line 12).

    What is left out of `CLRRT`: the stop check, so a branch may lead to where no stop is possible once something new is
    sensed; the verified backup, so the hover is not checked either; branch choice and node order by cost; margins; the
    way out of a pocket through the other medium. What is kept: samples that could not shorten a path already found are
    skipped; edges and the vertical crossing are those of `CLRRT`, with its cures for a reference that runs away from
    the vehicle. So this is the same planner less its safety, and no literal copy.

    Args:
        belief: the `Belief`, or any model, to plan with.
        iterations: samples a cycle.
        seed: of the random stream; every episode starts it anew.

    Raises:
        ValueError: a budget or seed out of range.
    """

    def __init__(self, belief: Belief | Any, *, iterations: int = 100, seed: int = 0) -> None:
        """Check the budget."""
        self.iterations = whole_number("iterations", iterations, 1)
        self.seed = whole_number("seed", seed, 0)
        self._belief = Belief.of(belief)
        self._simulation = self._belief.simulation()
        self._settings = CLRRTSettings(margin=0.0)
        envelope = self._belief.envelope
        params = self._settings.params(_SPEED_SHARE * envelope.cruise * self._belief.period)
        costs = objective_params(self._simulation, "paper")
        self._constants = Constants(packed(envelope), packed(params), packed(costs))

    def act(self, now: Known, memory: PublishedMemory | None) -> tuple[NDArray[np.float64], PublishedMemory]:
        """Run one cycle of the execution loop; return the reference (4,) and the new memory."""
        if memory is None:
            memory = PublishedMemory(new_nodes(self._settings.max_nodes), 0, -1, 0, 0)
        count = len(now.obstacles)
        nodes, size = self._grow(now, memory)
        while (end := _closest(nodes[:size])) > 0:
            failed = self._propagate(nodes, end, now)
            if failed < 0:
                first = _path(nodes, end)[0]
                return nodes["reference"][first].copy(), PublishedMemory(nodes, size, first, count, memory.cycle + 1)
            _prune(nodes[:size], failed)
        # no path: the tree waits with the vehicle and goes on growing; from the middle of a crossing it cannot
        root = 0 if nodes["kind"][0] == OPEN else -1
        return self._hover(now), PublishedMemory(nodes, size, root, count, memory.cycle + 1)

    def _hover(self, now: Known) -> NDArray[np.float64]:
        """The safety action: stay where the vehicle is, a little ahead along its velocity and outside the zone."""
        air, limits = in_air(now.state[2]), self._belief.envelope
        x, y, z = now.state[:3] + (limits.ahead_air if air else limits.ahead_water) * now.state[6:9]
        return np.array(
            [x, y, max(z, AIR_GATE) if air else min(z, -WATER_GATE), now.reference[3] if air else now.state[5]]
        )

    def _grow(self, now: Known, memory: PublishedMemory) -> tuple[np.ndarray, int]:
        """Root the tree at the vehicle, prune what new spheres block, and expand it; return a new tree."""
        work = Workspace.around(memory.nodes.copy(), np.zeros((BACKUP, 4)), self._simulation, now.obstacles)
        random = np.random.Generator(np.random.Philox(key=self.seed, counter=memory.cycle))
        query = Query(
            start=now.vessel,
            goal=now.goal,
            eye=now.state[:3],
            draws=random.random(self.iterations * DRAWS),
            size=memory.size,
            root=memory.root if memory.size < _FULL * len(memory.nodes) else -1,
            known_before=memory.known,
            held=now.reference,
            holds=False,
            roam=STRAIGHT_ON,
            iterations=self.iterations,
            begin=True,
            finish=False,  # choosing is done here
        )
        size, *_ = cycle(work, query, self._constants)
        return work.nodes, size

    def _propagate(self, nodes: np.ndarray, end: int, now: Known) -> int:
        """Propagate the branch to node `end` again from the root, into the nodes; return the node that fails or -1."""
        row: Any = row_at(now.state, now.goal)
        row["integral"], row["reference"] = now.integral, now.reference
        rollout = Rollout(self._simulation, now.obstacles)
        for i in _path(nodes, end):
            node = nodes[i]
            flown = rollout.fly(row, node["reference"])
            vertical = node["kind"] == CROSSING or nodes["kind"][node["parent"]] == CROSSING
            if flown.outcome not in (RUNNING, GOAL) or (flown.crossings > 0.0 and not vertical):
                return int(i)
            node["state"], node["integral"] = row["state"][0], row["integral"][0]
            if flown.outcome == GOAL:
                break
        return -1


def _closest(tree: np.ndarray) -> int:
    """Return the node closest to the goal where a path may end, 0 (the root) if none is closer than the vehicle."""
    open_end = (tree["kind"] == OPEN) & (tree["unsafe"] == 0)
    distance = np.where(open_end, tree["to_go"], np.inf)  # the paper's cost-to-go is the distance
    distance[tree["goal"] != 0] = 0.0
    distance[tree["dead"] != 0] = np.inf
    distance[0] = tree["to_go"][0]
    return int(np.argmin(distance))


def _path(nodes: np.ndarray, end: int) -> list[int]:
    """Return the nodes from the root's child to node `end`."""
    path = [end]
    while nodes["parent"][path[-1]] > 0:
        path.append(int(nodes["parent"][path[-1]]))
    return path[::-1]


def _prune(tree: np.ndarray, top: int) -> None:
    """Mark a node and all that hangs on it dead; parents come before their children."""
    parents, dead = tree["parent"].tolist(), tree["dead"].tolist()
    dead[top] = 1
    for i in range(top + 1, len(dead)):
        dead[i] |= dead[parents[i]]
    tree["dead"] = dead
