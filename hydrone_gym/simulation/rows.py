"""Rows: the plain storage of vehicles, and the drivers that run them through the kernel."""

import numpy as np

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.physics.trigonometry import wrap
from hydrone_gym.simulation.advance import advance
from hydrone_gym.simulation.block import ROW
from hydrone_gym.simulation.model import unpack_model


def new_rows(count: int) -> np.ndarray:
    """Return zeroed storage for a number of vehicles, dtype `ROW`."""
    return np.zeros(count, ROW)


@inlined
def load_vehicle(b, i, state, integral, old, new):
    """Put a vehicle into lane i: state (12), controller memory (4), and the reference's move over the period."""
    b.x[i], b.y[i], b.z[i] = state[0], state[1], state[2]
    b.phi[i], b.theta[i], b.psi[i] = state[3], state[4], state[5]
    b.vx[i], b.vy[i], b.vz[i] = state[6], state[7], state[8]
    b.p[i], b.q[i], b.r[i] = state[9], state[10], state[11]
    b.integral_z[i], b.integral_phi[i], b.integral_theta[i], b.integral_psi[i] = (
        integral[0],
        integral[1],
        integral[2],
        integral[3],
    )
    b.old_x[i], b.old_y[i], b.old_z[i], b.old_psi[i] = old[0], old[1], old[2], old[3]
    b.move_x[i] = new[0] - old[0]
    b.move_y[i] = new[1] - old[1]
    b.move_z[i] = new[2] - old[2]
    b.move_psi[i] = wrap(new[3] - old[3])


@inlined
def store_vehicle(b, i, state, integral):
    """Take a vehicle's state (12) and controller memory (4) out of lane i."""
    state[0], state[1], state[2] = b.x[i], b.y[i], b.z[i]
    state[3], state[4], state[5] = b.phi[i], b.theta[i], b.psi[i]
    state[6], state[7], state[8] = b.vx[i], b.vy[i], b.vz[i]
    state[9], state[10], state[11] = b.p[i], b.q[i], b.r[i]
    integral[0], integral[1] = b.integral_z[i], b.integral_phi[i]
    integral[2], integral[3] = b.integral_theta[i], b.integral_psi[i]


@inlined
def load_row(b, i, row, reference):
    """Put a row into lane i, with the reference it moves to over the period."""
    load_vehicle(b, i, row.state, row.integral, row.reference, reference)
    b.goal_x[i], b.goal_y[i], b.goal_z[i] = row.goal[0], row.goal[1], row.goal[2]
    b.ticks[i], b.energy[i], b.clearance[i] = row.ticks, row.energy, row.clearance
    b.outcome[i], b.crossings[i] = row.outcome, row.crossings


@inlined
def store_row(b, i, row):
    """Put lane i back into its row; the reference is the driver's business."""
    store_vehicle(b, i, row.state, row.integral)
    row.ticks, row.energy, row.clearance = b.ticks[i], b.energy[i], b.clearance[i]
    row.outcome, row.crossings = b.outcome[i], b.crossings[i]


@inlined
def copy_log(source, log, i):
    """Copy a row's crossing log to lane i's. Loops: array assignment costs seconds of compiling."""
    for slot in range(source.shape[0]):
        for c in range(source.shape[1]):
            log[i, slot, c] = source[slot, c]


@inlined
def restore_log(log, i, destination):
    """Copy lane i's crossing log back to its row's."""
    for slot in range(destination.shape[0]):
        for c in range(destination.shape[1]):
            destination[slot, c] = log[i, slot, c]


@kernel
def advance_rows(rows, references, obstacles, closest, count, values, first, last, ticks, block, log):
    """Advance rows in place through ticks [first, last) of a period, a block of lanes at a time.

    Args:
        rows: (n,) dtype `ROW`.
        references: (n, 4) what the reference moves to by the end of the period: m, m, m, rad.
        obstacles: (blocks, 4 * count * lanes) lane-major, see `advance`.
        closest: (blocks, count * lanes), updated.
        count: number of obstacles.
        values: packed `Model`.
        first, last, ticks: which part of the period; the rows' references move on when last == ticks.
        block, log: working storage of one block.
    """
    model = unpack_model(values)
    lanes = block[0].x.size
    n = rows.size
    for k in range((n + lanes - 1) // lanes):
        start = k * lanes
        for i in range(lanes):
            # lanes beyond the last row repeat it and are thrown away
            row = min(start + i, n - 1)
            load_row(block[0], i, rows[row], references[row])
            copy_log(rows[row].crossing_log, log, i)
        advance(block, log, obstacles[k], closest[k], count, model, first, last, ticks)
        for i in range(min(lanes, n - start)):
            store_row(block[0], i, rows[start + i])
            restore_log(log, i, rows[start + i].crossing_log)
            if last == ticks:
                for c in range(4):
                    rows[start + i].reference[c] = references[start + i, c]
