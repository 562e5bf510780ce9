"""The stop distances that the CL-RRT derives its cruise speed from, as a Markdown table.

python -m benchmarks.stop_distances
"""

import numpy as np

from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_AGILE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from planners.cl_rrt.stopping import safe_speed, stop_distances

SPEEDS = {"air": (0.5, 1.0, 1.5, 1.9), "water": (0.3, 0.5, 0.8, 1.1)}


def main() -> None:
    """Measure and print."""
    print("| set | medium | stop distance m at speed m/s | cruise speed m/s | with latency |")
    print("|---|---|---|---|---|")
    for vehicle in (HYDRONE, HYDRONE_PHYSICAL, HYDRONE_AGILE):
        simulation = Simulation(vehicle, World())
        for medium, speeds in SPEEDS.items():
            stops = stop_distances(simulation, np.array(speeds), air=medium == "air")
            shown = ", ".join(f"{stop:.2f} at {speed}" for stop, speed in zip(stops, speeds, strict=True))
            cruise = [f"{safe_speed(simulation, k):.2f}" if medium == "air" else "not limited" for k in (1, 2)]
            print(f"| {vehicle.name} | {medium} | {shown} | {cruise[0]} | {cruise[1]} |")


if __name__ == "__main__":
    main()
