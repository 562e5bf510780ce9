"""Policies that learn: everything here may use torch and Stable-Baselines3, and nothing below it may.

Install with the extra ``agents``: ``pip install "hydrone-gym[agents]"``. Agents may learn from planners, never the
other way. Flying a trained agent, `load_agent`, needs neither torch nor Stable-Baselines3.
"""

from agents.agent import Agent, load_agent, shipped_agents
from agents.egocentric_policy import EgocentricPolicy

__all__ = ["Agent", "EgocentricPolicy", "load_agent", "shipped_agents"]
