"""Planners: policies that look ahead with the environment's own model."""

from planners.cl_rrt.memory import Memory, Report
from planners.cl_rrt.policy import CLRRT, TreeView
from planners.cl_rrt.settings import CLRRTSettings
from planners.mppi import MPPI
from planners.open_loop_rrt import OpenLoopRRT
from planners.policy import Known, PlannerPolicy
from planners.potential_field import PotentialField
from planners.published import PublishedCLRRT
from planners.straight_line import StraightLine

__all__ = [
    "CLRRT",
    "MPPI",
    "CLRRTSettings",
    "Known",
    "Memory",
    "OpenLoopRRT",
    "PlannerPolicy",
    "PotentialField",
    "PublishedCLRRT",
    "Report",
    "StraightLine",
    "TreeView",
]
