"""Planners: policies that look ahead with the model they believe in, and the shield that checks any policy with it."""

from planners.belief import Belief
from planners.cl_rrt.memory import Memory, Report
from planners.cl_rrt.policy import CLRRT
from planners.cl_rrt.settings import CLRRTSettings
from planners.cl_rrt.view import TreeView
from planners.mppi import MPPI
from planners.open_loop_rrt import OpenLoopRRT
from planners.policy import Known, PlannerPolicy
from planners.potential_field import PotentialField
from planners.published import PublishedCLRRT
from planners.recording import TreeRecorder
from planners.shield import Shield
from planners.straight_line import StraightLine

__all__ = [
    "CLRRT",
    "MPPI",
    "Belief",
    "CLRRTSettings",
    "Known",
    "Memory",
    "OpenLoopRRT",
    "PlannerPolicy",
    "PotentialField",
    "PublishedCLRRT",
    "Report",
    "Shield",
    "StraightLine",
    "TreeRecorder",
    "TreeView",
]
