"""Weather: wind with gusts, current and waves, each drawn from an episode's key alone.

noise       random numbers that are a function of a key and a count
wind        a mean and Dryden gusts
current     a mean and a Gauss-Markov variation
waves       regular, or a few components of a JONSWAP spectrum
disturbance what else moves air and water, in a file of one's own
spread      the vehicle of an episode, drawn around the nominal one
weather     `Weather`, `Spread`, and the named levels
"""

from hydrone_gym.weather.weather import Spread, Weather, named_weather

__all__ = ["Spread", "Weather", "named_weather"]
