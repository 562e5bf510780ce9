"""Sensing: an obstacle is detected once its surface has been within the sensor's range, and stays known.

The simulation already keeps the least distance of each episode to each obstacle, swept over the whole path, so sensing
is a comparison: nothing is missed between two periods, however fast the vehicle flies.
"""

from hydrone_gym._jit import inlined


@inlined
def detect(obstacles, closest, lane, lanes, count, sensor_range, n, seen, found, known):
    """Append what row n has newly detected to its list of known spheres, ties of one period by index.

    Args:
        obstacles: the block's spheres, flat: entry (j, c) of a lane at ``(4 j + c) lanes + lane``; x, y, z, r in m.
        closest: the block's least distances (m) to each surface, flat: entry j at ``j lanes + lane``.
        lane, lanes: where in its block row n lives.
        count: number of obstacles.
        sensor_range: distance (m) at which a surface is detected.
        n: row of the next three.
        seen: (rows, M) uint8, 1 for a detected obstacle; updated.
        found: (rows,) int64 number of detected obstacles; updated.
        known: (rows, M, 4) their x, y, z, r in m in order of detection; updated.
    """
    for j in range(count):
        if seen[n, j] == 0 and closest[j * lanes + lane] <= sensor_range:
            seen[n, j] = 1
            slot = found[n]
            found[n] = slot + 1
            for c in range(4):
                known[n, slot, c] = obstacles[(4 * j + c) * lanes + lane]
