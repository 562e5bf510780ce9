"""Golden flights, recorded once: any later flight of the same seeds must be the same bit for bit.

    python -m benchmarks.golden check                       # 1,000 worlds a policy, single and vector environments
    python -m benchmarks.golden check --flights 60 --policies random straight-line --only vector
    python -m benchmarks.golden record --policies mppi      # after a change that is meant to change its flights

`check` says how many flights are equal and lists the first that are not, then ends with code 1. Worlds and policies are
those of `benchmarks.golden_flights`. `PYTHONPATH=OTHER:. python -P -m benchmarks.golden` flies the sources of another
checkout.
"""

import hashlib
import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import tyro
from numpy.typing import NDArray

import hydrone_gym
from benchmarks.golden_flights import FIRST, IDS, OPTIONS, PILOTS, Flown, fly_single, fly_vector
from benchmarks.timing import machine
from hydrone_gym import Outcome

DATA = Path(__file__).resolve().parent.parent / "tests" / "golden" / "flights-v1.npz"
WAYS = {"single": fly_single, "vector": fly_vector}
KEPT = 6  # flights a policy whose actions are kept, to be sent again where the policy itself may round differently
LISTED = 5  # flights that are printed where some differ


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to fly, and whether to note it or to compare it with what was noted."""

    command: tyro.conf.Positional[Literal["record", "check"]]
    """Write the flights, or compare with them."""
    flights: int = 1000
    """Worlds a policy."""
    policies: tuple[str, ...] = tuple(PILOTS)
    """Policies; recording leaves the others as they are."""
    only: Literal["single", "vector"] | None = None
    """One kind of environment instead of both."""
    file: Path = DATA
    """Where the flights are kept."""


class Golden(NamedTuple):
    """What is kept of a policy's flights."""

    fingerprints: NDArray[np.uint64]  # (n,)
    outcomes: NDArray[np.uint8]  # (n,)
    times: NDArray[np.float32]  # (n,) s
    lengths: NDArray[np.int64]  # (KEPT,) periods of the first flights
    actions: NDArray[np.float32]  # (sum of lengths, 4) sent in them

    @property
    def digest(self) -> str:
        """All flights in one number."""
        return hashlib.sha256(self.fingerprints.tobytes()).hexdigest()[:16]

    def sent(self) -> dict[int, NDArray[np.float32]]:
        """The actions of the flights that keep them, by world."""
        return dict(enumerate(np.split(self.actions, np.cumsum(self.lengths)[:-1])))


def golden_of(flown: Mapping[int, Flown]) -> Golden:
    """Pack the flights of worlds 0, 1, ..."""
    flights = [flown[world] for world in range(len(flown))]
    kept = [flight.actions for flight in flights[:KEPT]]
    return Golden(
        fingerprints=np.array([flight.fingerprint for flight in flights], np.uint64),
        outcomes=np.array([flight.outcome for flight in flights], np.uint8),
        times=np.array([flight.time for flight in flights], np.float32),
        lengths=np.array([len(actions) for actions in kept]),
        actions=np.concatenate(kept),
    )


def load(file: Path = DATA) -> tuple[dict[str, Golden], dict[str, Any]]:
    """Return what was recorded and where, by policy; nothing if there is no file."""
    if not file.exists():
        return {}, {}
    with np.load(file, allow_pickle=False) as arrays:
        about = json.loads(str(arrays["about"]))
        return {name: Golden(*(arrays[f"{name}/{part}"] for part in Golden._fields)) for name in about}, about


def save(file: Path, recorded: Mapping[str, Golden], about: Mapping[str, Any]) -> None:
    """Write all policies to a file."""
    arrays = {f"{name}/{part}": value for name, golden in recorded.items() for part, value in golden._asdict().items()}
    file.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(file, about=json.dumps(about), **arrays)


def arithmetic() -> str:
    """How this machine rounds what policies leave to NumPy: versions, processor, and the bits of a few results."""
    config = np.show_config(mode="dicts")
    described = [np.__version__, machine()["processor"]]
    described += [config.get(part) for part in ("SIMD Extensions", "Build Dependencies")]
    random = np.random.default_rng(0)
    samples, weights = random.standard_normal((256, 10, 3)), random.random(256)
    results = (
        np.exp(-9.0 * weights),
        np.tensordot(weights, samples, 1),
        np.tanh(samples.astype(np.float32)),
        samples[:, 0] @ samples[0, 0],
        np.linalg.norm(samples[:, 0], axis=1),
        np.array([np.linalg.norm(sample[0]) for sample in samples]),
        np.hypot(samples[..., 0], samples[..., 1]),
        np.arctan2(samples[..., 0], samples[..., 1]),
    )
    bits = b"".join(result.tobytes() for result in results)
    return hashlib.sha256(json.dumps(described).encode() + bits).hexdigest()[:16]


def about_of(golden: Golden) -> dict[str, Any]:
    """Where flights come from."""
    described = {key: value for key, value in machine().items() if key != "load"}
    return {
        "flights": len(golden.fingerprints),
        "first_seed": FIRST,
        "digest": golden.digest,
        "arithmetic": arithmetic(),
        **described,
    }


def differing(flown: Mapping[int, Flown], golden: Golden) -> list[str]:
    """Say of each flight that is not the recorded one what it was and is."""
    lines = []
    for world, flight in sorted(flown.items()):
        if flight.fingerprint != golden.fingerprints[world]:
            before = f"{Outcome(golden.outcomes[world]).name} after {golden.times[world]:.2f} s"
            now = f"{Outcome(flight.outcome).name} after {flight.time:.2f} s"
            lines.append(f"  {IDS[world % len(IDS)]} seed {FIRST + world}: recorded {before}, now {now}")
    return lines


def fly(name: str, way: str, flights: int) -> tuple[dict[int, Flown], float]:
    """Fly a policy's worlds; return flights and CPU seconds."""
    began = time.process_time()
    return WAYS[way](PILOTS[name], range(flights), OPTIONS.get(name, {})), time.process_time() - began


def report(name: str, way: str, flights: int, golden: Golden) -> bool:
    """Fly and print how many flights are the recorded ones; return whether all are."""
    flown, seconds = fly(name, way, flights)
    lines = differing(flown, golden)
    print(f"{name}, {way}: {flights - len(lines)} of {flights} equal ({seconds:.0f} s CPU)", flush=True)
    print("\n".join(lines[:LISTED]), end="\n" if lines else "", flush=True)
    return not lines


def check(a: Arguments) -> int:
    """Compare; return the exit code."""
    recorded, about = load(a.file)
    lacking = [name for name in a.policies if name not in recorded or about[name]["flights"] < a.flights]
    if lacking:
        print(f"{a.file} holds less than {a.flights} flights of {', '.join(lacking)}", file=sys.stderr)
        return 2
    if any(about[name]["arithmetic"] != arithmetic() for name in a.policies):
        print("recorded where NumPy rounds differently: policies that plan with it may differ here without a fault")
    ways = [a.only] if a.only else list(WAYS)
    return 0 if all([report(name, way, a.flights, recorded[name]) for name in a.policies for way in ways]) else 1


def record(a: Arguments) -> int:
    """Fly and write policy by policy; one whose vector flights are not its single ones is not written."""
    recorded, about = load(a.file)
    code = 0
    for name in a.policies:
        flown, seconds = fly(name, a.only or "single", a.flights)
        golden = golden_of(flown)
        if a.only is None and not report(name, "vector", a.flights, golden):
            code = 1
            continue
        recorded[name], about[name] = golden, about_of(golden)
        save(a.file, recorded, about)
        print(f"{name}: {a.flights} flights recorded ({seconds:.0f} s CPU), {golden.digest}", flush=True)
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    a = tyro.cli(Arguments, args=arguments, description=__doc__)
    unknown = [name for name in a.policies if name not in PILOTS]
    if unknown or a.flights < 1:
        print(f"policies are {', '.join(PILOTS)}, and at least one flight", file=sys.stderr)
        return 2
    print(f"flying {Path(hydrone_gym.__file__).parent}", flush=True)
    return record(a) if a.command == "record" else check(a)


if __name__ == "__main__":
    raise SystemExit(main())
