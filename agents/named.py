"""Shipped agents as factories with a name, and the reader of an agent's folder."""

from functools import partial
from typing import Any

from agents.agent import load_agent
from planners.named import weather_shield
from planners.shield import Shield

ppo = partial(load_agent, "ppo")
ppo_weather = partial(load_agent, "ppo-weather")
sac = partial(load_agent, "sac")
from_folder = load_agent


def ppo_shield(env: Any) -> Shield:
    """Return the agent whose training went on behind the shield, behind it."""
    return Shield.for_env(load_agent("ppo-shield", env), env)


def ppo_shield_weather(env: Any, **given: Any) -> Shield:
    """Return the same behind a shield that is ready for weather, with other arguments of it as given."""
    return weather_shield(load_agent("ppo-shield", env), env, **given)


def ppo_weather_shield(env: Any) -> Shield:
    """Return the agent that learnt in weather, behind a shield that is ready for weather."""
    return weather_shield(ppo_weather(env), env)


def sac_shield(env: Any) -> Shield:
    """Return the agent that SAC trained without the shield, behind it."""
    return Shield.for_env(sac(env), env)
