"""Planners that fly the environments: each one is a policy."""
