"""The shield: any policy, its references checked with the environment's own model before they are flown.

A reference is accepted if the vehicle, having followed it for a period, can still hover to rest without touching a
known obstacle, the box, or the surface in a rough crossing, and without leaving space that has been sensed. Else the
first of `CANDIDATES` that can is flown instead: the same step shortened, turned aside, or shifted in height. If none
can, the vehicle goes on to the hover verified last. So a verified way to rest is known at any moment, and a vehicle
that flies as the model says meets only what cannot be known. The same invariant keeps the CL-RRT safe; the shield has
no tree, and leaves finding the way to the policy.

Rest under water does not last: only weak drag brakes sway, and over a minute a few millimetres a second carry a
hovering vehicle through a wall. So under water the hover verified last is verified again, and when it is no longer safe
the vehicle retreats: it turns and swims a metre against its drift. A verified retreat is held like a hover.

A policy without memory may ask for ever for what is refused, under a sphere that hangs just above the surface say. So
a vehicle that was refused something for some periods at one place is sent aside for a while, each time in another
direction, checked like any other reference; from there the policy tries again.
"""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym._memory import packed
from hydrone_gym.perception.perceived import TOLD
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.storage import VESSEL, new_rows
from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import NOWHERE
from planners.aside import beside, watch
from planners.belief import Belief, belief_of
from planners.caution import caution_for
from planners.disturbance import Estimator, Sight
from planners.guard import GuardQuery, guard
from planners.hold import HELD, RETREAT
from planners.policy import KEYS, Known, known

__all__ = ["CANDIDATES", "HELD", "RETREAT", "Shield", "ShieldState"]


def _candidates() -> NDArray[np.float64]:
    """Steps that replace a refused one, (29, 3): scale, turn in rad, lift in m; from the slightest change on."""
    turns = [sign * np.radians(degrees) for degrees in (25, 50, 80, 120) for sign in (1, -1)]
    steps = [(0.6, 0.0, 0.0), (0.3, 0.0, 0.0)]
    steps += [(scale, turn, 0.0) for turn in turns for scale in (1.0, 0.5)]
    steps += [(0.6, turn, lift) for turn in (0.0, *turns[2:4]) for lift in (0.75, -0.75)]
    steps += [(0.0, 0.0, 0.75), (0.0, 0.0, -0.75), (0.5, np.pi, 0.0), (0.2, np.pi, 0.0), (0.0, 0.0, 0.0)]
    return np.array(steps)


CANDIDATES = _candidates()


class ShieldState(NamedTuple):
    """What travels between calls; one entry an environment, also for a single one."""

    policy: Any  # memory of the policy inside
    held: NDArray[np.float64]  # (n, 4) hovers or retreats verified last: m, m, m, rad
    choice: NDArray[np.int64]  # (n,) of the last period: 0 as proposed, k candidate k, HELD or RETREAT
    interventions: NDArray[np.int64]  # (n,) periods of this episode in which another reference was flown
    periods: NDArray[np.int64]  # (n,) of this episode
    place: NDArray[np.float64]  # (n, 3) where the vehicle was when it last got away from a place, m
    stayed: NDArray[np.int64]  # (n,) periods with a refusal since; negative while it is sent aside
    detours: NDArray[np.int64]  # (n,) steps aside of this episode
    sent: NDArray[np.float64]  # (n, 4) references checked last: flown in this period, with latency in the next
    sights: tuple[Sight | None, ...]  # what the estimator of the disturbance remembers of each; None in still weather


class Shield:
    """Wraps a policy on the raw interface and lets only references pass that can be followed by a stop.

    Args:
        policy: anything with Stable-Baselines3's `predict` on raw observations: agent, planner, or your own.
        belief: the `Belief`, or any model, to check with.
        level: of the weather to be ready for, 0 to 5. Above 0 it estimates the disturbance from what it observes,
            checks with that, and keeps farther from everything, see `planners.caution.caution_at`.
        promise: share of flights, in that level's weather, that should stay within what stops keep from spheres, see
            `planners.tube`; None for margins that were tried.
        latency: True to use in each period what was chosen and checked during the one before: the policy is then asked
            what it would do in the predicted state. For policies that take a whole period.

    Raises:
        ValueError: no level, a promise that no tube can keep, a latency that is not True or False.
    """

    def __init__(
        self,
        policy: Any,
        belief: Belief | Any,
        *,
        level: int = 0,
        promise: float | None = None,
        latency: bool = False,
    ) -> None:
        """Make the working storage."""
        self.policy = policy
        self.belief = Belief.of(belief)
        if not isinstance(latency, bool):
            raise ValueError(f"latency must be True or False, got {latency!r}")
        self.caution, self.latency = caution_for(self.belief, level, promise), latency
        self.estimator = Estimator(self.belief, weathered=level > 0)
        self.simulation = self.estimator.simulation
        self._envelope, self._scratch = packed(self.belief.envelope), np.zeros(2 * VESSEL)
        world = self.belief.world
        self._low = np.array([*world.lower, -np.pi], np.float32).astype(np.float64)
        self._high = np.array([*world.upper, np.pi], np.float32).astype(np.float64)

    @classmethod
    def for_env(
        cls,
        policy: Any,
        env: Any,
        *,
        belief: Belief | Literal["truth"] | None = None,
        level: int = 0,
        promise: float | None = None,
        latency: bool = False,
    ) -> Self:
        """Shield a policy for a HyDrone environment or a vector of them.

        `belief` is what to check with instead of the nominal model, see `planners.belief.belief_of`; the rest is the
        class's. Raises TypeError for any other environment.
        """
        return cls(policy, belief_of(env, belief), level=level, promise=promise, latency=latency)

    def predict(
        self,
        observation: Mapping[str, NDArray],
        state: ShieldState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], ShieldState]:
        """Return safe references for one observation or a batch, in Stable-Baselines3's form.

        Args:
            observation: Dict observation of `interface="world"`, single or batched along the first axis.
            state: what the last call returned, None at the start.
            episode_start: (n,) True where an episode begins.
            deterministic: handed to the policy.

        Returns:
            Actions, (4,) or (n, 4) float32 (m, m, m, rad), and the new state.

        Raises:
            ValueError: a missing key, a state for another number of environments, a proposal that is not finite.
        """
        in_force = np.reshape(observation["reference"], (-1, 4)).astype(np.float64)
        here = np.reshape(observation["state"], (len(in_force), -1))[:, :3].astype(np.float64)
        state = _first_state(in_force, here) if state is None else state
        count = len(in_force)
        if len(state.held) != count:
            raise ValueError(f"state holds {len(state.held)} memories for {count} observations")
        starts = np.zeros(count, bool) if episode_start is None else np.reshape(episode_start, count).astype(bool)
        flown = np.where(starts[:, None], in_force, state.sent)
        sights = self._look(observation, state, starts)
        seen = self._ahead(observation, flown, sights) if self.latency else observation
        action, inner = self.policy.predict(seen, state.policy, episode_start, deterministic)
        proposed = np.atleast_2d(np.asarray(action, np.float64))
        held = np.where(starts[:, None], in_force, state.held)
        place, stayed, detours = watch(here, starts, state.choice != 0, state.place, state.stayed, state.detours)
        aside = stayed < 0
        proposed = np.where(aside[:, None], beside(place, in_force, detours), proposed)
        proposed = self._turned(proposed, here, np.reshape(seen["goal"], (count, 3)))
        sent, held, choice = self.check(seen, proposed, held, eyes=here, sights=sights)
        interventions = np.where(starts, 0, state.interventions) + ((choice != 0) | aside)
        periods = np.where(starts, 0, state.periods) + 1
        new = ShieldState(inner, held, choice, interventions, periods, place, stayed, detours, sent, sights)
        return np.reshape(flown if self.latency else sent, np.shape(action)).astype(np.float32), new

    def _turned(
        self, proposed: NDArray[np.float64], here: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return references that, in weather, turn who is to dive onto the line to the middle of the box.

        Bow or stern then leave at once whichever wall an unknown current pushes to.
        """
        if not self.simulation.weathered:
            return proposed
        middle = 0.5 * (self._low[:2] + self._high[:2]) - here[:, :2]
        turn = np.remainder(np.arctan2(middle[:, 1], middle[:, 0]) - proposed[:, 3] + 0.5 * np.pi, np.pi) - 0.5 * np.pi
        dives = in_air(here[:, 2]) & ~in_air(goal[:, 2]) & (np.linalg.norm(middle, axis=1) > 1.0)
        turned = np.remainder(proposed[:, 3] + turn + np.pi, 2.0 * np.pi) - np.pi
        return np.column_stack([proposed[:, :3], np.where(dives, turned, proposed[:, 3])])

    def _look(
        self, observation: Mapping[str, NDArray], state: ShieldState, starts: NDArray[np.bool_]
    ) -> tuple[Sight | None, ...]:
        """Return what the estimator makes of each observation."""
        if not self.simulation.weathered:
            return (None,) * len(starts)
        before = [None if begins else sight for begins, sight in zip(starts, state.sights, strict=True)]
        return tuple(self.estimator.look(now, sight) for now, sight in zip(_each(observation), before, strict=True))

    def _ahead(
        self, observation: Mapping[str, NDArray], sending: NDArray[np.float64], sights: tuple[Sight | None, ...]
    ) -> dict[str, NDArray]:
        """Predict the observations a period later, with references (n, 4) sent now; of spheres nothing new is known."""
        told = zip(_each(observation), sending, sights, strict=True)
        later = [self.estimator.ahead(*each) for each in told]
        new = {key: np.stack([getattr(known, key) for known in later]) for key in ("state", "integral", "reference")}
        return {**observation, **{key: np.reshape(new[key], np.shape(observation[key])) for key in new}}

    def check(
        self,
        observation: Mapping[str, NDArray],
        proposed: NDArray[np.float64],
        held: NDArray[np.float64],
        *,
        eyes: NDArray[np.float64] | None = None,
        sights: tuple[Sight | None, ...] | None = None,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Check references (n, 4) against observations; nothing given is changed.

        Args:
            observation: raw Dict observation, single or batched.
            proposed: (n, 4) references, m and rad; clipped to the box as the environment does.
            held: (n, 4) hovers verified last; the references in force where an episode begins.
            eyes: (n, 3) where the spheres were last sensed from, m; where the vehicles are, unless given.
            sights: what the estimator remembers of each; no disturbance is believed in unless given.

        Returns:
            References to fly (n, 4), the new `held` (n, 4), and choices (n,).

        Raises:
            ValueError: a missing key, or values that are not finite.
        """
        missing = [key for key in KEYS if key not in observation]
        if missing:
            raise ValueError(f"observation lacks {', '.join(missing)}; the shield reads interface='world'")
        count = len(proposed)
        if not np.isfinite(proposed).all():
            raise ValueError(f"proposed references must be finite, got {proposed}")
        rows, spheres = _read(observation, count)
        conditions = [self.estimator.conditions(sight) for sight in sights or (None,) * count]
        query = GuardQuery(
            rows=rows,
            eyes=np.ascontiguousarray(rows["state"][:, :3]) if eyes is None else np.array(eyes, np.float64, order="C"),
            conditions=np.array(conditions),
            margin=self.caution.margin,
            room=self.caution.room,
            drift=self.caution.drift,
            tube=self.caution.tube,
            since=self.belief.period if self.latency else 0.0,
            proposed=np.ascontiguousarray(np.minimum(np.maximum(proposed, self._low), self._high)),
            spheres=spheres.reshape(count, -1),
            sent=np.empty((count, 4)),
            held=np.array(held, np.float64, order="C"),
            choice=np.empty(count, np.int64),
        )
        rollout = Rollout(self.simulation, np.empty((spheres.shape[1], 4)), self.estimator.conditions(None))
        guard(query, rollout.memory, self._envelope, CANDIDATES, self._scratch)
        return query.sent, query.held, query.choice


def _read(observation: Mapping[str, NDArray], count: int) -> tuple[np.ndarray, NDArray[np.float64]]:
    """Return rows (n,) of dtype `ROW` as they were told, and the spheres (n, M, 4), unused ones `NOWHERE`."""
    rows = new_rows(count)
    for key in TOLD:
        rows[key] = np.reshape(observation[key], rows[key].shape)
    spheres = np.array(observation["obstacles"], np.float64, order="C").reshape(count, -1, 4)
    spheres[spheres[:, :, 3] <= 0.0] = NOWHERE
    return rows, spheres


def _first_state(in_force: NDArray[np.float64], here: NDArray[np.float64]) -> ShieldState:
    """Return what is remembered when episodes begin."""
    count = len(here)
    zero = np.zeros(count, np.int64)
    return ShieldState(None, in_force, zero, zero, zero, here, zero, zero, in_force, (None,) * count)


def _each(observation: Mapping[str, NDArray]) -> list[Known]:
    """Return what is known in each environment of an observation, single or batched."""
    single = np.ndim(observation["state"]) == 1
    return [known(observation, None if single else k) for k in range(1 if single else len(observation["state"]))]
