"""Test-only entry point: what the controller sends to the rotors in one instant."""

import numpy as np

from hydrone_gym.control.laws import named_law
from hydrone_gym.simulation.storage import pack_model
from hydrone_gym.world.world import World
from tests.simulation.closed_loop import controller


def state_at(height, *, x=0.0, y=0.0, angles=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    return np.array([x, y, height, *angles, *velocity, *rates])


def rotor_speeds(
    vehicle, state, reference, *, velocity=(0.0, 0.0, 0.0), vertical=False, integral=(0.0, 0.0, 0.0, 0.0), law="paper"
):
    """Return rotor speeds (rpm) and the new memory for a reference (x, y, z, psi) that moves at a velocity."""
    memory, out = np.array(integral, dtype=np.float64), np.empty(4)
    moving = np.array([*reference, *velocity], dtype=np.float64)
    values = pack_model(vehicle, World(), named_law(law))
    controller(law)(values, state, memory, moving, vertical, bool(state[2] > 0.0), 0.01, out)
    return out, memory
