"""The files of an agent: a YAML text that says what it is, and an NPZ file with its tensors.

Nothing in them is code and nothing is unpickled. The text holds the SHA-256 of the tensors, and what they were trained
on: environment id with its version, and a fingerprint of the layout of the observation.
"""

import hashlib
import io
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from gymnasium.envs.registration import registry

from agents.network import Network
from hydrone_gym.perception.egocentric import NAMES

FORMAT = "hydrone_gym agent"
VERSION = 1
TEXT = "agent.yaml"
TENSORS = "tensors.npz"
_KEYS = {"format", "version", "name", "algorithm", "environment", "observation", "network", "tensors"}
_LARGEST = 50_000_000  # bytes of tensors: a policy network is far smaller


@dataclass(frozen=True, kw_only=True)
class AgentFile:
    """What an agent's files hold."""

    name: str  # of the agent
    algorithm: str  # that trained it
    environment: str  # id it was trained on, with the version
    network: Network  # egocentric observation (68,) to relative action (3,)
    notes: dict[str, Any] = field(default_factory=dict)  # further plain data about its training: steps, seed, versions


def observation_fingerprint() -> str:
    """Return what stands for the layout of the egocentric observation: a hash of its names in order."""
    return hashlib.sha256("\n".join(NAMES).encode()).hexdigest()[:16]


def save_agent(agent: AgentFile, folder: Path) -> None:
    """Write an agent to a folder, made if missing; raises OSError when that fails."""
    folder.mkdir(parents=True, exist_ok=True)
    network = agent.network
    arrays = {f"weight_{k}": weight for k, weight in enumerate(network.weights)}
    arrays |= {f"bias_{k}": bias for k, bias in enumerate(network.biases)}
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=False, **arrays)
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
    (folder / TEXT).write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")


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
        network = _network(_checked(content), text.parent)
    except ValueError as error:
        raise ValueError(f"{text}: {error}") from None
    name, algorithm, notes = str(content["name"]), str(content["algorithm"]), content.get("notes") or {}
    return AgentFile(name=name, algorithm=algorithm, environment=content["environment"], network=network, notes=notes)


def read_yaml(file: Path) -> Any:
    """Return plain data from a YAML file, nothing else; ValueError in one line, naming the file."""
    try:
        return yaml.safe_load(file.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ValueError(f"{file}: no YAML: {' '.join(str(error).split())}") from None


def _checked(content: Any) -> dict[str, Any]:
    """Check all but the tensors; ValueError says what is wrong."""
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f'not an agent: "format" must be "{FORMAT}"')
    if content.get("version") != VERSION:
        raise ValueError(f'"version" must be {VERSION}, got {content.get("version")!r}')
    missing = sorted(_KEYS - content.keys())
    if missing:
        raise ValueError(f"missing key {', '.join(missing)}")
    if content["environment"] not in registry or not str(content["environment"]).startswith("HydroneGym/"):
        raise ValueError(f"trained for {content['environment']!r}, an environment that is not registered here")
    if content["observation"] != observation_fingerprint():
        raise ValueError("trained for another layout of the egocentric observation: train it again")
    return content


def _network(content: dict[str, Any], folder: Path) -> Network:
    """Read and check the tensors; ValueError says what is wrong."""
    described, tensors = content["network"], content["tensors"]
    if not isinstance(described, dict) or not isinstance(tensors, dict):
        raise ValueError("network and tensors must be mappings")
    file = folder / Path(str(tensors.get("file"))).name  # beside the text, wherever that lies
    if not file.is_file():
        raise ValueError(f"its tensors {file.name} are missing")
    if file.stat().st_size > _LARGEST:
        raise ValueError(f"{file.name} is larger than {_LARGEST} bytes")
    data = file.read_bytes()
    if hashlib.sha256(data).hexdigest() != tensors.get("sha256"):
        raise ValueError(f"{file.name} is damaged or another one: its SHA-256 differs from the one noted")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            layers = range(len(arrays.files) // 2)
            weights = tuple(np.ascontiguousarray(arrays[f"weight_{k}"]) for k in layers)
            biases = tuple(np.ascontiguousarray(arrays[f"bias_{k}"]) for k in layers)
    except (AttributeError, KeyError, OSError, TypeError, zipfile.BadZipFile) as error:
        raise ValueError(f"{file.name} does not hold the layers of a network: {error}") from None
    activation, output = str(described.get("activation")), str(described.get("output"))
    network = Network(weights=weights, biases=biases, activation=activation, output=output)
    if network.sizes != described.get("sizes"):
        raise ValueError(f"layers of sizes {network.sizes} were found, {described.get('sizes')} were noted")
    return network
