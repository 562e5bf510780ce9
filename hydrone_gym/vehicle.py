"""Parameters of the vehicle: physical constants and controller gains, in four named sets.

`HYDRONE` is Table 1 of the paper as tabled; `HYDRONE_PHYSICAL` replaces the five entries that contradict physics
(docs/deviations.md, E4, E6, E8, E14, E15); `HYDRONE_2021` adds what the authors' own simulator of 2021 has
beyond it; `HYDRONE_AGILE` is `HYDRONE` with gains in air that use the tilt its rotors allow. They are one model: the
equations never ask which set they were given.
"""

import dataclasses
import math
from dataclasses import dataclass, field

WATER_DENSITY = 1000.0  # kg/m^3, Table 1
AIR_DENSITY = 1.293  # kg/m^3, Table 1
LEAST_HEIGHT = 0.0025  # m: a crossing at 0.5 m/s would skip a lower hull in one physics step


def _check_numbers(instance: object) -> None:
    """Raise ValueError unless every numeric field of a dataclass is finite and obeys the sign its metadata names."""
    for spec in dataclasses.fields(instance):  # type: ignore[arg-type]
        value = getattr(instance, spec.name)
        if not spec.metadata:  # a name, or gains
            continue
        where = f"{type(instance).__name__}.{spec.name}"
        unit, sign = spec.metadata["unit"], spec.metadata["sign"]
        entries = value if isinstance(value, tuple) else (value,)
        length = spec.metadata["length"]
        if length != (len(value) if isinstance(value, tuple) else 0):
            raise ValueError(f"{where} must hold {length} numbers ({unit}), got {value!r}")
        for entry in entries:
            if isinstance(entry, bool) or not isinstance(entry, int | float) or not math.isfinite(entry):
                raise ValueError(f"{where} must be a finite number ({unit}), got {value!r}")
            if (sign == "positive" and entry <= 0) or (sign == "not negative" and entry < 0):
                raise ValueError(f"{where} must be {sign} ({unit}), got {value!r}")


def _number(default: float, unit: str, sign: str = "positive") -> float:
    return field(default=default, metadata={"unit": unit, "sign": sign, "length": 0})


def _triple(default: tuple[float, float, float], unit: str, sign: str = "positive") -> tuple[float, float, float]:
    return field(default=default, metadata={"unit": unit, "sign": sign, "length": 3})


@dataclass(frozen=True, kw_only=True)
class AirGains:
    """Gains of the control laws in air (rotor speeds in rpm; the paper tunes but does not print them)."""

    altitude_p: float = _number(650.0, "rpm/m")
    altitude_d: float = _number(600.0, "rpm s/m")
    altitude_i: float = _number(60.0, "rpm/(m s)", "not negative")
    altitude_i_limit: float = _number(200.0, "rpm", "not negative")
    roll_p: float = _number(1300.0, "rpm/rad")
    roll_d: float = _number(210.0, "rpm s/rad")
    pitch_p: float = _number(2600.0, "rpm/rad")
    pitch_d: float = _number(420.0, "rpm s/rad")
    yaw_p: float = _number(65.0, "rpm/rad")
    yaw_d: float = _number(38.0, "rpm s/rad")
    attitude_i: float = _number(0.0, "rpm/(rad s)", "not negative")
    attitude_i_limit: float = _number(100.0, "rpm", "not negative")
    yaw_limit: float = _number(400.0, "rpm")
    position_p: float = _number(0.20, "rad/m")
    position_d: float = _number(0.30, "rad s/m")
    tilt_limit: float = _number(math.radians(18.0), "rad")
    vertical_tilt_limit: float = _number(math.radians(4.0), "rad")
    speed_limit: float = _number(2.0, "m/s")
    vertical_speed_limit: float = _number(1.5, "m/s")
    zone_speed_limit: float = _number(0.5, "m/s")
    zone_lateral_speed: float = _number(0.05, "m/s")
    pre_spin: float = _number(0.0, "m", "not negative")

    def __post_init__(self) -> None:
        """Check every gain."""
        _check_numbers(self)


@dataclass(frozen=True, kw_only=True)
class WaterGains:
    """Gains of the control laws in water (forces in newtons a rotor, inverted to rotor speeds; deviation E12)."""

    depth_p: float = _number(30.0, "N/m")
    depth_d: float = _number(30.0, "N s/m")
    depth_i: float = _number(3.0, "N/(m s)", "not negative")
    depth_i_limit: float = _number(2.0, "N", "not negative")
    vertical_speed_limit: float = _number(0.55, "m/s")
    pitch_p: float = _number(2.0, "N/rad", "not negative")
    pitch_d: float = _number(0.6, "N s/rad", "not negative")
    yaw_p: float = _number(40.0, "N/rad")
    yaw_d: float = _number(2.0, "N s/rad", "not negative")
    attitude_i: float = _number(0.0, "N/(rad s)", "not negative")
    attitude_i_limit: float = _number(1.0, "N", "not negative")
    surge_p: float = _number(8.0, "N/m")
    surge_misalignment: float = _number(-60.0, "N/rad^2", "any")
    surge_limit: float = _number(9.0, "N")
    surge_brake: float = _number(12.5, "N s/m")
    hold_radius: float = _number(0.4, "m", "not negative")

    def __post_init__(self) -> None:
        """Check every gain; the misalignment gain must not be positive (deviation E13)."""
        _check_numbers(self)
        if self.surge_misalignment > 0:
            raise ValueError(
                "WaterGains.surge_misalignment must not be positive (N/rad^2): the vehicle would speed up while "
                f"misaligned and orbit the reference; got {self.surge_misalignment!r}"
            )


@dataclass(frozen=True, kw_only=True)
class RobustGains:
    """Gains and limits of the second law, `controller="robust"`: accelerations where the paper has rotor speeds."""

    observer_time: float = _number(0.4, "s")
    disturbance_limit: float = _number(4.0, "m/s^2", "not negative")
    position_p: float = _number(2.5, "1/s")
    velocity_p: float = _number(4.0, "1/s")
    braking: float = _number(4.5, "m/s^2")
    tilt_limit: float = _number(math.radians(35.0), "rad")
    speed_limit: float = _number(2.86, "m/s")
    height_p: float = _number(3.0, "1/s")
    height_d: float = _number(5.0, "1/s")
    height_braking: float = _number(4.0, "m/s^2")
    climb_limit: float = _number(2.5, "m/s")
    descent_limit: float = _number(2.0, "m/s")
    attitude_rate: float = _number(18.0, "rad/s")
    attitude_damping: float = _number(0.9, "1")
    yaw_rate: float = _number(3.0, "rad/s")
    yaw_limit: float = _number(0.6, "rad")
    zone_speed_limit: float = _number(0.8, "m/s")
    zone_braking: float = _number(2.0, "m/s^2")
    crossing_share: float = _number(0.6, "1")
    level_share: float = _number(0.4, "1")
    pre_spin: float = _number(0.15, "m", "not negative")
    depth_p: float = _number(2.0, "1/s")
    depth_d: float = _number(6.0, "1/s")
    depth_braking: float = _number(1.0, "m/s^2")
    dive_limit: float = _number(0.55, "m/s")
    rise_limit: float = _number(0.65, "m/s")
    level_p: float = _number(30.0, "1/s^2", "not negative")
    level_d: float = _number(10.0, "1/s", "not negative")
    surge_p: float = _number(1.5, "1/s")
    surge_d: float = _number(4.0, "1/s")
    surge_braking: float = _number(1.0, "m/s^2")
    surge_limit: float = _number(1.2, "m/s")
    hold_radius: float = _number(0.3, "m", "not negative")
    heading_p: float = _number(2.0, "1/s")
    heading_d: float = _number(6.0, "1/s")
    turn_limit: float = _number(1.0, "rad/s")

    def __post_init__(self) -> None:
        """Check every gain."""
        _check_numbers(self)


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """One vehicle: Table 1 of the paper, rotor limits, collision radius and the gains that fly it.

    Diagonal entries stand for the diagonal matrices of the paper. Drag is per unit density (deviation E5): the force
    along body axis i is ``density * drag[i] * abs(v_i) * v_i``. From `height` to `medium_delay` the defaults are the
    paper's ideal, and planners believe in it whatever is given: a hull of some height is partly submerged over it,
    rotors follow their speed with a first-order lag, drag against the air in their plane by ``rotor_drag`` times their
    speed, and in water thrust by ``curve[0] + curve[1] * abs(n) + curve[2] * n**2`` instead of `thrust_water` (three
    zeros are none); the water below carries rotors of `near_water_radius`; and the controller notices
    another medium after `medium_delay`. Raises ValueError naming the field, the rule and the
    unit for a value that is not finite or has the wrong sign.
    """

    name: str = "custom"
    mass: float = _number(1.2860, "kg")
    gravity: float = _number(9.78, "m/s^2")
    arm: float = _number(0.27, "m")
    yaw_arm_air: float = _number(0.27, "m")
    inertia: tuple[float, float, float] = _triple((1.4465e-2, 2.8818e-2, 1.5410e-2), "kg m^2")
    volume: float = _number(1.6e-3, "m^3")
    buoyancy_offset: float = _number(0.02, "m", "not negative")
    restoring_mass_share: float = _number(1.0, "1", "not negative")
    restoring_roll_coupling: float = _number(0.0, "1", "not negative")
    added_mass: float = _number(6.441e-4, "m^3", "not negative")
    added_inertia: float = _number(1.174e-6, "m^5", "not negative")
    drag: tuple[float, float, float] = _triple((1.25e-2, 1.25e-2, 4.99e-2), "m^2", "not negative")
    rotational_drag: tuple[float, float, float] = _triple((1.25e-2, 1.25e-2, 4.99e-2), "m^5", "not negative")
    thrust_air: float = _number(2.45e-7, "m^4/rpm^2")
    thrust_water: float = _number(1.6230e-9, "m^4/rpm^2")
    torque_air: float = _number(0.0125 * 2.45e-7, "m^5/rpm^2")
    torque_water: float = _number(1e-11, "m^5/rpm^2")
    rotor_limit_air: float = _number(5500.0, "rpm")
    rotor_limit_water: float = _number(2500.0, "rpm")
    radius: float = _number(0.45, "m")
    height: float = _number(0.0, "m", "not negative")
    rotor_lag_air: float = _number(0.0, "s", "not negative")
    rotor_lag_water: float = _number(0.0, "s", "not negative")
    rotor_drag: float = _number(0.0, "N s/(m rad/s)", "not negative")
    thrust_water_curve: tuple[float, float, float] = _triple((0.0, 0.0, 0.0), "m^4/rpm^2, m^4/rpm^3, m^4/rpm^4", "any")
    near_water_radius: float = _number(0.0, "m", "not negative")
    medium_delay: float = _number(0.0, "s", "not negative")
    air_gains: AirGains = field(default_factory=AirGains)
    water_gains: WaterGains = field(default_factory=WaterGains)
    robust_gains: RobustGains = field(default_factory=RobustGains)

    def __post_init__(self) -> None:
        """Check every field, that the vehicle floats, and that its rotors can hold it in both media."""
        _check_numbers(self)
        if WATER_DENSITY * self.volume <= self.mass:
            raise ValueError(
                f"Vehicle.volume must displace more than the mass (the paper requires rho V > m): {self.volume!r} m^3 "
                f"of water weigh {WATER_DENSITY * self.volume:g} kg, the vehicle {self.mass!r} kg"
            )
        if 0.0 < self.height < LEAST_HEIGHT:
            raise ValueError(f"Vehicle.height must be 0 or at least {LEAST_HEIGHT} m, got {self.height!r}")
        first, second, third = self.thrust_water_curve
        tried = [self.rotor_limit_water * share / 100 for share in range(101)]
        if any(self.thrust_water_curve) and min(first + (second + third * n) * n for n in tried) <= 0.0:
            raise ValueError(
                "Vehicle.thrust_water_curve must be positive (m^4/rpm^2) at every speed up to rotor_limit_water "
                f"({self.rotor_limit_water!r} rpm), or (0, 0, 0) for thrust_water, got {self.thrust_water_curve!r}"
            )
        if self.hover_speed >= self.rotor_limit_air:
            raise ValueError(
                f"Vehicle.rotor_limit_air must exceed the hover speed {self.hover_speed:.1f} rpm, "
                f"got {self.rotor_limit_air!r} rpm"
            )
        if -self.neutral_speed >= self.rotor_limit_water:
            raise ValueError(
                f"Vehicle.rotor_limit_water must exceed the neutral speed {-self.neutral_speed:.1f} rpm, "
                f"got {self.rotor_limit_water!r} rpm"
            )

    @property
    def ideal(self) -> bool:
        """Whether it is all in the nominal equations: no lag, no rotor drag, no height and so on."""
        lags = self.rotor_lag_air, self.rotor_lag_water, self.medium_delay
        rest = self.height, self.rotor_drag, self.thrust_water_curve[0], self.near_water_radius
        return not any(lags + rest)

    @property
    def hover_speed(self) -> float:
        """Rotor speed (rpm) at which four rotors carry the weight in air: 3150.5 for `HYDRONE` (E10)."""
        return math.sqrt(self.mass * self.gravity / (4.0 * AIR_DENSITY * self.thrust_air))

    @property
    def neutral_speed(self) -> float:
        """Rotor speed (rpm, negative) at which rotors 1 and 3 cancel net buoyancy: -972.7 for `HYDRONE` (E9)."""
        lift = (WATER_DENSITY * self.volume - self.mass) * self.gravity
        return -math.sqrt(lift / (2.0 * WATER_DENSITY * self.thrust_water))


HYDRONE = Vehicle(name="paper")

HYDRONE_PHYSICAL = Vehicle(
    name="physical",
    yaw_arm_air=0.0125,  # E4: reaction torque, not the arm, yaws a quadrotor
    rotational_drag=(2.5e-4, 2.5e-4, 0.6e-4),  # E6: strip estimate; the tabled row repeats the translational one
    inertia=(1.4465e-2, 1.5410e-2, 2.8818e-2),  # E8: the CAD frame had y up
    restoring_mass_share=0.0,  # E14: only buoyancy acts away from the centre of mass
    restoring_roll_coupling=1.0,
    volume=1.35e-3,  # E15: "slightly" buoyant, 5 %
    air_gains=AirGains(pitch_p=1400.0, pitch_d=225.0, yaw_p=600.0, yaw_d=500.0),
)

_PROPELLER = math.pi * 0.0275**4  # m^4: ζ(n) = π r⁴ c_T(n) of the aquatic propeller

HYDRONE_2021 = Vehicle(
    name="hydrone-2021",  # what the authors' public simulator of that year flies
    rotational_drag=(0.625e-2, 0.625e-2, 1.25e-2),  # E6: half of its C_r, as the tabled C is half of its C_p
    height=0.135,  # density changes over 6.75 cm either way
    rotor_lag_air=1.0 / 30.0,
    rotor_lag_water=1.0 / 30.0,
    thrust_water_curve=(1.0654e-3 * _PROPELLER, -1.4307e-7 * _PROPELLER, 2.3281e-11 * _PROPELLER),
)

HYDRONE_AGILE = Vehicle(
    name="hydrone-agile",
    air_gains=AirGains(tilt_limit=math.radians(35.0), position_p=0.4, position_d=0.5, speed_limit=2.7),
)

_NAMED = {vehicle.name: vehicle for vehicle in (HYDRONE, HYDRONE_PHYSICAL, HYDRONE_2021, HYDRONE_AGILE)}


def named_vehicle(vehicle: str | Vehicle) -> Vehicle:
    """Return the vehicle that a name stands for, or the vehicle itself.

    The names are "paper", "physical", "hydrone-2021" and "hydrone-agile". Raises ValueError for an unknown name and
    TypeError for anything else.
    """
    if isinstance(vehicle, Vehicle):
        return vehicle
    if not isinstance(vehicle, str):
        raise TypeError(f"vehicle must be a name or a hydrone_gym.Vehicle, got {type(vehicle).__name__}")
    if vehicle not in _NAMED:
        raise ValueError(f"vehicle must be one of {', '.join(map(repr, _NAMED))} or a Vehicle, got {vehicle!r}")
    return _NAMED[vehicle]
