"""The stop distances that the CL-RRT derives its cruise speed from, as a Markdown table.

python -m benchmarks.stop_distances
python -m benchmarks.stop_distances --controllers paper robust
"""

import argparse

import numpy as np

from hydrone_gym.control.laws import LAWS, envelope_of
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE, HYDRONE_AGILE, HYDRONE_PHYSICAL
from hydrone_gym.world.world import World
from planners.cl_rrt.stopping import safe_speed, stop_distances

SPEEDS = {"air": (0.5, 1.0, 1.5, 1.9, 2.8), "water": (0.3, 0.5, 0.8, 1.1)}  # m/s, where the law is so fast


def line(simulation: Simulation, medium: str) -> str:
    """Measure a vehicle under a law in one medium; return its line."""
    envelope, air = envelope_of(simulation.vehicle, simulation.law), medium == "air"
    speeds = [speed for speed in SPEEDS[medium] if speed <= (envelope.cruise if air else envelope.surge)]
    stops = stop_distances(simulation, np.array(speeds), air=air)
    shown = ", ".join(f"{stop:.2f} at {speed}" for stop, speed in zip(stops, speeds, strict=True))
    cruise = [f"{safe_speed(simulation, k):.2f}" if air else "not limited" for k in (1, 2)]
    return f"{medium} | {shown} | {cruise[0]} | {cruise[1]} |"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", nargs="+", choices=tuple(LAWS), default=["paper"], help="control laws")
    laws = parser.parse_args().controllers
    several = len(laws) > 1
    law_too = " law |" if several else ""
    print(f"| set |{law_too} medium | stop distance m at speed m/s | cruise speed m/s | with latency |")
    print(f"|---|{'---|' if several else ''}---|---|---|---|")
    for vehicle in (HYDRONE, HYDRONE_PHYSICAL, HYDRONE_AGILE):
        for law in laws:
            for medium in SPEEDS:
                measured = line(Simulation(vehicle, World(), law=law), medium)
                print(f"| {vehicle.name} | {f'{law} | ' if several else ''}{measured}")


if __name__ == "__main__":
    main()
