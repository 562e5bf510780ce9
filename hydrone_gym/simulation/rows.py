"""The driver that runs rows through the kernel, a block of lanes at a time."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym._memory import call, gather, pointer, scatter
from hydrone_gym.physics.trigonometry import wrap
from hydrone_gym.simulation.storage import (
    AT,
    CROSSINGS,
    LANE_AT,
    LOG,
    LOG_ENTRY,
    LOGGED_CROSSINGS,
    REFERENCE,
    Pose,
    Row,
)


class Engine(NamedTuple):
    """What advances a block: the compiled kernel with its constants and working storage, for one thread."""

    address: int  # of `hydrone_gym.simulation.advance.compiled`
    lanes: int
    ticks: int  # of a period
    values: NDArray[np.float64]  # from `pack_model`
    block: NDArray[np.float64]  # from `new_block`


@inlined
def set_move(b, i, lanes, new):
    """Let lane i's reference move to a `Pose` over the period."""
    old = gather(b, AT.reference, i, lanes, Pose)
    move = Pose(new.x - old.x, new.y - old.y, new.z - old.z, wrap(new.psi - old.psi))
    scatter(b, LANE_AT.move, i, lanes, move)


@inlined
def logged(row):
    """How many numbers of a row's log of crossings mean something."""
    return LOG_ENTRY * int(min(row[CROSSINGS], LOGGED_CROSSINGS))


@kernel
def advance_rows(engine, rows, references, obstacles, closest, weather, count, first, last):
    """Advance rows in place through ticks [first, last) of a period, a block of lanes at a time.

    Args:
        engine: `Engine`.
        rows: (n,) dtype `ROW`.
        references: (n, 4) what the reference moves to by the end of the period: m, m, m, rad.
        obstacles: (blocks, 4 * count * lanes) lane-major, see `advance`.
        closest: (blocks, count * lanes), updated.
        weather: (blocks, CONDITIONS * lanes) the `Conditions` of the lanes, updated; (1, 0) for a kernel without.
        count: number of obstacles.
        first, last: which part of the period; the rows' references move on when last is its end.
    """
    lanes, n, b = engine.lanes, rows.size, pointer(engine.block)
    for k in range((n + lanes - 1) // lanes):
        start = k * lanes
        for i in range(lanes):
            # lanes beyond the last row repeat it and are thrown away
            row = min(start + i, n - 1)
            source = pointer(rows[row])
            scatter(b, 0, i, lanes, gather(source, 0, 0, 1, Row))
            for c in range(LOG, LOG + logged(source)):
                b[c * lanes + i] = source[c]
            set_move(b, i, lanes, gather(references[row], 0, 0, 1, Pose))
        around = weather[min(k, weather.shape[0] - 1)]
        part = (obstacles[k], closest[k], around, engine.values, count, first, last, engine.ticks)
        call(engine.address, engine.block, *part)
        for i in range(min(lanes, n - start)):
            target = pointer(rows[start + i])
            scatter(target, 0, 0, 1, gather(b, 0, i, lanes, Row))
            for c in range(LOG, LOG + logged(target)):
                target[c] = b[c * lanes + i]
            if last == engine.ticks:
                scatter(target, REFERENCE, 0, 1, gather(references[start + i], 0, 0, 1, Pose))
