# For type checkers; see _aliases.py.
from planners import *  # noqa: F403
