"""The control law of the project over an independent vehicle: SciPy integrates the oracle between control instants.

`fly_exact` is the slow truth the simulation is measured against: LSODA at rtol 1e-9 over the oracle's matrices, speeds
held for 10 ms as the real controller holds them, and an event at the surface where medium and control switch.
`fly_stepped` replays the simulation's own arithmetic one step at a time and hands out the rotor speeds.
"""

import functools
from types import FunctionType

import numba
import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from scipy.integrate import odeint
from scipy.optimize import brentq

from hydrone_gym._jit import kernel
from hydrone_gym.control.law import control
from hydrone_gym.control.laws import named_law
from hydrone_gym.control.reference import FLAT, Instant, Integral, Reference
from hydrone_gym.physics.dynamics import medium_at, step
from hydrone_gym.physics.kinematics import State, attitude_of, euler_rates
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.simulation.storage import model_of, pack_model
from tests.physics import oracle

DT = 0.01


def _compile_oracle():
    """Compile the oracle with Numba's own defaults and leave its module as it is."""
    scope = dict(oracle.__dict__)
    for name in (
        "rotation",
        "skew",
        "solve",
        "rate_matrix",
        "restoring_moment",
        "rotor_force_and_moment",
        "derivative",
    ):
        scope[name] = numba.njit(FunctionType(getattr(oracle, name).__code__, scope, name))
    return scope["derivative"]


exact_derivative = _compile_oracle()


@functools.cache
def controller(law):
    """Return the kernel that runs a law for one instant, and moves its memory."""
    gains = named_law(law).gains

    def one_instant(values, state, integral, reference, vertical, air, dt, speeds):
        model = model_of(values, gains)
        s = State(*to_fixed_tuple(state, 12))
        memory = Integral(*to_fixed_tuple(integral, 4))
        wanted = Reference(*to_fixed_tuple(reference, 7))
        medium = medium_at(model.vehicle, air)
        attitude = attitude_of(s)
        rates = euler_rates(attitude, s.p, s.q, s.r)
        now = Instant(s, attitude, rates, wanted, vertical, air, medium, FLAT)
        out, new = control(now, memory, model, dt)
        for i in range(4):
            speeds[i] = out[i]
            integral[i] = new[i]

    return kernel(one_instant)


@kernel
def step_once(vehicle, state, speeds, air, dt):
    s = State(*to_fixed_tuple(state, 12))
    new = step(s, attitude_of(s), to_fixed_tuple(speeds, 4), vehicle, medium_at(vehicle, air), air, dt)
    for i, value in enumerate(new):
        state[i] = value


def wrapped(angle):
    return angle - 2 * np.pi if angle > np.pi else angle + 2 * np.pi if angle < -np.pi else angle


class ClosedLoop:
    """A vehicle under its control law, 10 ms at a time, with the reference ramp of the simulation."""

    def __init__(self, vehicle, world, period, start, reference, law="paper"):
        self.vehicle, self.world, self.period = vehicle, world, period
        self.params = vehicle_params(vehicle)
        self.values, self.controller = pack_model(vehicle, world, named_law(law)), controller(law)
        self.media = (oracle.medium(vehicle, water=False), oracle.medium(vehicle, water=True))
        self.state = np.array(start, dtype=np.float64)
        self.reference = np.array(reference, dtype=np.float64)
        self.integral = np.zeros(4)
        self.crossings = 0

    def speeds(self, moving, dt=DT):
        """Rotor speeds at this instant; moves the controller's memory."""
        height = self.state[2]
        vertical = bool(abs(height) <= self.world.zone and self.world.vertical_mode)
        out = np.empty(4)
        self.controller(self.values, self.state, self.integral, moving, vertical, bool(height > 0.0), dt, out)
        return out

    def play(self, references, advance):
        """Yield the state after every 10 ms of a sequence of references, one a period."""
        count = round(self.period / DT)
        for new in references:
            move = new - self.reference
            move[3] = wrapped(move[3])
            for k in range(count):
                ramp = self.reference + move * ((k + 1) * (1.0 / count))
                ramp[3] = wrapped(ramp[3])
                advance(np.append(ramp, move[:3] * (1.0 / (count * DT))))
                yield self.state
            self.reference = np.array(new, dtype=np.float64)

    def advance_stepped(self, moving):
        """One step of the project's own integrator."""
        air = bool(self.state[2] > 0.0)
        self.rotor_speeds = self.speeds(moving)
        step_once(self.params, self.state, self.rotor_speeds, air, DT)
        if air != (self.state[2] > 0.0):
            self.integral[:] = 0.0

    def advance_exact(self, moving):
        """10 ms by SciPy; at the surface, medium and control switch at the very instant."""
        remaining = DT
        while remaining > 0.0:
            water = bool(self.state[2] <= 0.0)
            rpm, m = self.speeds(moving, remaining), self.media[water]

            def after(duration, start=self.state, rpm=rpm, m=m):
                rate = lambda y, t: exact_derivative(y, rpm, m)  # noqa: E731
                return odeint(rate, start, (0.0, duration), rtol=1e-9, atol=1e-11, mxstep=100_000)[-1]

            end = after(remaining)
            used = remaining
            if water != (end[2] <= 0.0):
                used = (
                    brentq(lambda duration: after(duration)[2], 0.0, remaining, xtol=1e-13) if remaining > 1e-9 else 0
                )
                end = after(used)
                end[2] = 0.0 if end[8] < 0.0 else 1e-12  # on the far side
                self.integral[:] = 0.0
                self.crossings += 1
            self.state = end
            self.state[5] = wrapped(end[5])
            remaining -= used
            if self.crossings > 1000:
                raise RuntimeError("the vehicle rattles at the surface")
