"""What a policy is told: the one place between the rows of a simulation, the truth, and all who read them.

`perceived` holds what every reader gets, and detection; `egocentric` is what a learner sees and says, with its `rays`.
Observations, policies and the shield in training read a `Perceived`, never the rows. Senses
are perfect so far: `perceive` hands out the rows' own memory and costs nothing. A model of sensors is another function
that returns a `Perceived`, with rows of its own that it writes after every period.
"""

from hydrone_gym.perception.perceived import Perceived, perceive

__all__ = ["Perceived", "perceive"]
