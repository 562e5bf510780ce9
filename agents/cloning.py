"""Behaviour cloning: the egocentric policy network learns what a demonstrator did, by regression.

Successful flights give the pairs: the egocentric observation of each period, and the relative action whose reference is
nearest to the one flown. Mean squared error, Adam in minibatches, the rate falling linearly to zero; one thread, so a
seed gives the same weights bit for bit. After Pomerleau, Neural Computation 3(1), 1991; its known weakness, that errors
lead where nobody has flown, is that of this module too.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import create_mlp
from tqdm import tqdm

from agents.agent import ACTIONS
from agents.agent_file import TEXT, AgentFile, save_agent
from agents.algorithms import network_of
from agents.demonstration_files import find_datasets, load_demonstrations
from agents.demonstrations import Demonstration, Demonstrations
from hydrone_gym.evaluation import provenance
from hydrone_gym.evaluation.suites import MISSIONS
from hydrone_gym.perception.egocentric import OBSERVATION_SIZE, STEP, Egocentric
from hydrone_gym.simulation.outcome import Outcome

REPORT = "cloning.json"
_PACKAGES = ("hydrone-gym", "torch", "gymnasium", "numpy", "numba", "minari")
_LEVEL = 1e-6  # m: a shorter horizontal way from start to goal gives no direction


@dataclass(frozen=True, kw_only=True)
class Cloning:
    """What is learnt from, how, and where the agent goes.

    Raises:
        ValueError: a number out of range.
    """

    data: Path  # folder of one dataset or of several, flown with the same options
    out: Path  # the agent's folder, made if missing; must not hold one
    seed: int = 0  # of the weights and of the order of the pairs
    hidden: tuple[int, ...] = (128, 128)  # outputs of each hidden layer
    epochs: int = 400  # times that every pair is learnt from
    batch: int = 512  # pairs a step
    learning_rate: float = 1e-3  # of Adam at the beginning
    held_back: float = 0.1  # share of the flights that are not learnt from, to measure the error on
    progress: bool = False  # show a bar on stderr

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name, fits, rule in (
            ("epochs", self.epochs >= 1, "be at least 1"),
            ("batch", self.batch >= 1, "be at least 1"),
            ("learning_rate", 0.0 < self.learning_rate < float("inf"), "be positive and finite"),
            ("held_back", 0.0 <= self.held_back < 1.0, "lie in [0, 1)"),
        ):
            if not fits:
                raise ValueError(f"{name} must {rule}, got {getattr(self, name)}")


class Pairs(NamedTuple):
    """What is learnt from."""

    observations: NDArray[np.float32]  # (n, 68) egocentric
    actions: NDArray[np.float32]  # (n, 3) relative, in [-1, 1]
    clipped: int  # pairs whose reference lay beyond the reach of a relative action


@dataclass(frozen=True, kw_only=True)
class Cloned:
    """What came of it."""

    agent: AgentFile  # as it was saved
    options: dict[str, Any]  # of the environments that were flown
    flights: tuple[int, int]  # successful ones, those learnt from and those held back
    pairs: int  # learnt from
    clipped: float  # share of all pairs whose reference lay beyond the reach of a relative action
    losses: list[float] = field(repr=False)  # (epochs,) mean squared error of the batches of each epoch
    held_back_loss: float | None  # mean squared error on the flights held back; None if there are none

    def notes(self) -> dict[str, Any]:
        """Return it as plain data."""
        names = ("flights", "pairs", "clipped", "losses", "held_back_loss", "options")
        return {**{name: getattr(self, name) for name in names}, **self.agent.notes}

    def summary(self) -> str:
        """Return it in one line."""
        held_back = "" if self.held_back_loss is None else f", {self.held_back_loss:.4f} on {self.flights[1]} held back"
        return (
            f"{self.pairs} pairs of {self.flights[0]} flights, {100.0 * self.clipped:.1f} % clipped; "
            f"mean squared error {self.losses[0]:.4f} in the first epoch, {self.losses[-1]:.4f} in the last{held_back}"
        )


def relative_actions(
    references: NDArray, states: NDArray[np.float64], start: NDArray[np.float64], goal: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Undo `Egocentric.reference`: return the relative actions (n, 3), not clipped, that stand for references.

    Args:
        references: (n, 4) m, m, m, rad; the yaw is not used.
        states: (n, 12) of the moments they answer.
        start: (3,) where the episode started, m.
        goal: (3,) m.
    """
    away = goal[:2] - start[:2]
    length = np.hypot(*away)
    cosine, sine = away / length if length >= _LEVEL else (1.0, 0.0)
    x, y, z = (np.asarray(references, np.float64)[:, :3] - states[:, :3]).T
    return np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=1) / STEP


def pairs_of(flights: list[Demonstration], egocentric: Egocentric) -> Pairs:
    """Return the pairs of flights, those of the periods in order; `egocentric` is of the environment that was flown."""
    seen, wanted = [np.zeros((0, OBSERVATION_SIZE), np.float32)], [np.zeros((0, ACTIONS))]
    for flight in flights:
        raw, memory = flight.observations, None
        for k in range(len(flight.actions)):
            observation, memory = egocentric.observe({key: values[k] for key, values in raw.items()}, memory)
            seen.append(observation[None])
        states, goal = raw["state"][:-1], raw["goal"][0]
        wanted.append(relative_actions(flight.actions, states, states[0, :3], goal))
    actions = np.concatenate(wanted)
    clipped = int((np.abs(actions) > 1.0).any(axis=1).sum())
    return Pairs(np.concatenate(seen), np.clip(actions, -1.0, 1.0).astype(np.float32), clipped)


def clone(cloning: Cloning) -> Cloned:
    """Learn from demonstrations, write the agent's folder and return what came of it.

    Raises:
        FileExistsError: the folder holds an agent already.
        FileNotFoundError: no demonstrations.
        ValueError: damaged ones, some flown with other options than the rest, or too few that arrived.
    """
    if (cloning.out / TEXT).exists():
        raise FileExistsError(f"{cloning.out} holds an agent already: name another folder")
    datasets = [load_demonstrations(folder) for folder in find_datasets(cloning.data)]
    options = datasets[0].options
    if any(dataset.options != options for dataset in datasets):
        raise ValueError(f"{cloning.data}: demonstrations must have been flown with the same options")
    learnt, held_back = list[Demonstration](), list[Demonstration]()
    for dataset in datasets:
        arrived = [flight for flight in dataset.flights if flight.outcome is Outcome.GOAL]
        first = len(arrived) - int(cloning.held_back * len(arrived))
        learnt, held_back = learnt + arrived[:first], held_back + arrived[first:]
    if not learnt:
        raise ValueError(f"{cloning.data}: no flight arrived, there is nothing to learn from")
    egocentric = Egocentric(datasets[0].make_env().get_wrapper_attr("simulation"))
    pairs, kept = pairs_of(learnt, egocentric), pairs_of(held_back, egocentric)
    layers, losses = fit(pairs, cloning)
    agent = _agent_of(layers, datasets, cloning)
    cloned = Cloned(
        agent=agent,
        options=options,
        flights=(len(learnt), len(held_back)),
        pairs=len(pairs.actions),
        clipped=(pairs.clipped + kept.clipped) / (len(pairs.actions) + len(kept.actions)),
        losses=losses,
        held_back_loss=float(np.mean((agent.network(kept.observations) - kept.actions) ** 2)) if held_back else None,
    )
    save_agent(agent, cloning.out)
    (cloning.out / REPORT).write_text(json.dumps(cloned.notes(), indent=1) + "\n", encoding="utf-8")
    return cloned


def fit(pairs: Pairs, cloning: Cloning) -> tuple[torch.nn.Sequential, list[float]]:
    """Return the trained layers, and the mean squared error of each epoch; sets torch to one thread."""
    torch.set_num_threads(1)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(cloning.seed)
        layers = torch.nn.Sequential(*create_mlp(OBSERVATION_SIZE, ACTIONS, list(cloning.hidden)))
        inputs, outputs = torch.from_numpy(pairs.observations), torch.from_numpy(pairs.actions)
        steps = cloning.epochs * -(-len(inputs) // cloning.batch)
        adam = torch.optim.Adam(layers.parameters(), lr=cloning.learning_rate)
        falling = torch.optim.lr_scheduler.LinearLR(adam, 1.0, 1.0 / steps, total_iters=steps)
        losses = []
        for _ in tqdm(range(cloning.epochs), desc="cloning", unit="epoch", disable=not cloning.progress):
            total = 0.0
            for rows in torch.randperm(len(inputs)).split(cloning.batch):
                loss = torch.nn.functional.mse_loss(layers(inputs[rows]), outputs[rows])
                adam.zero_grad()
                loss.backward()
                adam.step()
                falling.step()
                total += float(loss.detach()) * len(rows)
            losses.append(total / len(inputs))
    return layers, losses


def _agent_of(layers: torch.nn.Sequential, datasets: list[Demonstrations], cloning: Cloning) -> AgentFile:
    """Return the agent with what it was learnt from."""
    sources = [{key: getattr(each, key) for key in ("env_id", "policy", "sha256")} for each in datasets]
    settings = {name: getattr(cloning, name) for name in ("seed", "epochs", "batch", "learning_rate")}
    return AgentFile(
        name=cloning.out.name,
        algorithm="behaviour cloning",
        environment=MISSIONS[0],
        network=network_of(list(layers)),
        notes={**settings, "demonstrations": sources, "versions": provenance.versions(_PACKAGES)},
    )
