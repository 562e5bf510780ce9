"""Policies that learn: everything here may use torch and Stable-Baselines3, and nothing below it may.

Install with the extra ``agents``: ``pip install "hydrone-gym[agents]"``. Agents may learn from planners, never the
other way.
"""
