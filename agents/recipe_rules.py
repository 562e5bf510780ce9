"""What the entries of a recipe may be, by name; checked before anything is made of them."""

import inspect
import math
import reprlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from gymnasium.envs.registration import registry

from agents.agent_file import DEEPEST, WIDEST
from agents.algorithms import Algorithm
from hydrone_gym.envs.options import VectorOptions, known_options

LINEAR = "lin_"  # prefix of a value, "lin_5e-4", that falls linearly to zero over the training
_FIXED = ("num_envs", "autoreset_mode", "mission", "interface")  # options that no recipe chooses


class _Rule(NamedTuple):
    words: str  # "gamma must be" and these
    holds: Callable[[Any], bool]


def _number(words: str, low: float = -math.inf, high: float = math.inf, *, prefix: str | None = None) -> _Rule:
    """A finite number, or one after a prefix in a text."""

    def holds(value: Any) -> bool:
        if isinstance(value, str) and prefix is not None and value.startswith(prefix):
            try:
                value = float(value.removeprefix(prefix))
            except ValueError:
                return False
        return (
            isinstance(value, int | float)
            and not isinstance(value, bool)
            and low <= value <= high
            and abs(value) < 1e300
        )

    return _Rule(words, holds)


def _whole(low: int, high: int = 10**10) -> _Rule:
    return _Rule(f"a whole number from {low} to {high:,}", lambda value: type(value) is int and low <= value <= high)


_YES = _Rule("true or false", lambda value: isinstance(value, bool))
_POSITIVE = _number("a number of at least 0", 0.0)
_FALLING = _number(f"a number of at least 0 such as 3.0e-4, or {LINEAR} and such a number", 0.0, prefix=LINEAR)
_SHARE = _number("a number from 0 to 1", 0.0, 1.0)
_AUTO = _number('"auto", "auto_" and a number, or a number of at least 0', 0.0, prefix="auto_")
_SIZE = _whole(1, 10**9)


def _layers(value: Any) -> bool:
    """Sizes of hidden layers, or two lists of them: of the policy and of what judges it."""
    if isinstance(value, dict):
        return len(value) == 2 and all(isinstance(v, list) and _layers(v) for v in value.values())
    sizes = isinstance(value, list) and all(type(size) is int and 1 <= size <= WIDEST for size in value)
    return sizes and 1 <= len(value) < DEEPEST


def _missions(value: Any) -> bool:
    return isinstance(value, dict) and all(
        isinstance(name, str) and name.startswith("HydroneGym/") and name in registry and type(rows) is int and rows > 0
        for name, rows in value.items()
    )


ALGORITHM = {
    "n_envs": _whole(1, 1_000_000),
    "n_timesteps": _number("a whole number of at least 1", 1.0, 1e15),
    "policy": _Rule("MlpPolicy", lambda value: value == "MlpPolicy"),
    "policy_kwargs": _Rule("a mapping, code is not run", lambda value: isinstance(value, dict)),
    "noise_type": _Rule("normal", lambda value: value == "normal"),
    "noise_std": _POSITIVE,
    **dict.fromkeys(("learning_rate", "clip_range", "clip_range_vf"), _FALLING),
    **dict.fromkeys(("gamma", "gae_lambda", "tau"), _SHARE),
    **dict.fromkeys(("vf_coef", "max_grad_norm", "target_kl", "target_policy_noise", "target_noise_clip"), _POSITIVE),
    **dict.fromkeys(("n_steps", "n_epochs", "buffer_size", "policy_delay", "target_update_interval"), _SIZE),
    **dict.fromkeys(("train_freq", "stats_window_size"), _SIZE),
    **dict.fromkeys(("learning_starts", "top_quantiles_to_drop_per_net"), _whole(0)),
    **dict.fromkeys(("gradient_steps", "sde_sample_freq"), _whole(-1)),
    "batch_size": _whole(2),
    **dict.fromkeys(("normalize_advantage", "use_sde", "use_sde_at_warmup"), _YES),
    "ent_coef": _Rule(_AUTO.words, lambda value: value == "auto" or _AUTO.holds(value)),
    "target_entropy": _Rule('"auto" or a number', lambda value: value == "auto" or _number("").holds(value)),
}
POLICY = {
    "net_arch": _Rule(
        f"a list of fewer than {DEEPEST} sizes from 1 to {WIDEST}, or a mapping of two such lists", _layers
    ),
    "log_std_init": _number("a number", -20.0, 20.0),
    "optimizer_kwargs": _Rule("a mapping, code is not run", lambda value: isinstance(value, dict)),
    "clip_mean": _POSITIVE,
    "n_critics": _whole(1, 100),
    "n_quantiles": _whole(1, 10_000),
    **dict.fromkeys(("ortho_init", "full_std", "use_expln", "share_features_extractor"), _YES),
}
TOP = {
    "missions": _Rule("a mapping from ids of this project to rows, at least 1 each", _missions),
    **dict.fromkeys(
        ("environment", "evaluation"), _Rule("a mapping of keyword options", lambda value: isinstance(value, dict))
    ),
    "shield": _YES,
}


def check_entries(file: Path, content: Mapping[Any, Any], entry: str, algorithm: Algorithm) -> None:
    """Check a recipe, whose hyper-parameters are at `entry`; ValueError names the file, the key, rule and value."""
    settings, taken = content[entry], inspect.signature(algorithm.model).parameters.keys() | {"n_envs", "n_timesteps"}
    off_policy = "action_noise" in taken
    taken |= {"noise_type", "noise_std"} if off_policy else set()
    _check(file, "", content, TOP, TOP.keys() | {entry})
    if missing := [name for name in ("n_envs", "n_timesteps", "policy") if name not in settings]:
        raise ValueError(f"{file}: {entry} lacks {', '.join(missing)}")
    rules = ALGORITHM if off_policy else {**ALGORITHM, "ent_coef": _POSITIVE}
    _check(file, "", settings, rules, rules.keys() & taken)
    policy = inspect.signature(algorithm.model.policy_aliases["MlpPolicy"]).parameters
    _check(file, "policy_kwargs.", settings.get("policy_kwargs", {}), POLICY, POLICY.keys() & policy)
    arch, judge = settings.get("policy_kwargs", {}).get("net_arch"), "qf" if off_policy else "vf"
    if isinstance(arch, dict) and arch.keys() != {"pi", judge}:
        raise ValueError(f"{file}: policy_kwargs.net_arch must name pi and {judge}, got {reprlib.repr(arch)}")
    if settings["n_timesteps"] != int(settings["n_timesteps"]):
        raise ValueError(f"{file}: n_timesteps must be {_whole(1).words}, got {settings['n_timesteps']!r}")
    missions = content.get("missions")
    if missions is not None and sum(missions.values()) != settings["n_envs"]:
        raise ValueError(f"{file}: the rows of missions must sum to n_envs = {settings['n_envs']}, got {missions!r}")
    environment = content.get("environment", {})
    several = environment.get("weather", 0)
    for weather in several if isinstance(several, list) else [several]:
        _check_options(file, "environment", {**environment, "weather": weather})
    _check_options(file, "evaluation", content.get("evaluation", {}))


def _check_options(file: Path, place: str, options: Mapping[str, Any]) -> None:
    """Check keyword options of environments."""
    _check(file, f"{place}.", options, {}, set(known_options(VectorOptions)) - set(_FIXED))
    try:
        VectorOptions(**options)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{file}: {place}: {error}") from None


def _check(file: Path, place: str, given: Mapping[Any, Any], rules: Mapping[str, _Rule], known: set[str]) -> None:
    """Check names against those known and values against their rules."""
    for name, value in given.items():
        if name not in known:
            listed = ", ".join(sorted(known))
            raise ValueError(f"{file}: unknown key {place}{reprlib.repr(name).strip(chr(39))}: known are {listed}")
        if name in rules and not rules[name].holds(value):
            raise ValueError(f"{file}: {place}{name} must be {rules[name].words}, got {reprlib.repr(value)}")
