"""The controller: picks the medium's law, applies vertical mode and the rotor limits."""

from hydrone_gym._jit import inlined
from hydrone_gym.control.air import air_control
from hydrone_gym.control.reference import Integral, clamp
from hydrone_gym.control.water import water_control
from hydrone_gym.physics.kinematics import euler_rates


@inlined
def control(state, attitude, integral, reference, vertical, model, medium, air, dt):
    """Return four saturated rotor speeds (rpm) and the new `Integral`.

    An integral only keeps its new value if no rotor saturated, which together with its clamp stops windup.
    """
    rates = euler_rates(attitude, state.p, state.q, state.r)
    hover = model.vehicle.hover_speed
    if air:
        wanted, memory = air_control(state, attitude, rates, integral, reference, vertical, hover, model.air_gains, dt)
    else:
        wanted, memory = water_control(
            state, attitude, rates, integral, reference, vertical, medium, model.water_gains, dt
        )
    w1, w2, w3, w4 = wanted
    low, high = medium.rotor_min, medium.rotor_max
    s1, s2, s3, s4 = clamp(w1, low, high), clamp(w2, low, high), clamp(w3, low, high), clamp(w4, low, high)
    free = s1 == w1 and s2 == w2 and s3 == w3 and s4 == w4
    memory = Integral(
        memory.z if free else integral.z,
        memory.phi if free else integral.phi,
        memory.theta if free else integral.theta,
        memory.psi if free else integral.psi,
    )
    return (s1, s2, s3, s4), memory
