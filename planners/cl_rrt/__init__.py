"""Closed-loop RRT: tree.py (nodes), references.py (where edges lead), edge.py (one period of the simulation kernel),
crossing.py (the macro edge), expand.py (Algorithm 1), execute.py (Algorithm 2), policy.py (the policy object)."""
