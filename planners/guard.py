"""What the shield does in every period, as a kernel: check a reference, and find another where it is not safe."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel, routine
from hydrone_gym._memory import gather, pointer, scatter, view
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.rollout import lane_of, of_row
from hydrone_gym.simulation.storage import Point, Pose, vehicle_of, world_of
from hydrone_gym.world.bodies import BODY, segment_distance
from planners.check import Check, clearance_left, from_walls, inside, place_of, single, state_of
from planners.hold import HELD, crosses, goes_on
from planners.stop_check import verify

_NEAR = 5.0  # m: spheres whose surface is farther are out of reach of a period, a stop and the drift after it


class GuardQuery(NamedTuple):
    """What the shield checks, an entry a row."""

    rows: np.ndarray  # (n,) dtype `ROW`: state, memory, reference in force and goal
    proposed: NDArray[np.float64]  # (n, 4) references, m and rad
    eyes: NDArray[np.float64]  # (n, 3) where the spheres were last sensed from, m
    conditions: NDArray[np.float64]  # (n, CONDITIONS) what each is believed to fly in; (n, 0) without weather
    margin: float  # clearance to keep, m
    drift: float  # distance to keep from the walls where a crossing begins, m
    room: float  # distance to keep from the walls, m
    tube: NDArray[np.float64]  # (3, TUBE_LENGTH) m, by place of the look and time since
    since: float  # s from the look to where the references begin
    spheres: NDArray[np.float64]  # (n, 4 M) known ones, unused ones `NOWHERE`
    sent: NDArray[np.float64]  # (n, 4) references to fly, written
    held: NDArray[np.float64]  # (n, 4) hovers verified last, updated
    choice: NDArray[np.int64]  # (n,) 0: as proposed, k: candidate k, HELD or RETREAT; written


@inlined
def _keep_near(spheres, s, near):
    """Copy the spheres near a place to the front of `near`; return how many they are."""
    count = 0
    for j in range(spheres.size // BODY):
        body = gather(spheres, BODY * j, 0, 1, Pose)
        if segment_distance((s.x, s.y, s.z), (s.x, s.y, s.z), body) <= _NEAR:
            scatter(near, BODY * count, 0, 1, body)
            count += 1
    return count


@inlined
def _candidate(check, proposed, s, step):
    """Return the reference that a step (scale, turn, lift) makes of the proposed one, for a vehicle at s."""
    scale, (sine, cosine), lift = step[0], sincos(step[1]), step[2]
    dx, dy, dz = proposed.x - s.x, proposed.y - s.y, proposed.z - s.z
    rx, ry = s.x + scale * (cosine * dx - sine * dy), s.y + scale * (sine * dx + cosine * dy)
    rx, ry, rz = inside(check, rx, ry, s.z + scale * dz + lift)
    return rx, ry, rz, proposed.psi


@inlined
def _four(numbers):
    return numbers[0], numbers[1], numbers[2], numbers[3]


@routine
def _first_safe(check, vessel, proposed, candidates):
    """Return (0 or the number of the first safe candidate, else HELD; the reference; the hover that stops after it)."""
    s, p = state_of(vessel), view(proposed, 0, Pose)
    wanted = _four(proposed)
    for k in range(candidates.shape[0] + 1):
        if k > 0:
            wanted = _candidate(check, p, s, candidates[k - 1])
        reference = single(wanted[0], wanted[1], wanted[2], wanted[3])
        safe, hover = verify(check, vessel, reference)
        if safe:
            return k, reference, hover
    return HELD, wanted, wanted


@kernel
def guard(query, rollout, envelope, candidates, scratch):
    """Check every row's reference and replace it where it is not safe.

    Args:
        query: `GuardQuery`.
        rollout: `Rollout.memory`, with room for M spheres.
        envelope: packed `Envelope`.
        candidates: (k, 3), see `CANDIDATES`.
        scratch: two vessels.
    """
    whole = lane_of(rollout)
    world, radius = world_of(whole.values), vehicle_of(whole.values).radius
    limits, period = view(envelope, 0, Envelope), whole.ticks * TICK
    for n in range(query.rows.size):
        row = query.rows[n]
        vessel, s = pointer(row), state_of(pointer(row))
        lane = of_row(whole, _keep_near(query.spheres[n], s, whole.obstacles), pointer(query.conditions[n]))
        margins = query.margin, clearance_left(vessel, lane, radius), query.room, from_walls(world, s), query.drift
        tube = pointer(query.tube[place_of(s.z)])
        goal, eye = view(row.goal, 0, Point), view(query.eyes[n], 0, Point)
        around = (lane, goal, eye, world, limits, radius)
        check = Check(*around, *margins, tube, query.since, period, pointer(scratch))
        held = _four(query.held[n])
        choice, reference, hover = HELD, held, held
        if not crosses(check, vessel, held):
            choice, reference, hover = _first_safe(check, vessel, query.proposed[n], candidates)
        if choice == HELD:
            choice, reference = goes_on(check, vessel, held)
            hover = reference
        query.choice[n] = choice
        scatter(query.sent[n], 0, 0, 1, Pose(reference[0], reference[1], reference[2], reference[3]))
        scatter(query.held[n], 0, 0, 1, Pose(hover[0], hover[1], hover[2], hover[3]))
