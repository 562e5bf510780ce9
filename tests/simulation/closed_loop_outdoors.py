"""The closed loop of `closed_loop` in weather: SciPy integrates the oracle of a hull outdoors in between."""

import numpy as np
from scipy.integrate import odeint
from scipy.optimize import brentq

from tests.physics import oracle_outdoors as outdoors
from tests.simulation.closed_loop import DT, ClosedLoop, wrapped


class OutdoorLoop(ClosedLoop):
    """A vehicle as it is in a weather without chance but for the phase of its wave; its rotors hold it already."""

    def __init__(self, vehicle, world, period, start, reference, weather, conditions, nominal):
        super().__init__(nominal, world, period, start, reference)
        self.hull = outdoors.hull(vehicle)
        self.around = outdoors.around(weather, conditions.sea.first.phase)
        self.rotors, self.time = np.array(conditions.rotors), 0.0
        self.air = self.gap(self.state, 0.0) > 0.0

    def gap(self, state, time):
        """Height above the surface, m."""
        return state[2] - outdoors.elevation(state[0], state[1], time, self.around)[0]

    def speeds(self, moving, dt=DT):
        vertical = bool(abs(self.state[2]) <= self.world.zone and self.world.vertical_mode)
        out = np.empty(4)
        self.controller(self.values, self.state, self.integral, moving, vertical, bool(self.air), dt, out)
        return out

    def advance_exact(self, moving):
        """10 ms by SciPy; where it crosses the surface, medium and control switch at the very instant."""
        remaining = DT
        while remaining > 0.0:
            wanted, air, began = self.speeds(moving, remaining), bool(self.air), self.time
            now = np.concatenate([self.state, self.rotors])

            def after(duration, start=now, air=air, wanted=wanted, began=began):
                if duration <= 0.0:
                    return start
                rate = lambda y, t: outdoors.derivative(  # noqa: E731
                    y, began + t, wanted, air, 0.0 if air else 1.0, self.hull, self.around
                )
                return odeint(rate, start, (0.0, duration), rtol=1e-9, atol=1e-10, mxstep=100_000)[-1]

            def above(duration, after=after, began=began):
                return self.gap(after(duration), began + duration)

            used, end = remaining, after(remaining)
            if air != (self.gap(end, began + used) > 0.0):
                used = brentq(above, 0.0, remaining, xtol=1e-13) if above(0.0) * above(remaining) < 0.0 else 0.0
                end = after(used)
                self.air, self.crossings, end[12:] = not air, self.crossings + 1, 0.0
                self.integral[:] = 0.0
                end[2] += (1e-12 if self.air else -1e-12) - self.gap(end, began + used)  # on the far side
            self.state, self.rotors = end[:12], end[12:]
            self.state[5] = wrapped(self.state[5])
            self.time += used
            remaining -= used
            if self.crossings > 1000:
                raise RuntimeError("the vehicle rattles at the surface")
