"""What the simulation stores, declared once: rows, blocks of lanes, and the constants of a model.

A row holds one vehicle and its episode; a block holds rows side by side, entry k of lane i at ``k * lanes + i``, which
is what lets the lanes run together. Everything that copies, saves or restores them counts numbers and names none, so a
new field of the state, of the controller's memory or of the episode is one line here or in the class it belongs to.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined
from hydrone_gym._memory import fields_of, gather, offsets_of, packed, size_of, view
from hydrone_gym.control.law import Law
from hydrone_gym.control.reference import Integral
from hydrone_gym.physics.kinematics import State
from hydrone_gym.physics.parameters import VehicleParams, vehicle_params
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World, WorldParams, world_params

LANES = 16
_ALIGNMENT = 64  # bytes
LOGGED_CROSSINGS = 8  # details kept until the driver sets `crossings` back to zero; further ones are only counted


class Pose(NamedTuple):
    """A reference in force."""

    x: float  # m
    y: float
    z: float
    psi: float  # rad


class Point(NamedTuple):
    """A place, m."""

    x: float
    y: float
    z: float


class Flown(NamedTuple):
    """What a tick changes, and what a vehicle that has ended or diverged in it falls back to."""

    state: State
    integral: Integral
    energy: float  # J


class Episode(NamedTuple):
    """What an episode collects."""

    ticks: float
    clearance: float  # least so far, m
    outcome: float  # an `Outcome`
    crossings: float  # since the driver last set it to zero


class Row(NamedTuple):
    """One vehicle and its episode; `ROW` lists the same numbers under flat names, with the log of crossings after."""

    flown: Flown
    reference: Pose
    goal: Point
    episode: Episode


class CrossingEntry(NamedTuple):
    """One crossing of the surface, as it is logged."""

    time: float  # s
    direction: float  # 1 exit, -1 entry
    lateral_speed: float  # m/s
    cos_tilt: float
    vertical_speed: float  # m/s


class Crossing(NamedTuple):
    """This tick's crossings: how many, the last direction, and the worst of them."""

    number: float
    direction: float
    speed2: float  # lateral, m^2/s^2
    cos_tilt: float
    vz: float


class Lane(NamedTuple):
    """What a lane holds besides its row and the log."""

    move: Pose  # of the reference over the period
    crossing: Crossing
    inverse_length2: float  # of this tick's path, 1/m^2
    saved: Flown  # when the tick began


CROSSING_FIELDS = CrossingEntry._fields
ROW = np.dtype(
    [
        *fields_of(Flown),
        ("reference", np.float64, (4,)),
        ("goal", np.float64, (3,)),
        *fields_of(Episode),
        ("crossing_log", np.float64, (LOGGED_CROSSINGS, len(CROSSING_FIELDS))),
    ]
)
FLOWN, VESSEL = size_of(Flown), size_of(Flown) + size_of(Pose)  # numbers; a vessel is a vehicle and its reference
ROW_SIZE, LOG_ENTRY, LOG = ROW.itemsize // 8, size_of(CrossingEntry), size_of(Row)
AT, FLOWN_AT, EPISODE_AT = offsets_of(Row), offsets_of(Flown), offsets_of(Episode)
LANE_AT = Lane(*(ROW_SIZE + offset for offset in offsets_of(Lane)))
LANE_SIZE = ROW_SIZE + size_of(Lane)
REFERENCE, GOAL, ENERGY = AT.reference, AT.goal, FLOWN_AT.energy
TICKS, CLEARANCE, OUTCOME, CROSSINGS = (AT.episode + offset for offset in EPISODE_AT)


def new_rows(count: int) -> np.ndarray:
    """Return zeroed storage for a number of vehicles, dtype `ROW`."""
    return np.zeros(count, ROW)


def new_block(lanes: int) -> NDArray[np.float64]:
    """Return zeroed working storage for a number of lanes, aligned for the widest instructions."""
    raw = np.zeros(LANE_SIZE * lanes + _ALIGNMENT // 8)
    first = -raw.ctypes.data % _ALIGNMENT // 8
    return raw[first : first + LANE_SIZE * lanes]


class Model(NamedTuple):
    """The constants of one simulation; `gains` belong to its law."""

    vehicle: VehicleParams
    world: WorldParams
    gains: tuple


_WORLD_AT = size_of(VehicleParams)
_GAINS_AT = _WORLD_AT + size_of(WorldParams)


def pack_model(vehicle: Vehicle, world: World, law: Law) -> NDArray[np.float64]:
    """Flatten what a simulation never changes."""
    return packed((vehicle_params(vehicle), world_params(world), law.gains_of(vehicle)))


@inlined
def model_of(values, gains):
    """Rebuild the `Model` of packed values inside a kernel; `gains` is the class of its law's gains."""
    return Model(
        gather(values, 0, 0, 1, VehicleParams),
        gather(values, _WORLD_AT, 0, 1, WorldParams),
        gather(values, _GAINS_AT, 0, 1, gains),
    )


@inlined
def vehicle_of(values):
    """Look at the `VehicleParams` of packed values."""
    return view(values, 0, VehicleParams)


@inlined
def world_of(values):
    """Look at the `WorldParams` of packed values."""
    return view(values, _WORLD_AT, WorldParams)
