"""Position error of the 10 ms integrator against SciPy, manoeuvre by manoeuvre and over random ones.

    python -m benchmarks.integrator_accuracy

Needs a checkout: the independent model and the manoeuvres are those of tests/simulation.
"""

import numpy as np

from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory
from hydrone_gym.vehicle import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from tests.simulation import test_integrator
from tests.simulation.closed_loop import ClosedLoop

MANOEUVRES = (
    test_integrator.circle_in_air,
    test_integrator.weave_in_water,
    test_integrator.water_entry,
    test_integrator.water_exit,
    test_integrator.dive_and_return,
)
OPEN = World(lower=(-50.0, -50.0, -50.0), upper=(50.0, 50.0, 50.0))


def random_walk(rng, *, water):
    """A reference that moves every 2 s by up to about 2 m, for 20 s."""
    height, reach = (-6.0, (0.5, 0.5, 0.3, 0.25)) if water else (6.0, (1.0, 1.0, 0.5, 0.5))
    walk = np.cumsum(rng.uniform(-1.0, 1.0, (40, 4)) * reach, axis=0) + [0.0, 0.0, height, 0.0]
    references = np.repeat(walk[3::4], 4, axis=0)
    references[:, 2] = references[:, 2] if water else np.maximum(references[:, 2], 1.2)
    return (0.0, 0.0, height), references


def exact_states(vehicle, start, reference, references):
    loop = ClosedLoop(vehicle, OPEN, 0.5, start, reference)
    return np.array([start] + [state.copy() for state in loop.play(references, loop.advance_exact)])[::5]


def largest_error(vehicle, position, references):
    """Return the largest distance (m) to SciPy's solution, and that of SciPy's own from a start 1 mm away."""
    references = np.array(references)
    references[:, 3] = (references[:, 3] + np.pi) % (2.0 * np.pi) - np.pi
    start, reference = np.array([*position, *np.zeros(9)]), [*position, 0.0]
    exact = exact_states(vehicle, start, reference, references)
    aside = exact_states(vehicle, start + 1e-3 * np.eye(12)[0], reference, references)
    _, states, _, _ = trajectory(Simulation(vehicle, OPEN), row_at(start), references)
    return [np.linalg.norm(other[:, :3] - exact[:, :3], axis=1).max() for other in (states, aside)]


def main() -> None:
    print("| manoeuvre, 20 s | vehicle | largest error (m) | SciPy against SciPy from 1 mm away (m) |")
    print("|---|---|---:|---:|")
    for vehicle in (HYDRONE, HYDRONE_PHYSICAL):
        for manoeuvre in MANOEUVRES:
            error, spread = largest_error(vehicle, *manoeuvre())
            print(f"| {manoeuvre.__name__.replace('_', ' ')} | {vehicle.name} | {error:.4f} | {spread:.4f} |")
        for water in (False, True):
            rng = np.random.default_rng(0)
            errors = np.array([largest_error(vehicle, *random_walk(rng, water=water)) for _ in range(20)])
            (error, spread), (worst, apart) = np.median(errors, axis=0), errors.max(axis=0)
            name = f"20 random walks in {'water' if water else 'air'}"
            print(f"| {name}, median | {vehicle.name} | {error:.4f} | {spread:.4f} |")
            print(f"| {name}, worst | {vehicle.name} | {worst:.4f} | {apart:.4f} |")


if __name__ == "__main__":
    main()
