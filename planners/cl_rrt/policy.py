"""The CL-RRT as a policy: Algorithm 2's loop over periods, and the budget of each."""

import copy
import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._memory import packed
from planners.belief import Belief
from planners.caution import caution_for
from planners.cl_rrt.execute import Constants, Query, cycle
from planners.cl_rrt.expand import ANY_MEDIUM, CAREFUL, DRAWS, EDGE_TIME, STRAIGHT_ON
from planners.cl_rrt.memory import Memory, Report, first_memory
from planners.cl_rrt.objective import objective_params
from planners.cl_rrt.settings import CLRRTSettings
from planners.cl_rrt.stopping import safe_speed
from planners.cl_rrt.tree import BACKUP, Workspace
from planners.cl_rrt.view import TreeView, tree_view
from planners.disturbance import Estimator, Sight
from planners.policy import Known, Observation, PlannerPolicy, known, whole_number
from planners.refusal import refusal

_CHUNK = 8  # samples between looks at the clock
_MOVED = 0.5  # m: a vehicle this far from its prediction was not flown by this planner; the tree is stale
_PATIENCE = 20.0  # s of a flight after which crossings keep less far from walls, for what a current may do
_BOLDER = (1.0, 0.75, 0.5)  # of that distance, one after another
_CAREFUL_AFTER, _ANY_MEDIUM_AFTER = 2, 8  # half seconds without a path before samples are sought further afield


class CLRRT(PlannerPolicy):
    """Closed-loop RRT for a vehicle that flies and dives (paper, Algs. 1 and 2), as a recurrent policy.

    Every edge it sends was propagated with the environment's own kernel and verified to be followed by a stop in
    sensed free space, so the vehicle never hits an obstacle it could sense in time. The state returned by `predict`
    holds one `Memory` an environment, with the last cycle's `Report`.

    Args:
        belief: the `Belief`, or any model, to plan with.
        iterations: samples a cycle; results then depend on the seed alone.
        time_budget: seconds a cycle may take instead (the paper's real-time loop; not reproducible).
        objective: what a path costs: "time" (s), "energy" (J), a number (joules that a second is worth, W), "length"
            (m), or "paper": the branch that ends closest to the goal, crossing where the line to a sample meets the
            transition zone. Where joules count, so does how fast to swim.
        level: of the weather to be ready for, 0 to 5. Above 0 it estimates the disturbance from what it observes,
            predicts with that, and keeps farther from everything, see `planners.caution.caution_at`. Its report says
            why it waits, where forces forbid what it should do.
        promise: share of flights, in that level's weather, that should stay within what stops keep from spheres: a
            measured tube then takes the place of margins that were tried, see `planners.tube`. None for the margins.
        latency: True to use in each period what was planned during the one before, from the predicted state, as a
            vehicle must whose planning takes a whole period; it flies slower, to stop within what it sensed then.
        seed: of the random stream; every episode starts it anew.
        settings: see `CLRRTSettings`.

    Raises:
        ValueError: a budget that is not positive, an unknown objective, no level, a promise that no tube can keep.
    """

    def __init__(
        self,
        belief: Belief | Any,
        *,
        iterations: int = 100,
        time_budget: float | None = None,
        objective: str | float = "time",
        level: int = 0,
        promise: float | None = None,
        latency: bool = False,
        seed: int = 0,
        settings: CLRRTSettings | None = None,
    ) -> None:
        """Check the budget, flatten the settings and measure how fast the vehicle may fly and still stop."""
        self.iterations = whole_number("iterations", iterations, 1)
        self.seed = whole_number("seed", seed, 0)
        if time_budget is not None and not 0.0 < time_budget < np.inf:
            raise ValueError(f"time_budget must be positive (s), got {time_budget!r}")
        if not isinstance(latency, bool):
            raise ValueError(f"latency must be True or False, got {latency!r}")
        self.belief = Belief.of(belief)
        self.caution = caution_for(self.belief, level, promise)
        self.estimator = Estimator(self.belief, weathered=level > 0)
        self.simulation = self.estimator.simulation
        self.time_budget = time_budget
        self.latency = latency
        margins = CLRRTSettings(margin=self.caution.edge_margin, rest_margin=self.caution.rest_margin)
        self.settings = margins if settings is None else settings
        envelope = self.belief.envelope
        calm = self.belief.simulation()
        costs = objective_params(calm, objective)
        self.cruise_speed = safe_speed(calm, 2 if latency else 1)
        packs = (self._packed_settings(share, objective != "paper") for share in _BOLDER)
        tube = self.caution.tube
        self._constants = tuple(Constants(packed(envelope), pack, packed(costs), tube) for pack in packs)

    def _packed_settings(self, share: float, prune: bool) -> NDArray[np.float64]:
        """Pack the settings, with a share of the distance that crossings keep from walls."""
        caution = self.caution._replace(drift=share * self.caution.drift)
        return packed(self.settings.params(self.cruise_speed * self.belief.period, caution, prune=prune))

    def act(self, now: Known, memory: Memory | None) -> tuple[NDArray[np.float64], Memory]:
        """Run one cycle of the execution loop (Alg. 2); return the reference (4,) and the new memory."""
        memory = first_memory(self.settings.max_nodes, now.reference) if memory is None else memory
        memory = replace(memory, sight=self.estimator.look(now, memory.sight))
        if not self.latency:
            return self._decide(now, now.state[:3], memory)
        sending = now.reference if memory.pending is None else memory.pending
        # the end of this period under the reference sent now (Alg. 2, lines 4-8)
        ahead = self.estimator.ahead(now, sending.astype(np.float32).astype(np.float64), memory.sight)
        reference, memory = self._decide(ahead, now.state[:3], memory)
        return sending, replace(memory, pending=reference)

    def _decide(self, start: Known, eye: NDArray[np.float64], memory: Memory) -> tuple[NDArray[np.float64], Memory]:
        """Plan from `start` with what was sensed from `eye`; return the reference for the period that begins there."""
        started = time.perf_counter()
        work = self._workspace(memory.nodes.copy(), memory.backup.copy(), start, memory.sight)
        size, first, stop, end = self._run(work, start, eye, memory, started)
        if first < 0:
            why = refusal(self.belief, self.caution, memory.sight, start.goal[2])
            return self._safety_action(memory, work, size, time.perf_counter() - started, why)
        nodes, depth, i = work.nodes, 0, end
        while i > 0:
            depth, i = depth + 1, int(nodes["parent"][i])
        cost = float(nodes["cost"][end] + nodes["to_go"][end])
        seconds = time.perf_counter() - started
        report = Report(size, int(work.edges[0]), depth, cost, bool(nodes["goal"][end]), seconds, 0)
        known_now = len(start.obstacles)
        cycle, sight = memory.cycle + 1, memory.sight
        memory = Memory(nodes, work.backup, stop, size, first, known_now, cycle, 0, None, report, sight)
        return nodes["reference"][first].copy(), memory

    def _workspace(
        self, nodes: np.ndarray, backup: NDArray[np.float64], start: Known, sight: Sight | None
    ) -> Workspace:
        around = self.estimator.conditions(sight)
        return Workspace.around(nodes, backup, self.simulation, start.obstacles, around)

    def _run(
        self, work: Workspace, start: Known, eye: NDArray[np.float64], memory: Memory, started: float
    ) -> tuple[int, int, int, int]:
        """Grow and choose within the budget."""
        random = np.random.Generator(np.random.Philox(key=self.seed, counter=memory.cycle))
        root = memory.root
        if root >= 0 and np.abs(memory.nodes["state"][root][:3] - start.state[:3]).max() > _MOVED:
            root = -1
        waiting = memory.waiting * self.belief.period / EDGE_TIME
        roam = STRAIGHT_ON if waiting < _CAREFUL_AFTER else CAREFUL if waiting < _ANY_MEDIUM_AFTER else ANY_MEDIUM
        size, begin, done = memory.size, True, False
        while not done:
            if self.time_budget is None:
                samples, done = self.iterations, True
            else:
                samples, done = _CHUNK, time.perf_counter() - started > self.time_budget
            query = Query(
                start=start.vessel,
                goal=start.goal,
                eye=eye,
                draws=random.random(samples * DRAWS),
                size=size,
                root=root,
                since=self.belief.period if self.latency else 0.0,
                known_before=memory.known,
                held=memory.backup[0],
                holds=memory.stop == 1,
                roam=roam,
                iterations=samples,
                begin=begin,
                finish=done,
            )
            bolder = min(int(memory.cycle * self.belief.period / _PATIENCE), len(_BOLDER) - 1)
            size, first, stop, end = cycle(work, query, self._constants[bolder])
            begin = False
        return size, first, stop, end

    @staticmethod
    def _safety_action(
        memory: Memory, work: Workspace, size: int, seconds: float, why: str | None
    ) -> tuple[NDArray[np.float64], Memory]:
        """Go on with the stop verified last; its final reference holds for good, but for a retreat under water."""
        if memory.stop > 1:
            reference, backup, stop = memory.backup[0], np.roll(memory.backup, -1, axis=0), memory.stop - 1
        else:
            reference, backup, stop = work.backup[0], np.tile(work.backup[0], (BACKUP, 1)), 1
        waiting = memory.waiting + 1
        report = Report(size, int(work.edges[0]), 0, np.inf, False, seconds, waiting, why)
        cycle, sight = memory.cycle + 1, memory.sight
        memory = Memory(memory.nodes, backup, stop, cycle=cycle, waiting=waiting, report=report, sight=sight)
        return reference.copy(), memory

    def grow_tree(self, observation: Observation, iterations: int) -> TreeView:
        """Grow a tree from one observation without flying, as in the paper's Fig. 5.

        Args:
            observation: Dict observation; put every sphere of the scenario into `obstacles` to plan with a known map.
            iterations: samples.
        """
        start = known(observation)
        memory = first_memory(self.settings.max_nodes, start.reference)
        work = self._workspace(memory.nodes, memory.backup, start, self.estimator.look(start, None))
        whole = copy.copy(self)
        whole.iterations, whole.time_budget = whole_number("iterations", iterations, 1), None
        # a picture of the tree wants its other branches too
        whole._constants = (self._constants[0]._replace(settings=self._packed_settings(1.0, False)),) * len(_BOLDER)
        size = whole._run(work, start, start.state[:3], memory, 0.0)[0]
        return tree_view(work.nodes[:size])
