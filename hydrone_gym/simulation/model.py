"""Everything constant a kernel needs, as one flat array: vehicle, gains and world."""

from typing import NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from hydrone_gym._jit import inlined
from hydrone_gym.control.air import AirGainParams
from hydrone_gym.control.water import WaterGainParams
from hydrone_gym.physics.parameters import MediumParams, VehicleParams, vehicle_params
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World, WorldParams, world_params


class Model(NamedTuple):
    """The constants of one simulation."""

    vehicle: VehicleParams
    air_gains: AirGainParams
    water_gains: WaterGainParams
    world: WorldParams


_SCALARS = len(VehicleParams._fields) - 2  # all but the two media
_MEDIUM = len(MediumParams._fields)
_AIR_GAINS = len(AirGainParams._fields)
_WATER_GAINS = len(WaterGainParams._fields)
_WORLD = len(WorldParams._fields)


def pack_model(vehicle: Vehicle, world: World) -> NDArray[np.float64]:
    """Flatten a vehicle and a world to one array: Python hands it to a kernel in half the time of a tuple."""
    params = vehicle_params(vehicle)
    air = (getattr(vehicle.air_gains, name) for name in AirGainParams._fields)
    water = (getattr(vehicle.water_gains, name) for name in WaterGainParams._fields)
    values = [*params[:_SCALARS], *params.air, *params.water, *air, *water, *world_params(world)]
    return np.array(values, dtype=np.float64)


@inlined
def unpack_model(values):
    """Rebuild the `Model` of a packed array inside a kernel."""
    media = values[_SCALARS:]
    air = MediumParams(*to_fixed_tuple(media, _MEDIUM))
    water = MediumParams(*to_fixed_tuple(media[_MEDIUM:], _MEDIUM))
    gains = media[2 * _MEDIUM :]
    scalars = to_fixed_tuple(values, _SCALARS)
    return Model(
        VehicleParams(*scalars, air, water),  # type: ignore[call-arg]  # the checker cannot count a compiled tuple
        AirGainParams(*to_fixed_tuple(gains, _AIR_GAINS)),
        WaterGainParams(*to_fixed_tuple(gains[_AIR_GAINS:], _WATER_GAINS)),
        WorldParams(*to_fixed_tuple(gains[_AIR_GAINS + _WATER_GAINS :], _WORLD)),
    )
