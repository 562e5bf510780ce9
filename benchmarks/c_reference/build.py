"""Compile substep.c for a number of lanes with the system's C compiler and call it through ctypes."""

import ctypes
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from hydrone_gym.control.paper import AirGainParams, WaterGainParams
from hydrone_gym.control.reference import Integral
from hydrone_gym.physics.kinematics import State
from hydrone_gym.physics.parameters import MediumParams, VehicleParams
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.simulation.storage import LOGGED_CROSSINGS, ROW
from hydrone_gym.world.world import WorldParams

_STATE, _INTEGRAL = State._fields, tuple(f"integral_{name}" for name in Integral._fields)
# What a lane of the C kernel holds, by the names that tick.h uses.
BLOCK = (
    *_STATE,
    *_INTEGRAL,
    *("old_x", "old_y", "old_z", "old_psi", "move_x", "move_y", "move_z", "move_psi"),
    *("goal_x", "goal_y", "goal_z", "ticks", "energy", "clearance", "outcome", "crossings"),
    *("crossed", "cross_direction", "cross_speed2", "cross_cos", "cross_vz", "inverse_length2"),
    *(f"saved_{name}" for name in (*_STATE, *_INTEGRAL, "energy")),
)
HERE = Path(__file__).resolve().parent
# Strict: no fused multiply-add and no reordering. The last two give no other result, they only say that nobody looks
# at floating-point exceptions and errno afterwards; without them no root and no branch can be vectorised.
FLAGS = ("-O3", "-march=native", "-std=c11", "-ffp-contract=off", "-fno-trapping-math", "-fno-math-errno")
# The fused and reordered arithmetic that strictness gives up, for information.
FAST = (*FLAGS, "-ffp-contract=fast", "-ffast-math")


def compiler() -> str | None:
    """Path of a C compiler ($CC, gcc, cc or clang), or None."""
    candidates = (os.environ.get("CC", ""), "gcc", "cc", "clang")
    return next((path for name in candidates if name and (path := shutil.which(name))), None)


def _struct(name: str, fields: tuple[str, ...]) -> str:
    return f"typedef struct {{ double {', '.join(fields)}; }} {name};"


def _list(name: str, fields: tuple[str, ...]) -> str:
    return f"#define {name}(DO) " + " ".join(f"DO({field})" for field in fields)


def _row_moves() -> list[str]:
    """Macros that move what a row and a lane share, named by the row's fields."""
    pairs = [(name, f"state[{k}]") for k, name in enumerate(_STATE)]
    pairs += [(name, f"integral[{k}]") for k, name in enumerate(_INTEGRAL)]
    pairs += [(name, name) for name in ("ticks", "energy", "clearance", "outcome", "crossings")]
    goal = [(f"goal_{axis}", f"goal[{k}]") for k, axis in enumerate("xyz")]
    load = " ".join(f"b->{lane}[i] = row->{field};" for lane, field in pairs + goal)
    store = " ".join(f"row->{field} = b->{lane}[i];" for lane, field in pairs)
    return [f"#define LOAD_ROW(b, i, row) {load}", f"#define STORE_ROW(b, i, row) {store}"]


def layout() -> str:
    """Text of layout.h: the structs and field lists, in the order the Python definitions give them."""
    scalars = VehicleParams._fields[:-2]
    row = []
    for name in ROW.names or ():
        sizes = "".join(f"[{size}]" for size in ROW[name].shape)
        row.append(f"double {name}{sizes};")
    block = " ".join(f"double {name}[LANES];" for name in BLOCK)
    saved = tuple(name.removeprefix("saved_") for name in BLOCK if name.startswith("saved_"))
    return "\n".join(
        [
            _struct("Medium", MediumParams._fields),
            f"typedef struct {{ double {', '.join(scalars)}; Medium air, water; }} Vehicle;",
            _struct("AirGains", AirGainParams._fields),
            _struct("WaterGains", WaterGainParams._fields),
            _struct("World", WorldParams._fields),
            f"typedef struct {{ {' '.join(row)} }} Row;",
            f"typedef struct {{ {block} }} Block;",
            f"#define LOGGED_CROSSINGS {LOGGED_CROSSINGS}",
            f"enum {{ {', '.join(f'{member.name} = {int(member)}' for member in Outcome)} }};",
            _list("MEDIUM_FIELDS", MediumParams._fields),
            _list("STATE_FIELDS", State._fields),
            _list("SAVED_FIELDS", saved),
            *_row_moves(),
            "",
        ]
    )


class CReference:
    """The C kernel, called with the arguments of `Simulation.advance`."""

    def __init__(self, lanes: int, values: np.ndarray, ticks: int, folder: Path, flags: tuple[str, ...] = FLAGS):
        program = compiler()
        if program is None:
            raise RuntimeError("no C compiler found: install gcc or clang, or name one in $CC")
        (folder / "layout.h").write_text(layout(), encoding="utf-8")
        library = folder / f"substep_{lanes}_{abs(hash(flags)):x}.so"
        command = [program, *flags, f"-DLANES={lanes}", f"-I{folder}", "-shared", "-fPIC", "-o", str(library)]
        result = subprocess.run([*command, str(HERE / "substep.c"), "-lm"], capture_output=True, text=True)
        if result.returncode:
            raise RuntimeError(f"the C reference does not compile:\n{result.stderr}")
        self.lanes, self.values, self.ticks, self.library = lanes, values, ticks, library
        self._block = np.zeros((len(BLOCK), lanes))
        self._log = np.zeros((lanes, LOGGED_CROSSINGS, 5))
        self._function: Any = ctypes.CDLL(str(library)).advance_rows
        self._function.restype = None

    def advance(
        self, rows: np.ndarray, references: np.ndarray, obstacles: np.ndarray, closest: np.ndarray, count: int
    ) -> None:
        """Advance rows in place through one period; see `hydrone_gym.simulation.rows.advance_rows`."""

        def address(array: np.ndarray) -> ctypes.c_void_p:
            return ctypes.c_void_p(array.ctypes.data)

        self._function(
            *(address(array) for array in (rows, references, obstacles, closest)),
            ctypes.c_long(count),
            address(self.values),
            *(ctypes.c_long(value) for value in (0, self.ticks, self.ticks)),
            *(address(array) for array in (self._block, self._log)),
            ctypes.c_long(len(rows)),
        )
