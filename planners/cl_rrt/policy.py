"""The CL-RRT as a policy: what travels between cycles, and the budget of each."""

import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.simulation import Simulation
from planners.cl_rrt.execute import cycle
from planners.cl_rrt.expand import DRAWS
from planners.cl_rrt.settings import CLRRTSettings
from planners.cl_rrt.tree import BACKUP, new_nodes, new_workspace
from planners.policy import Known, Observation, PlannerPolicy, known, simulation_of

_CHUNK = 8  # samples between looks at the clock
_MOVED = 0.5  # m: a vehicle this far from its prediction was not flown by this planner; the tree is stale
_PATIENCE = 8  # cycles without a path before crossings are tried that the mission does not need


@dataclass(frozen=True)
class Memory:
    """What one environment's planner remembers between periods; never changed once returned."""

    nodes: np.ndarray  # the tree
    size: int
    root: int  # node predicted for the next observation, -1 if none
    known: int  # obstacles the tree was grown with
    backup: NDArray[np.float64]  # verified references that end in a stop
    stop: int  # how many of them
    cycle: int
    waiting: int = 0  # cycles since a path was last sent


class TreeView(NamedTuple):
    """A tree as arrays, for looking at it."""

    edges: NDArray[np.float64]  # (E, 2, 3) reference at the parent and at the node, m
    air: NDArray[np.bool_]  # (E,) whether the node lies in air
    time: NDArray[np.float64]  # (E,) cost-to-come, s
    path: NDArray[np.intp]  # edges of the best path to the goal, in order; empty if none


class CLRRT(PlannerPolicy):
    """Closed-loop RRT for a vehicle that flies and dives (paper, Algs. 1 and 2), as a recurrent policy.

    Every edge it sends was propagated with the environment's own kernel and verified to be followed by a stop in
    sensed free space, so the vehicle never hits an obstacle it could sense in time.

    Args:
        simulation: model, world and period to plan with.
        iterations: samples a cycle; results then depend on the seed alone.
        time_budget: seconds a cycle may take instead (the paper's real-time loop; not reproducible).
        seed: of the random stream; every episode starts it anew.
        settings: see `CLRRTSettings`.

    Raises:
        ValueError: a budget that is not positive.
    """

    def __init__(
        self,
        simulation: Simulation,
        *,
        iterations: int = 60,
        time_budget: float | None = None,
        seed: int = 0,
        settings: CLRRTSettings | None = None,
    ) -> None:
        """Check the budget and flatten the settings."""
        if isinstance(iterations, bool) or not isinstance(iterations, int) or iterations < 1:
            raise ValueError(f"iterations must be a whole number of at least 1, got {iterations!r}")
        if time_budget is not None and not 0.0 < time_budget < np.inf:
            raise ValueError(f"time_budget must be positive (s), got {time_budget!r}")
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise ValueError(f"seed must be a whole number that is not negative, got {seed!r}")
        self.simulation = simulation
        self.iterations = iterations
        self.time_budget = time_budget
        self.seed = seed
        self.settings = CLRRTSettings() if settings is None else settings
        self._params = self.settings.params()

    @classmethod
    def for_env(
        cls,
        env: Any,
        *,
        iterations: int = 60,
        time_budget: float | None = None,
        seed: int = 0,
        settings: CLRRTSettings | None = None,
    ) -> "CLRRT":
        """Make a planner for an environment, with its vehicle, world and period; arguments as for the class."""
        simulation = simulation_of(env)
        return cls(simulation, iterations=iterations, time_budget=time_budget, seed=seed, settings=settings)

    def act(self, now: Known, memory: Memory | None) -> tuple[NDArray[np.float64], Memory]:
        """Run one cycle of the execution loop (Alg. 2); return the reference (4,) and the new memory."""
        if memory is None:
            backup = np.tile(now.reference, (BACKUP, 1))
            memory = Memory(new_nodes(self.settings.max_nodes), 0, -1, 0, backup, 1, 0)
        work = new_workspace(memory.nodes.copy(), now.obstacles, memory.backup.copy())
        size, first, stop = self._run(work, now, memory)
        if first < 0:
            return self._safety_action(memory)
        reference = work.nodes["reference"][first].copy()
        count = len(now.obstacles)
        return reference, Memory(work.nodes, size, first, count, work.backup, stop, memory.cycle + 1)

    def _run(self, work: Any, now: Known, memory: Memory) -> tuple[int, int, int]:
        """Grow and choose within the budget."""
        started = time.perf_counter()
        observed = np.concatenate([now.state, now.integral, now.reference])
        random = np.random.Generator(np.random.Philox(key=self.seed, counter=memory.cycle))
        root = memory.root
        if root >= 0 and np.abs(memory.nodes["state"][root][:3] - now.state[:3]).max() > _MOVED:
            root = -1
        size, begin, done = memory.size, True, False
        while not done:
            if self.time_budget is None:
                samples, done = self.iterations, True
            else:
                samples = _CHUNK
                done = time.perf_counter() - started > self.time_budget
            size, first, stop = cycle(
                work,
                self.simulation.values,
                now.goal,
                observed,
                size,
                root,
                memory.known,
                random.random(samples * DRAWS),
                samples,
                self._params,
                int(memory.waiting >= _PATIENCE),
                self.simulation.ticks,
                begin,
                done,
            )
            begin = False
        return size, first, stop

    @staticmethod
    def _safety_action(memory: Memory) -> tuple[NDArray[np.float64], Memory]:
        """Go on with the stop verified last; its final reference holds for good."""
        reference = memory.backup[0].copy()
        backup, stop = memory.backup, memory.stop
        if stop > 1:
            backup, stop = np.roll(backup, -1, axis=0), stop - 1
        return reference, Memory(memory.nodes, 0, -1, 0, backup, stop, memory.cycle + 1, memory.waiting + 1)

    def grow_tree(self, observation: Observation, iterations: int) -> TreeView:
        """Grow a tree from one observation without flying, as in the paper's Fig. 5.

        Args:
            observation: Dict observation; put every sphere of the scenario into `obstacles` to plan with a known map.
            iterations: samples.
        """
        now = known(observation)
        work = new_workspace(new_nodes(self.settings.max_nodes), now.obstacles, np.zeros((BACKUP, 4)))
        observed = np.concatenate([now.state, now.integral, now.reference])
        draws = np.random.default_rng(self.seed).random(iterations * DRAWS)
        values, ticks = self.simulation.values, self.simulation.ticks
        size, _, _ = cycle(
            work, values, now.goal, observed, 0, -1, 0, draws, iterations, self._params, 0, ticks, True, False
        )
        nodes = work.nodes[:size]
        edges = np.stack([nodes["reference"][nodes["parent"][1:], :3], nodes["reference"][1:, :3]], axis=1)
        ends = np.flatnonzero(nodes["goal"])
        path: list[int] = []
        i = int(ends[np.argmin(nodes["time"][ends])]) if len(ends) else 0
        while i > 0:
            path.append(i - 1)
            i = int(nodes["parent"][i])
        return TreeView(edges, nodes["state"][1:, 2] > 0.0, nodes["time"][1:], np.array(path[::-1], np.intp))
