"""The part of the kernel that only flies in weather: the weather moves on, and the vehicle flies as it is."""

from hydrone_gym._jit import inlined
from hydrone_gym._memory import gather, offsets_of, scatter, select, zero_like
from hydrone_gym.control.reference import Surface
from hydrone_gym.physics.immersion import (
    Fluid,
    Rotors,
    Unmodelled,
    elevation_at,
    immersed_step,
    lagged,
    near_water_factor,
    water_at,
)
from hydrone_gym.physics.kinematics import State
from hydrone_gym.physics.parameters import VehicleParams
from hydrone_gym.physics.rotors import shaft_power
from hydrone_gym.simulation.clock import DT, TICK
from hydrone_gym.simulation.conditions import (
    A_TICK,
    AT,
    DRIVEN,
    EXTRA,
    TICKS_FROM,
    Chances,
    Headings,
    Noticed,
    add_rest,
    fluid_of,
)
from hydrone_gym.simulation.outcome import RUNNING
from hydrone_gym.simulation.storage import FLOWN_AT, OUTCOME, TICKS
from hydrone_gym.surface import is_air
from hydrone_gym.weather import current as currents
from hydrone_gym.weather import waves
from hydrone_gym.weather import wind as winds
from hydrone_gym.weather.current import CurrentParams, Eddies
from hydrone_gym.weather.disturbance import flow_of
from hydrone_gym.weather.noise import Key, kicks
from hydrone_gym.weather.waves import Sea
from hydrone_gym.weather.wind import Gusts, WindParams

_RADIUS = AT.real + offsets_of(Unmodelled).near_water_radius
_SHEAR = AT.wind + offsets_of(WindParams).shear
_SECOND = AT.sea + offsets_of(Sea).second  # amplitude of a sea's second component


@inlined
def any_rare(memory, lanes):
    """Whether any lane has what most weather has not, and what costs: an irregular sea, shear, a near-water effect."""
    most = 0.0
    for i in range(lanes):
        shear = gather(memory, _SHEAR, i, lanes, float)
        most = max(most, shear + gather(memory, _RADIUS, i, lanes, float))
        most = max(most, gather(memory, _SECOND, i, lanes, float))
    return most > 0.0


@inlined
def sample(memory, i, lanes, b, rare, extra):
    """Move lane i's weather on by a tick, and look at it where the vehicle will be in the middle of it.

    `rare` says whether any lane has what `any_rare` looks for; `extra` is the class of a disturbance, or None.
    """
    s = gather(b, FLOWN_AT.state, i, lanes, State)
    ticks = gather(b, TICKS, i, lanes, float)
    half, time = 0.5 * TICK, (ticks + 0.5) * TICK
    place = (s.x + half * s.vx, s.y + half * s.vy, s.z + half * s.vz)
    key, n = gather(memory, AT.key, i, lanes, Key), TICKS_FROM + A_TICK * ticks
    n1, n2 = kicks(key, n)
    n3, n4 = kicks(key, n + 1.0)
    n5, n6 = kicks(key, n + 2.0)
    n7, _ = kicks(key, n + 3.0)
    wind, gusts = gather(memory, AT.wind, i, lanes, WindParams), gather(memory, AT.gusts, i, lanes, Gusts)
    headings = gather(memory, AT.headings, i, lanes, Headings)
    later = winds.next_gusts(gusts, wind, (n1, n2, n3, n4, n5))
    profile = winds.shear_profile(place[2], wind.shear) if rare else 1.0
    air = winds.velocity(gusts, wind, headings.wind, profile)
    next_air = winds.velocity(later, wind, headings.wind, profile)
    current, eddies = gather(memory, AT.current, i, lanes, CurrentParams), gather(memory, AT.eddies, i, lanes, Eddies)
    new = currents.next_eddies(eddies, current, (n6, n7))
    flow = currents.velocity(eddies, current, headings.current)
    next_flow = currents.velocity(new, current, headings.current)
    sea = gather(memory, AT.sea, i, lanes, Sea)
    swell = waves.add_wave(waves.calm(), sea.first, place, (s.vx, s.vy), time)
    near = 1.0
    if rare:
        swell = add_rest(swell, sea, place, (s.vx, s.vy), time)
        near = near_water_factor(place[2] - swell.elevation, gather(memory, _RADIUS, i, lanes, float))
    if extra is not None:
        chances, numbers = gather(memory, AT.chances, i, lanes, Chances), gather(memory, EXTRA, i, lanes, extra)
        more = flow_of(numbers, chances, place, time)
        here = gather(memory, AT.disturbed, i, lanes, float) > 0.0
        more_air, more_water = select(here, more, zero_like(more))
        air, next_air = _sum(air, more_air), _sum(next_air, more_air)
        swell = waves.carried(swell, more_water)
    # where a flight has ended its time stands still, and so does its weather
    running = gather(b, OUTCOME, i, lanes, float) == RUNNING
    fluid = gather(memory, AT.fluid, i, lanes, Fluid)
    scatter(memory, AT.gusts, i, lanes, select(running, later, gusts))
    scatter(memory, AT.eddies, i, lanes, select(running, new, eddies))
    scatter(memory, AT.fluid, i, lanes, select(running, fluid_of(air, next_air, flow, next_flow, swell, near), fluid))


@inlined
def _sum(a, b):
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def takes_for_air(memory, i, lanes):
    """Whether lane i's controller takes it to be in air."""
    return gather(memory, DRIVEN, i, lanes, float) > 0.0


@inlined
def surface_below(memory, i, lanes, sub):
    """Return the `Surface` at lane i's place when a physics step begins; `sub` counts the tick's at its end."""
    fluid = gather(memory, AT.fluid, i, lanes, Fluid)
    after = (sub - 1) * DT - 0.5 * TICK
    water = water_at(fluid, after)
    return Surface(elevation_at(fluid, after), water[0], water[1], fluid.water_rate_x, fluid.water_rate_y)


@inlined
def weathered_step(memory, i, lanes, now, wanted, sub, spin_depth):
    """Advance lane i as the vehicle really is, in its weather; `sub` counts the tick's physics steps at its end.

    While it rises above `spin_depth` (m; 0: never), the aerial rotors of a vehicle that is driven in water turn too.
    Returns the new state, the rotors' shaft power (W), whether the controller now notices another medium, and the
    crossing: whether there is one, whether into air, and the velocity relative to the water (x, y, z in m/s).
    """
    state, attitude, driven = now.state, now.attitude, now.air
    vehicle = gather(memory, AT.vehicle, i, lanes, VehicleParams)
    real = gather(memory, AT.real, i, lanes, Unmodelled)
    rotors = gather(memory, AT.rotors, i, lanes, Rotors)
    fluid = gather(memory, AT.fluid, i, lanes, Fluid)
    noticed = gather(memory, AT.noticed, i, lanes, Noticed)
    after = sub * DT - 0.5 * TICK  # the end of this step, from the middle of the tick
    spins = spin_depth > 0.0 and not driven and state.vz > 0.0
    rising = spins and state.z - elevation_at(fluid, after - DT) > -spin_depth
    idle = vehicle.hover_speed if rising else 0.0
    spun = idle + (noticed.spun - idle) * real.keep_air
    s1, s2, s3, s4 = lagged(rotors, wanted, real.mean_air if driven else real.mean_water)
    speeds = s1, s2, s3, s4, spun
    new, medium = immersed_step(state, attitude, speeds, vehicle, real, fluid, driven, after - DT, DT)
    air, water = is_air(new.z - elevation_at(fluid, after)), water_at(fluid, after)
    crossed = air != (noticed.air > 0.0)
    relative = (new.vx - water[0], new.vy - water[1], new.vz - water[2])
    waited = noticed.waited + DT if air != driven else 0.0
    turned = waited > real.medium_delay
    driven_now = air if turned else driven
    scatter(
        memory,
        AT.noticed,
        i,
        lanes,
        Noticed(1.0 if air else 0.0, 1.0 if driven_now else 0.0, 0.0 if turned else waited, 0.0 if turned else spun),
    )
    # the rotors of the other medium start from rest, or from what they were brought to before
    later = lagged(rotors, wanted, real.keep_air if driven else real.keep_water)
    scatter(memory, AT.rotors, i, lanes, select(turned, Rotors(spun, spun, spun, spun), later))
    power = shaft_power(medium, speeds) + 4.0 * vehicle.air.power * spun * spun * spun
    return new, power, turned, (crossed, air, relative)
