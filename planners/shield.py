"""The shield: any policy, its references checked with the environment's own model before they are flown.

A reference is accepted if the vehicle, having followed it for a period, can still hover to rest without touching a
known obstacle, the box, or the surface in a rough crossing, and without leaving space that has been sensed. Else the
first of `CANDIDATES` that can is flown instead: the same step shortened, turned aside, or shifted in height. If none
can, the vehicle goes on to the hover verified last. So at any moment a verified way to rest is known, and a vehicle that
flies as the model says meets only what cannot be known. The same stop invariant keeps the CL-RRT safe; the shield has no
tree, and leaves finding the way to the policy.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hydrone_gym._jit import inlined, kernel, routine
from hydrone_gym.physics.trigonometry import sincos
from hydrone_gym.simulation.advance import advance
from hydrone_gym.simulation.block import CROSSING_FIELDS, LOGGED_CROSSINGS, new_block
from hydrone_gym.simulation.model import unpack_model
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rows import load_row, new_rows, store_row
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.world.obstacles import swept_distance
from planners.cl_rrt.references import hover_reference, inside
from planners.policy import KEYS, simulation_of

HELD = -1  # choice: no candidate was safe, the hover verified last goes on
MARGIN = 0.03  # m of clearance that checked motion keeps
LOOK_AHEAD = 9  # periods that a hover is simulated for
_REST = 0.03  # m/s: slower than this in air is rest
_DRIFT = 12.0  # s: what is left of sway at the end of a stop in water goes on for a while
_GIVE = 0.02  # m: how much nearer than now a vehicle within the margin may come
_LEAST = 0.005  # m
_NOWHERE = 1e160  # m: its square overflows, so a sphere there is at distance inf


def _candidates() -> NDArray[np.float64]:
    """Steps that replace a refused one, (29, 3): scale, turn in rad, lift in m; from the slightest change on."""
    turns = [sign * np.radians(degrees) for degrees in (25, 50, 80, 120) for sign in (1, -1)]
    steps = [(0.6, 0.0, 0.0), (0.3, 0.0, 0.0)]
    steps += [(scale, turn, 0.0) for turn in turns for scale in (1.0, 0.5)]
    steps += [(0.6, turn, lift) for turn in (0.0, *turns[2:4]) for lift in (0.75, -0.75)]
    steps += [(0.0, 0.0, 0.75), (0.0, 0.0, -0.75), (0.5, np.pi, 0.0), (0.2, np.pi, 0.0), (0.0, 0.0, 0.0)]
    return np.array(steps)


CANDIDATES = _candidates()


@routine
def _follow(row, eye, rx, ry, rz, psi, spheres, closest, margin, ticks, model, block, log):
    """Propagate a row one period toward a reference; return (whether that is safe, whether it arrives).

    Args:
        row: record of dtype `ROW`, changed in place.
        eye: (3,) where obstacles were sensed from, m.
        rx, ry, rz, psi: the reference, m and rad.
        spheres, closest: flat known spheres of one lane, as in `advance`.
        margin: clearance to keep, m.
        ticks: of a period.
        model: `Model`.
        block, log: working storage of one lane.
    """
    b, w = block[0], model.world
    row.ticks, row.clearance, row.outcome, row.crossings = 0.0, np.inf, RUNNING, 0.0
    load_row(b, 0, row, (rx, ry, rz, psi))
    advance(block, log, spheres, closest, closest.size, model, 0, ticks, ticks)
    store_row(b, 0, row)
    row.reference[0], row.reference[1], row.reference[2], row.reference[3] = rx, ry, rz, psi
    smooth = True
    for slot in range(min(int(row.crossings), log.shape[1])):
        smooth = smooth and log[0, slot, 2] <= w.rough_speed and np.cos(log[0, slot, 3]) >= w.rough_cos_tilt
    s = row.state
    dx, dy, dz = s[0] - eye[0], s[1] - eye[1], s[2] - eye[2]
    reach = w.sensor_range - model.vehicle.radius
    sensed = dx * dx + dy * dy + dz * dz <= reach * reach
    arrives = row.outcome == GOAL
    return (row.outcome == RUNNING or arrives) and row.clearance >= margin and smooth and sensed, arrives


@inlined
def _clearance(ax, ay, az, bx, by, bz, spheres, count, radius):
    """Least clearance (m) of a straight path from the known spheres."""
    least = np.inf
    for j in range(count):
        k = 4 * j
        distance = swept_distance(ax, ay, az, bx, by, bz, spheres[k], spheres[k + 1], spheres[k + 2], spheres[k + 3])
        least = min(least, distance - radius)
    return least


@inlined
def _single(value):
    """Round to the precision of the action space: what is checked is what is flown."""
    return float(np.float32(value))


@routine
def _verify(row, scratch, rx, ry, rz, psi, hover, spheres, closest, margin, ticks, model, block, log):
    """Whether a reference can be followed to rest; writes the hover that does it to `hover` (4,)."""
    eye = row.state
    for c in range(12):
        scratch.state[c] = row.state[c]
    for c in range(4):
        scratch.integral[c], scratch.reference[c] = row.integral[c], row.reference[c]
    for c in range(3):
        scratch.goal[c] = row.goal[c]
    safe, arrives = _follow(scratch, eye, rx, ry, rz, psi, spheres, closest, margin, ticks, model, block, log)
    s = scratch.state
    hx, hy, hz, heading = hover_reference(scratch, model)
    hover[0], hover[1], hover[2], hover[3] = _single(hx), _single(hy), _single(hz), _single(heading)
    for _ in range(LOOK_AHEAD):
        if not safe or arrives:
            return safe
        if s[2] > model.world.zone and s[6] * s[6] + s[7] * s[7] + s[8] * s[8] < _REST * _REST:
            return True
        safe, arrives = _follow(
            scratch, eye, hover[0], hover[1], hover[2], hover[3], spheres, closest, margin, ticks, model, block, log
        )
    if safe and s[2] < 0.0:
        x, y = s[0] + _DRIFT * s[6], s[1] + _DRIFT * s[7]
        return _clearance(s[0], s[1], s[2], x, y, s[2], spheres, closest.size, model.vehicle.radius) >= margin
    return safe


@kernel
def _guard(rows, proposed, candidates, spheres, values, ticks, scratch, closest, block, log, sent, held, choice):
    """Check every row's reference and replace it where it is not safe.

    Args:
        rows: (n,) dtype `ROW`: state, memory, reference in force and goal.
        proposed: (n, 4) references, m and rad.
        candidates: (k, 3), see `CANDIDATES`.
        spheres: (n, 4 M) known spheres, unused ones far away.
        values: packed `Model`.
        ticks: of a period.
        scratch: (1,) dtype `ROW`.
        closest: (M,) working storage; block, log: that of one lane.
        sent: (n, 4) references to fly, written.
        held: (n, 4) hovers verified last, updated.
        choice: (n,) 0: as proposed, k: candidate k, HELD; written.
    """
    model = unpack_model(values)
    w, spare = model.world, scratch[0]
    hover = np.empty(4)
    for n in range(rows.size):
        row, known, s = rows[n], spheres[n], rows[n].state
        left = _clearance(s[0], s[1], s[2], s[0], s[1], s[2], known, closest.size, model.vehicle.radius) - _GIVE
        margin = max(min(MARGIN, left), _LEAST)
        dx, dy, dz = proposed[n, 0] - s[0], proposed[n, 1] - s[1], proposed[n, 2] - s[2]
        choice[n] = HELD
        for k in range(candidates.shape[0] + 1):
            rx, ry, rz, psi = proposed[n, 0], proposed[n, 1], proposed[n, 2], proposed[n, 3]
            if k > 0:
                scale, lift = candidates[k - 1, 0], candidates[k - 1, 2]
                sine, cosine = sincos(candidates[k - 1, 1])
                rx = inside(s[0] + scale * (cosine * dx - sine * dy), w.x_min, w.x_max)
                ry = inside(s[1] + scale * (sine * dx + cosine * dy), w.y_min, w.y_max)
                rz = inside(s[2] + scale * dz + lift, w.z_min, w.z_max)
            rx, ry, rz, psi = _single(rx), _single(ry), _single(rz), _single(psi)
            if _verify(row, spare, rx, ry, rz, psi, hover, known, closest, margin, ticks, model, block, log):
                choice[n] = k
                sent[n, 0], sent[n, 1], sent[n, 2], sent[n, 3] = rx, ry, rz, psi
                for c in range(4):
                    held[n, c] = hover[c]
                break
        if choice[n] == HELD:
            for c in range(4):
                sent[n, c] = held[n, c]


class ShieldState(NamedTuple):
    """What travels between calls; one entry an environment, also for a single one."""

    policy: Any  # memory of the policy inside
    held: NDArray[np.float64]  # (n, 4) hovers verified last: m, m, m, rad
    choice: NDArray[np.int64]  # (n,) of the last period: 0 as proposed, k candidate k, HELD
    interventions: NDArray[np.int64]  # (n,) periods of this episode in which another reference was flown
    periods: NDArray[np.int64]  # (n,) of this episode


class Shield:
    """Wraps a policy on the raw interface and lets only references pass that can be followed by a stop.

    Args:
        policy: anything with Stable-Baselines3's `predict` on raw observations: agent, planner, or your own.
        simulation: model, world and period to check with.
    """

    def __init__(self, policy: Any, simulation: Simulation) -> None:
        """Make the working storage."""
        self.policy = policy
        self.simulation = simulation
        self._block, self._scratch = new_block(1), new_rows(1)
        self._log = np.zeros((1, LOGGED_CROSSINGS, len(CROSSING_FIELDS)))
        world = simulation.world
        self._low = np.array([*world.lower, -np.pi], np.float32).astype(np.float64)
        self._high = np.array([*world.upper, np.pi], np.float32).astype(np.float64)

    @classmethod
    def for_env(cls, policy: Any, env: Any) -> Self:
        """Shield a policy for a HyDrone environment or a vector of them; TypeError for anything else."""
        return cls(policy, simulation_of(env))

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
        inner = None if state is None else state.policy
        action, inner = self.policy.predict(observation, inner, episode_start, deterministic)
        single = np.ndim(action) == 1
        proposed = np.atleast_2d(np.asarray(action, np.float64))
        count = len(proposed)
        in_force = np.reshape(observation["reference"], (-1, 4))
        if state is None:
            zero = np.zeros(count, np.int64)
            state = ShieldState(inner, in_force.astype(np.float64), zero, zero, zero)
        if len(state.held) != count:
            raise ValueError(f"state holds {len(state.held)} memories for {count} observations")
        starts = np.zeros(count, bool) if episode_start is None else np.reshape(episode_start, count).astype(bool)
        held = np.where(starts[:, None], in_force, state.held)
        sent, held, choice = self.check(observation, proposed, held)
        interventions = np.where(starts, 0, state.interventions) + (choice != 0)
        periods = np.where(starts, 0, state.periods) + 1
        new = ShieldState(inner, held, choice, interventions, periods)
        return (sent[0] if single else sent).astype(np.float32), new

    def check(
        self, observation: Mapping[str, NDArray], proposed: NDArray[np.float64], held: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Check references (n, 4) against observations; nothing given is changed.

        Args:
            observation: raw Dict observation, single or batched.
            proposed: (n, 4) references, m and rad; clipped to the box as the environment does.
            held: (n, 4) hovers verified last; the references in force where an episode begins.

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
        rows = new_rows(count)
        for key in ("state", "integral", "reference", "goal"):
            rows[key] = np.reshape(observation[key], rows[key].shape)
        spheres = np.array(observation["obstacles"], np.float64).reshape(count, -1, 4)
        spheres[spheres[:, :, 3] <= 0.0] = (_NOWHERE, 0.0, 0.0, 0.0)
        sent, held = np.empty((count, 4)), np.array(held, np.float64)
        choice = np.empty(count, np.int64)
        _guard(
            rows,
            np.minimum(np.maximum(proposed, self._low), self._high),
            CANDIDATES,
            spheres.reshape(count, -1),
            self.simulation.values,
            self.simulation.ticks,
            self._scratch,
            np.empty(spheres.shape[1]),
            self._block,
            self._log,
            sent,
            held,
            choice,
        )
        return sent, held, choice
