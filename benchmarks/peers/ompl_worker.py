"""OMPL's control RRT on the worlds and with the propagation of CL-RRT; first_solution.py starts it and sends worlds.

It runs in OMPL's own environment, with NumPy, Numba and this project found through PYTHONPATH, so that an edge is the
same compiled code. A world is one line of JSON on standard input, its result one line on standard output.

What the Python API of OMPL 2.0 allows: state propagation and validity as Python functions, duration and bounds of
controls, goal bias. What it does not: a propagator that steers, control samplers and directed control samplers of
one's own, SST and PDST (none of these classes has a constructor in Python). Controls are therefore random.
"""

import json
import os
import sys
import time
from importlib.metadata import version
from typing import Any

import numpy as np
from ompl import base, control, util

from benchmarks.edges import edge_query, propagate_edges
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import VESSEL
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.world.world import World
from planners import CLRRT
from planners.cl_rrt.tree import BACKUP, Workspace, new_nodes

# An OMPL state is compound: the position, which alone makes distances, and everything else of an edge's end.
POSITION = 3
REST = 9 + 4 + 1 + 4 + 1  # the other states, controller memory, energy, reference in force, 1 if the edge was free
WIDE = 1e4  # bounds of what is not sampled for a purpose
STEP = (1.0, 1.0, 1.0, 0.5)  # a control: how far a period moves the reference from the vehicle at most, m, m, m, rad


def bounds(low: Any, high: Any) -> base.RealVectorBounds:
    """Bounds from two sequences."""
    made = base.RealVectorBounds(len(low))
    for k, (least, most) in enumerate(zip(low, high, strict=True)):
        made.setLow(k, float(least))
        made.setHigh(k, float(most))
    return made


def spaces(world: World) -> tuple[base.CompoundStateSpace, control.RealVectorControlSpace]:
    """State and control space."""
    position, rest = base.RealVectorStateSpace(POSITION), base.RealVectorStateSpace(REST)
    position.setBounds(bounds(world.lower, world.upper))
    rest.setBounds(bounds([-WIDE] * REST, [WIDE] * REST))
    states = base.CompoundStateSpace()
    states.addSubspace(position, 1.0)
    states.addSubspace(rest, 0.0)
    controls = control.RealVectorControlSpace(states, len(STEP))
    controls.setBounds(bounds([-most for most in STEP], STEP))
    return states, controls


class Edges:
    """The state propagator: CL-RRT's edge over one period, in one world."""

    def __init__(self, simulation: Simulation, goal: list[float], obstacles: list[list[float]]) -> None:
        planner, nodes = CLRRT(simulation), new_nodes(1)
        spheres = np.array(obstacles).reshape(-1, 4)
        self._work = Workspace.around(nodes, np.zeros((BACKUP, 4)), planner.simulation, spheres)
        # a node begins with a vessel: 12 states, 4 of controller memory, energy, 4 of reference
        numbers = nodes.view(np.float64).reshape(len(nodes), -1)
        self._start, self._end = numbers[0, :VESSEL], numbers[1, :VESSEL]
        self._reference = np.zeros((1, 4))
        self._query, self._constants = edge_query(self._start, np.array(goal)), planner._constants
        self.count = 0

    def propagate(self, state: Any, move: Any, duration: float, result: Any) -> None:
        """Fill `result` with the end of the period; OMPL asks for one period at a time."""
        self.count += 1
        x, y, z = state[0][0:POSITION]
        rest = state[1][0 : REST - 1]
        self._start[:] = [x, y, z, *rest]
        self._reference[0] = [x + move[0], y + move[1], z + move[2], rest[-1] + move[3]]
        free = propagate_edges(self._work, self._query, self._constants, self._reference)
        end = self._end.tolist()
        result[0][0:POSITION] = end[:POSITION]
        result[1][0:REST] = [*end[POSITION:], float(free)]


def is_valid(state: Any) -> bool:
    """Whether the edge that led here kept its clearance, stayed in bounds, and crossed smoothly if it crossed."""
    return state[1][REST - 1] > 0.0


def solve(simulation: Simulation, request: dict[str, Any]) -> dict[str, Any]:
    """Plan in one world until the first solution or the limit."""
    world = simulation.world
    edges = Edges(simulation, request["goal"], request["obstacles"])
    states, controls = spaces(world)
    setup = control.SimpleSetup(controls)
    setup.setStatePropagator(edges.propagate)
    setup.setStateValidityChecker(is_valid)
    information = setup.getSpaceInformation()
    information.setPropagationStepSize(simulation.period)
    information.setMinMaxControlDuration(1, request["longest"])
    start, goal = states.allocState(), states.allocState()
    row = request["row"]
    start[0][0:POSITION], start[1][0:REST] = row[:POSITION], [*row[POSITION:], 1.0]
    goal[0][0:POSITION], goal[1][0:REST] = request["goal"], [0.0] * (REST - 1) + [1.0]
    setup.setStartAndGoalStates(start, goal, world.goal_radius)
    planner = control.RRT(information)
    planner.setGoalBias(request["goal_bias"])
    setup.setPlanner(planner)
    setup.setup()
    wall, cpu = time.perf_counter(), time.process_time()
    setup.solve(request["limit"])
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return {"solved": setup.haveExactSolutionPath(), "wall": wall, "cpu": cpu, "edges": edges.count}


def main() -> None:
    """Answer one line for each world, after a first line with the version."""
    # what a library prints goes to standard error; not tied to one core, as CL-RRT is not
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    util.setLogLevel(util.LOG_NONE)
    util.RNG.setSeed(1)  # of the whole process; the planners offer none of their own
    simulation = Simulation(named_vehicle(sys.argv[1]), World(), float(sys.argv[2]))
    print(json.dumps({"version": version("ompl")}), file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(solve(simulation, json.loads(line))), file=answers, flush=True)


if __name__ == "__main__":
    main()
