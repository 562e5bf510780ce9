"""Where the vehicle flies: the box, its surface and its spheres, and how missions in it are drawn.

`world` holds bounds, transition zone, sensing range and what counts as arrival or as a rough crossing; `bodies` is what
an obstacle looks like: its distance from a path and along a ray; `scenario` is one mission (world, start, goal,
obstacles), checked, and saved as JSON; `generator` draws scenarios from a law and a seed; `solvability` tells whether a
vehicle fits through.
"""
