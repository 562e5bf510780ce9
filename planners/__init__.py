"""Planners: policies that look ahead with the environment's own model."""

from planners.cl_rrt.policy import CLRRT, TreeView
from planners.cl_rrt.settings import CLRRTSettings
from planners.policy import Known, PlannerPolicy
from planners.straight_line import StraightLine

__all__ = ["CLRRT", "CLRRTSettings", "Known", "PlannerPolicy", "StraightLine", "TreeView"]
