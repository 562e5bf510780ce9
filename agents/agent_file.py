"""The files of an agent: a YAML text that says what it is, and an NPZ file with its tensors.

Nothing in them is code and nothing is unpickled. The text holds the SHA-256 of the tensors, and what they were trained
on: environment id with its version, and a fingerprint of the layout of the observation.
"""

import hashlib
import io
import math
import reprlib
import zipfile
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.envs.registration import registry
from numpy.typing import NDArray

from agents.network import Network
from agents.plain_data import read_yaml, to_yaml
from hydrone_gym.perception.egocentric import NAMES

FORMAT = "hydrone_gym agent"
VERSION = 1
TEXT = "agent.yaml"
TENSORS = "tensors.npz"
_KINDS = dict.fromkeys(("name", "algorithm", "environment", "observation"), str) | dict.fromkeys(
    ("network", "tensors"), dict
)
_WORDS = {str: "text", dict: "mapping"}
# What a policy network at most is; those of the package have 100,000 bytes in 3 layers, 128 wide
WIDEST, DEEPEST, LARGEST = 4096, 32, 50_000_000


@dataclass(frozen=True, kw_only=True)
class AgentFile:
    """What an agent's files hold; ValueError for a network larger than a policy needs."""

    name: str  # of the agent
    algorithm: str  # that trained it
    environment: str  # id it was trained on, with the version
    network: Network  # egocentric observation (68,) to relative action (3,)
    notes: dict[str, Any] = field(default_factory=dict)  # further plain data about its training: steps, seed, versions

    def __post_init__(self) -> None:
        """Check that it can be read again."""
        check_sizes(self.network.sizes)


def observation_fingerprint() -> str:
    """Return what stands for the layout of the egocentric observation: a hash of its names in order."""
    return hashlib.sha256("\n".join(NAMES).encode()).hexdigest()[:16]


def save_agent(agent: AgentFile, folder: Path) -> None:
    """Write an agent to a folder, made if missing; raises OSError when that fails."""
    folder.mkdir(parents=True, exist_ok=True)
    network = agent.network
    arrays: dict[str, Any] = {f"weight_{k}": weight for k, weight in enumerate(network.weights)}
    arrays |= {f"bias_{k}": bias for k, bias in enumerate(network.biases)}
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    content = {
        "format": FORMAT,
        "version": VERSION,
        "name": agent.name,
        "algorithm": agent.algorithm,
        "environment": agent.environment,
        "observation": observation_fingerprint(),
        "network": {"sizes": network.sizes, "activation": network.activation, "output": network.output},
        "tensors": {"file": TENSORS, "sha256": hashlib.sha256(buffer.getvalue()).hexdigest()},
        "notes": agent.notes,
    }
    (folder / TENSORS).write_bytes(buffer.getvalue())
    (folder / TEXT).write_text(to_yaml(content), encoding="utf-8")


def read_agent(folder: Path) -> AgentFile:
    """Read an agent from its folder, or from the path of its YAML file.

    Raises FileNotFoundError if there is none, ValueError naming the file for one that is foreign, damaged, of another
    format version, or trained for an environment or an observation that this package does not have.
    """
    text = folder if folder.suffix in (".yaml", ".yml") else folder / TEXT
    if not text.is_file():
        raise FileNotFoundError(f"no agent at {folder}: {text} does not exist")
    content = read_yaml(text)
    try:
        content = _checked(content)
        network = _network(content["network"], content["tensors"], text.parent)
    except ValueError as error:
        raise ValueError(f"{text}: {error}") from None
    plain = {name: content[name] for name in ("name", "algorithm", "environment", "notes")}
    return AgentFile(network=network, **plain)


def _checked(content: Any) -> dict[str, Any]:
    """Check all but the tensors; ValueError says what is wrong."""
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f'not an agent: "format" must be "{FORMAT}"')
    if content.get("version") != VERSION:
        raise ValueError(f'"version" must be {VERSION}, got {_short(content.get("version"))}')
    if missing := sorted(_KINDS.keys() - content.keys()):
        raise ValueError(f"missing key {', '.join(missing)}")
    for name, kind in {**_KINDS, "notes": dict}.items():
        if not isinstance(content.setdefault(name, {}), kind):
            raise ValueError(f'"{name}" must be a {_WORDS[kind]}, got {_short(content[name])}')
    if content["environment"] not in registry or not content["environment"].startswith("HydroneGym/"):
        raise ValueError(f"trained for {_short(content['environment'])}, an environment that is not registered here")
    if content["observation"] != observation_fingerprint():
        raise ValueError("trained for another layout of the egocentric observation: train it again")
    return content


def _network(described: dict[str, Any], tensors: dict[str, Any], folder: Path) -> Network:
    """Read and check the tensors; ValueError says what is wrong."""
    sizes = check_sizes(described.get("sizes"))
    file = folder / Path(str(tensors.get("file"))).name  # beside the text, wherever that lies
    if not file.is_file():
        raise ValueError(f"its tensors {file.name} are missing")
    most = _bytes_of(sizes) + 1000 * len(sizes)  # beside the numbers: heads of the archive and its members
    with file.open("rb") as stream:
        data = stream.read(most + 1)
    if len(data) > most:
        raise ValueError(f"{file.name} is larger than layers of sizes {sizes} are, which were noted")
    if hashlib.sha256(data).hexdigest() != tensors.get("sha256"):
        raise ValueError(f"{file.name} is damaged or another one: its SHA-256 differs from the one noted")
    layers = range(len(sizes) - 1)
    shapes: dict[str, tuple[int, ...]] = {f"weight_{k}.npy": (sizes[k], sizes[k + 1]) for k in layers}
    shapes |= {f"bias_{k}.npy": (sizes[k + 1],) for k in layers}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sorted(archive.namelist()) != sorted(shapes):
                raise ValueError(f"layers of sizes {sizes} were noted, members are {_short(archive.namelist())}")
            arrays = {name: _tensor(archive, name, shape) for name, shape in shapes.items()}
    except Exception as error:  # a damaged archive, or one made to harm, may fail its reader in any way
        raise ValueError(f"{file.name} does not hold the layers of a network: {error}") from None
    return Network(
        weights=tuple(arrays[f"weight_{k}.npy"] for k in layers),
        biases=tuple(arrays[f"bias_{k}.npy"] for k in layers),
        activation=str(described.get("activation")),
        output=str(described.get("output")),
    )


def check_sizes(sizes: Any) -> list[int]:
    """Return the sizes of a network's layers as they are; ValueError for those that no policy needs, or no sizes."""
    whole = isinstance(sizes, list) and all(type(size) is int and 1 <= size <= WIDEST for size in sizes)
    if not whole or not 2 <= len(sizes) <= DEEPEST + 1:
        rule = f"numbers from 1 to {WIDEST}, of the inputs and of each of at most {DEEPEST} layers"
        raise ValueError(f"sizes must be whole {rule}, got {_short(sizes)}")
    if (size := _bytes_of(sizes)) > LARGEST:
        raise ValueError(f"layers of sizes {_short(sizes)} take {size} bytes, more than {LARGEST}")
    return sizes


def _bytes_of(sizes: list[int]) -> int:
    return 4 * sum((inputs + 1) * outputs for inputs, outputs in pairwise(sizes))


def _tensor(archive: zipfile.ZipFile, name: str, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Unpack one array, no more of it than its shape says."""
    size = 4 * math.prod(shape)
    member = archive.getinfo(name)
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) or member.file_size > size + 1000:
        raise ValueError(f"{name} would unpack to {member.file_size} bytes, its shape {shape} says {size}")
    with archive.open(member) as packed:
        stream = io.BytesIO(packed.read(size + 1000))
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError(f"{name} is of another format")
    found, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    numbers = stream.read()
    if (found, dtype, len(numbers)) != (shape, np.dtype(np.float32), size):
        raise ValueError(f"{name} must be float32 {shape}, got {dtype} {found} in {len(numbers)} bytes")
    array = np.frombuffer(numbers, np.float32).reshape(shape, order="F" if fortran else "C")
    return np.array(array, order="C")


def _short(value: object) -> str:
    return reprlib.repr(value)
