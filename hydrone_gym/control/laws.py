"""The control laws there are. A new one is a file beside `paper.py` and its entry here."""

from hydrone_gym.control import paper, robust
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.control.law import Law
from hydrone_gym.vehicle import Vehicle

LAWS: dict[str, Law] = {law.name: law for law in (paper.LAW, robust.LAW)}


def named_law(name: str, option: str = "law") -> Law:
    """Return the law of a name; raises ValueError naming the option it came by and the known ones."""
    if name not in LAWS:
        raise ValueError(f"{option} must be one of {', '.join(map(repr, LAWS))}, got {name!r}")
    return LAWS[name]


def envelope_of(vehicle: Vehicle, law: str = "paper") -> Envelope:
    """Return the limits of a vehicle under a law; raises ValueError for an unknown one."""
    return named_law(law).envelope_of(vehicle)
