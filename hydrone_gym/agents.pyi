# For type checkers; see _aliases.py.
from agents import *  # noqa: F403
