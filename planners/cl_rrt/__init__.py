"""Closed-loop RRT.

tree.py (nodes), objective.py (what a path costs), swimming.py (at what pace), stopping.py (how fast is safe),
references.py (where edges lead), edge.py (one period of the simulation kernel), crossing.py (the macro edge), expand.py
(Algorithm 1), execute.py (Algorithm 2), memory.py (what travels between cycles), policy.py (the policy object).
"""
