"""Models that learnt on `interface="egocentric"`, from whatever library, as policies on the raw interface."""

import sys
from collections.abc import Callable
from textwrap import shorten
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.network import Network
from hydrone_gym.envs.spaces import egocentric_space, relative_action_space
from hydrone_gym.perception.egocentric import Egocentric, EgocentricMemory, RawObservation
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.world import World

SEEN, CHOSEN = egocentric_space(), relative_action_space()
INTERFACE = f"the egocentric interface has observations {SEEN} and actions {CHOSEN}"
_Rows = tuple[NDArray[np.float32], Any]  # relative actions (n, 3), and the model's memory, one entry a row


class EgocentricState(NamedTuple):
    """What travels between calls."""

    seen: EgocentricMemory  # what the egocentric observation needs
    model: tuple[Any, ...] | None  # memory of a recurrent model, one entry a row; None for one without


class EgocentricPolicy:
    """A model that learnt on the egocentric interface behind Stable-Baselines3's `predict`, on raw observations.

    The egocentric observation and the reference that a relative action stands for are made inside. The model is asked
    for one row at a time, so a flight does not depend on those beside it.

    Args:
        model: a model of Stable-Baselines3 or sb3-contrib, recurrent or not, that sees through its `VecNormalize` if
            it has one; or a torch module that turns observations, a float tensor (1, 68), into actions, (1, 3), and is
            put into evaluation mode; or a `Network`.
        env: environment it is to fly; needed only if that has another vehicle, law or world than the default.

    Raises:
        ValueError: a model for other observations or actions; the message names both.
        TypeError: something else than a model, or an environment of another kind.
    """

    def __init__(self, model: Any, env: Any = None) -> None:
        """Check that the model fits the interface."""
        self._choose = _chooser(model)
        believed: Any = SimpleNamespace(vehicle=HYDRONE, world=World())
        if env is not None:
            from planners.belief import belief_of

            believed = belief_of(env)
        self._egocentric = Egocentric(believed)

    def predict(
        self,
        observation: RawObservation,
        state: EgocentricState | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], EgocentricState]:
        """Return references for one observation or a batch, in Stable-Baselines3's form.

        Args:
            observation: Dict observation of `interface="world"`, single or batched along the first axis.
            state: what the last call returned, None at the start.
            episode_start: (n,) True where an episode begins: that memory is dropped.
            deterministic: take the mean action; False lets a model that can draw one. Modules and networks never draw.

        Returns:
            Actions, (4,) or (n, 4) float32 (m, m, m, rad), and the new state.

        Raises:
            ValueError: an observation of another interface, arrays of the wrong shape, an action that is not finite.
        """
        if episode_start is not None and "state" in observation and np.ndim(observation["state"]) == 1:
            episode_start = np.reshape(episode_start, ())
        before, held = (None, None) if state is None else state
        seen, memory = self._egocentric.observe(observation, before, episode_start)
        rows = np.atleast_2d(seen)
        starting = np.broadcast_to(False if episode_start is None else np.asarray(episode_start, bool), len(rows))
        if held is not None:
            held = tuple(None if start else own for own, start in zip(held, starting, strict=True))
        action, held = self._choose(rows, held, deterministic)
        action = np.clip(action, -1.0, 1.0).reshape((*seen.shape[:-1], *CHOSEN.shape))
        return self._egocentric.reference(action, observation, memory), EgocentricState(memory, held)


def _chooser(model: Any) -> Callable[[NDArray[np.float32], Any, bool], _Rows]:
    """Return what asks a model for the actions of rows (n, 68)."""
    torch = sys.modules.get("torch")  # imported by whoever made a module
    if isinstance(model, Network):
        return lambda rows, held, deterministic: (model(rows), None)
    if callable(getattr(model, "predict", None)) and hasattr(model, "action_space"):
        return _predicting(model)
    if torch is not None and isinstance(model, torch.nn.Module):
        return _computing(model.eval(), torch)
    raise TypeError(f"model must be one of Stable-Baselines3 or a torch module, got {type(model).__name__}")


def _predicting(model: Any) -> Callable[[NDArray[np.float32], Any, bool], _Rows]:
    """Ask a model of Stable-Baselines3."""
    name, seen, chosen = type(model).__name__, model.observation_space, model.action_space
    if (seen, chosen) != (SEEN, CHOSEN):
        discrete = "" if hasattr(chosen, "low") else "; an algorithm for discrete actions cannot choose a reference"
        seen, chosen = (shorten(str(space), 100, placeholder=" …") for space in (seen, chosen))
        raise ValueError(f"{name} was trained on observations {seen} and actions {chosen}; {INTERFACE}{discrete}")
    scale = getattr(model, "get_vec_normalize_env", lambda: None)()

    def choose(rows: NDArray[np.float32], held: Any, deterministic: bool) -> _Rows:
        rows, told = rows if scale is None else scale.normalize_obs(rows), []
        for row, own in zip(rows, held or [None] * len(rows)):
            told.append(
                model.predict(row, state=own, episode_start=np.array([own is None]), deterministic=deterministic)
            )
        actions, states = zip(*told)
        return np.array(actions), None if states[0] is None else states

    return choose


def _computing(module: Any, torch: Any) -> Callable[[NDArray[np.float32], Any, bool], _Rows]:
    """Ask a torch module, on the device and in the precision of its parameters."""
    like = next((each for each in module.parameters() if each.is_floating_point()), torch.zeros(()))

    def choose(rows: NDArray[np.float32], held: Any, deterministic: bool) -> _Rows:
        with torch.no_grad():
            told = [module(torch.as_tensor(row[None]).to(like)) for row in rows]
        return np.array([action.cpu().numpy()[0] for action in told], np.float32), None

    try:
        with torch.no_grad():
            told = module(torch.zeros((1, *SEEN.shape)).to(like))
    except Exception as error:  # of somebody else's code
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(f"{type(module).__name__} refuses observations (1, 68): {reason}; {INTERFACE}") from error
    if not isinstance(told, torch.Tensor) or told.shape != (1, *CHOSEN.shape):
        got = tuple(told.shape) if isinstance(told, torch.Tensor) else type(told).__name__
        raise ValueError(f"{type(module).__name__} turns observations (1, 68) into {got}, not (1, 3); {INTERFACE}")
    return choose
