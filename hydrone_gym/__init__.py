"""Environments and tools for the HyDrone, a hybrid vehicle that flies, dives and crosses the water surface smoothly.

Importing this package registers `HydroneGym/AirToWater-v0`, `HydroneGym/WaterToAir-v0` and `HydroneGym/Mission-v0` with
Gymnasium; `hydrone_gym.envs.HydroneEnv` documents them. `gymnasium.make("hydrone_gym:HydroneGym/Mission-v0")` imports
it by itself.
"""

from gymnasium.envs.registration import register

from hydrone_gym import _aliases as _aliases
from hydrone_gym.physics.dynamics import state_derivative
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.vehicle import HYDRONE, HYDRONE_2021, HYDRONE_AGILE, HYDRONE_PHYSICAL, AirGains, Vehicle, WaterGains
from hydrone_gym.weather import Spread, Weather
from hydrone_gym.world.scenario import Scenario, load_scenario, save_scenario
from hydrone_gym.world.world import World

__version__ = "0.2.0"

__all__ = [
    "HYDRONE",
    "HYDRONE_2021",
    "HYDRONE_AGILE",
    "HYDRONE_PHYSICAL",
    "AirGains",
    "Outcome",
    "Scenario",
    "Spread",
    "Vehicle",
    "WaterGains",
    "Weather",
    "World",
    "__version__",
    "load_scenario",
    "save_scenario",
    "state_derivative",
]

# Without max_episode_steps: the environment truncates itself at `time_limit`, whatever the period.
for _id, _mission in (("AirToWater", "air_to_water"), ("WaterToAir", "water_to_air"), ("Mission", "random")):
    register(
        id=f"HydroneGym/{_id}-v0",
        entry_point="hydrone_gym.envs.hydrone_env:HydroneEnv",
        vector_entry_point="hydrone_gym.envs.vector_env:HydroneVectorEnv",
        kwargs={"mission": _mission},
    )
