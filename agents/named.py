"""Shipped agents as factories with a name, and the reader of an agent's folder."""

from typing import Any

from agents.agent import Agent, load_agent
from planners.shield import Shield


def ppo(env: Any) -> Agent:
    """Return the agent trained without the shield, for an environment."""
    return load_agent("ppo", env)


def ppo_shield(env: Any) -> Shield:
    """Return the agent whose training went on behind the shield, behind it."""
    return Shield.for_env(load_agent("ppo_shielded", env), env)


def sac(env: Any) -> Agent:
    """Return the agent that SAC trained without the shield, for an environment."""
    return load_agent("sac", env)


def sac_shield(env: Any) -> Shield:
    """Return that agent behind the shield."""
    return Shield.for_env(load_agent("sac", env), env)


def from_folder(folder: str, env: Any) -> Agent:
    """Return the agent that training wrote to a folder."""
    return load_agent(folder, env)
