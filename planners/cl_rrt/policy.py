"""The CL-RRT as a policy: Algorithm 2's loop over periods, and the budget of each."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.simulation import Simulation, row_at
from planners.cl_rrt.execute import cycle
from planners.cl_rrt.expand import ANY_MEDIUM, CAREFUL, DRAWS, STRAIGHT_ON
from planners.cl_rrt.memory import Memory, Report, first_memory
from planners.cl_rrt.objective import objective_params
from planners.cl_rrt.settings import CLRRTSettings
from planners.cl_rrt.stopping import safe_speed
from planners.cl_rrt.tree import Workspace, new_workspace
from planners.cl_rrt.view import TreeView, tree_view
from planners.policy import Known, Observation, PlannerPolicy, known, simulation_of

_CHUNK = 8  # samples between looks at the clock
_MOVED = 0.5  # m: a vehicle this far from its prediction was not flown by this planner; the tree is stale
_CAREFUL_AFTER, _ANY_MEDIUM_AFTER = 2, 8  # cycles without a path before samples are sought further afield


class CLRRT(PlannerPolicy):
    """Closed-loop RRT for a vehicle that flies and dives (paper, Algs. 1 and 2), as a recurrent policy.

    Every edge it sends was propagated with the environment's own kernel and verified to be followed by a stop in
    sensed free space, so the vehicle never hits an obstacle it could sense in time. The state returned by `predict`
    holds one `Memory` an environment, with the last cycle's `Report`.

    Args:
        simulation: model, world and period to plan with.
        iterations: samples a cycle; results then depend on the seed alone.
        time_budget: seconds a cycle may take instead (the paper's real-time loop; not reproducible).
        objective: what a path costs: "time" (s), "energy" (J), "length" (m), or "paper": the branch that ends closest
            to the goal, crossing where the line to a sample meets the transition zone.
        latency: True to use in each period what was planned during the one before, from the predicted state, as a
            vehicle must whose planning takes a whole period; it flies slower, to stop within what it sensed then.
        seed: of the random stream; every episode starts it anew.
        settings: see `CLRRTSettings`.

    Raises:
        ValueError: a budget that is not positive, an unknown objective.
    """

    def __init__(
        self,
        simulation: Simulation,
        *,
        iterations: int = 100,
        time_budget: float | None = None,
        objective: str = "time",
        latency: bool = False,
        seed: int = 0,
        settings: CLRRTSettings | None = None,
    ) -> None:
        """Check the budget, flatten the settings and measure how fast the vehicle may fly and still stop."""
        if isinstance(iterations, bool) or not isinstance(iterations, int) or iterations < 1:
            raise ValueError(f"iterations must be a whole number of at least 1, got {iterations!r}")
        if time_budget is not None and not 0.0 < time_budget < np.inf:
            raise ValueError(f"time_budget must be positive (s), got {time_budget!r}")
        if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
            raise ValueError(f"seed must be a whole number that is not negative, got {seed!r}")
        if not isinstance(latency, bool):
            raise ValueError(f"latency must be True or False, got {latency!r}")
        self.simulation = simulation
        self.iterations = iterations
        self.time_budget = time_budget
        self.latency = latency
        self.seed = seed
        self.settings = CLRRTSettings() if settings is None else settings
        self._objective = objective_params(simulation, objective)
        self.cruise_speed = safe_speed(simulation, 2 if latency else 1)
        self._params = self.settings.params(self.cruise_speed * simulation.period, prune=objective != "paper")

    @classmethod
    def for_env(
        cls,
        env: Any,
        *,
        iterations: int = 100,
        time_budget: float | None = None,
        objective: str = "time",
        latency: bool = False,
        seed: int = 0,
        settings: CLRRTSettings | None = None,
    ) -> "CLRRT":
        """Make a planner for an environment, with its vehicle, world and period; arguments as for the class."""
        return cls(
            simulation_of(env),
            iterations=iterations,
            time_budget=time_budget,
            objective=objective,
            latency=latency,
            seed=seed,
            settings=settings,
        )

    def act(self, now: Known, memory: Memory | None) -> tuple[NDArray[np.float64], Memory]:
        """Run one cycle of the execution loop (Alg. 2); return the reference (4,) and the new memory."""
        memory = first_memory(self.settings.max_nodes, now.reference) if memory is None else memory
        if not self.latency:
            return self._decide(now, now.state[:3], memory)
        sending = now.reference if memory.pending is None else memory.pending
        reference, memory = self._decide(self._ahead(now, sending), now.state[:3], memory)
        return sending, replace(memory, pending=reference)

    def _ahead(self, now: Known, sending: NDArray[np.float64]) -> Known:
        """Predict the end of this period under the reference sent now (Alg. 2, lines 4-8)."""
        row: Any = row_at(now.state, now.goal)
        row["integral"], row["reference"] = now.integral, now.reference
        sent = sending.astype(np.float32).astype(np.float64)
        self.simulation.advance(row, sent[None], np.zeros((1, 0)), np.zeros((1, 0)), 0)
        return now._replace(state=row["state"][0], integral=row["integral"][0], reference=sent)

    def _decide(self, start: Known, eye: NDArray[np.float64], memory: Memory) -> tuple[NDArray[np.float64], Memory]:
        """Plan from `start` with what was sensed from `eye`; return the reference for the period that begins there."""
        started = time.perf_counter()
        work = new_workspace(memory.nodes.copy(), start.obstacles, memory.backup.copy())
        size, first, stop, end = self._run(work, start, eye, memory, started)
        if first < 0:
            return self._safety_action(memory, size, int(work.edges[0]), time.perf_counter() - started)
        nodes, depth, i = work.nodes, 0, end
        while i > 0:
            depth, i = depth + 1, int(nodes["parent"][i])
        cost = float(nodes["cost"][end] + nodes["to_go"][end])
        seconds = time.perf_counter() - started
        report = Report(size, int(work.edges[0]), depth, cost, bool(nodes["goal"][end]), seconds, 0)
        known_now = len(start.obstacles)
        memory = Memory(nodes, work.backup, stop, size, first, known_now, memory.cycle + 1, 0, None, report)
        return nodes["reference"][first].copy(), memory

    def _run(
        self, work: Workspace, start: Known, eye: NDArray[np.float64], memory: Memory, started: float
    ) -> tuple[int, int, int, int]:
        """Grow and choose within the budget."""
        observed = np.concatenate([start.state, start.integral, start.reference])
        random = np.random.Generator(np.random.Philox(key=self.seed, counter=memory.cycle))
        root = memory.root
        if root >= 0 and np.abs(memory.nodes["state"][root][:3] - start.state[:3]).max() > _MOVED:
            root = -1
        waiting = memory.waiting
        roam = STRAIGHT_ON if waiting < _CAREFUL_AFTER else CAREFUL if waiting < _ANY_MEDIUM_AFTER else ANY_MEDIUM
        size, begin, done = memory.size, True, False
        while not done:
            if self.time_budget is None:
                samples, done = self.iterations, True
            else:
                samples, done = _CHUNK, time.perf_counter() - started > self.time_budget
            size, first, stop, end = cycle(
                work,
                self.simulation.values,
                start.goal,
                observed,
                eye,
                size,
                root,
                memory.known,
                random.random(samples * DRAWS),
                samples,
                self._params,
                self._objective,
                roam,
                self.simulation.ticks,
                begin,
                done,
            )
            begin = False
        return size, first, stop, end

    @staticmethod
    def _safety_action(memory: Memory, size: int, edges: int, seconds: float) -> tuple[NDArray[np.float64], Memory]:
        """Go on with the stop verified last; its final reference holds for good."""
        reference, backup, stop = memory.backup[0].copy(), memory.backup, memory.stop
        if stop > 1:
            backup, stop = np.roll(backup, -1, axis=0), stop - 1
        waiting = memory.waiting + 1
        report = Report(size, edges, 0, np.inf, False, seconds, waiting)
        return reference, Memory(memory.nodes, backup, stop, cycle=memory.cycle + 1, waiting=waiting, report=report)

    def grow_tree(self, observation: Observation, iterations: int) -> TreeView:
        """Grow a tree from one observation without flying, as in the paper's Fig. 5.

        Args:
            observation: Dict observation; put every sphere of the scenario into `obstacles` to plan with a known map.
            iterations: samples.
        """
        start = known(observation)
        memory = first_memory(self.settings.max_nodes, start.reference)
        work = new_workspace(memory.nodes, start.obstacles, memory.backup)
        whole = CLRRT(self.simulation, iterations=iterations, seed=self.seed, settings=self.settings)
        whole._params = whole._params._replace(prune=0.0)  # a picture of the tree wants its other branches too
        size = whole._run(work, start, start.state[:3], memory, 0.0)[0]
        return tree_view(work.nodes[:size])
