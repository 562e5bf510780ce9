"""Policies by name: where a factory is found from what a user writes, without importing planners or agents here.

A factory takes the environment and returns a policy for it; one that also takes `seed` is given that of the
evaluation. Packages register factories under the entry points `hydrone_gym.policies`, and readers of folders of trained
agents, (folder, environment) -> policy, under `hydrone_gym.policy_folders`, by the name of a file in such a folder, and
what can be put around a policy, (policy, environment) -> policy, under `hydrone_gym.policy_wrappers`.
"""

import difflib
import importlib
import importlib.util
import inspect
import operator
import re
import sys
import traceback
import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.evaluation.policy_code import digest_of, modules_of

DEFAULT_POLICIES = (
    "straight-line",
    "straight-line-shield",
    "potential-field",
    "clrrt-published",
    "clrrt",
    "clrrt-weather",
    "ppo",
    "ppo-shield",
    "ppo-weather",
    "ppo-weather-shield",
    "sac",
)
_NAMES, _FOLDERS, _WRAPPERS = "hydrone_gym.policies", "hydrone_gym.policy_folders", "hydrone_gym.policy_wrappers"
_BEHIND = " behind "
_LABEL = re.compile(r"[\w.+-]+")


class Policy(Protocol):
    """Anything that chooses references: a planner, an agent, or a Stable-Baselines3 model as it is."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray, Any]:
        """Return actions for one observation or a batch, and the policy's memory.

        Args:
            observation: what the environment returned, single or batched along the first axis.
            state: what the last call returned, None at the start.
            episode_start: (n,) True where an episode begins, which resets that memory.
            deterministic: take the best action instead of drawing one.

        Actions are (4,) or (n, 4) in m, m, m, rad.
        """
        ...


Factory = Callable[..., Policy]


@dataclass(frozen=True, kw_only=True)
class PolicySource:
    """What a policy is made from; plain data that can be sent to another process."""

    label: str  # what tables call it
    factory: str | Factory  # "module:attribute", "/path/file.py:attribute", or the factory itself
    search: str = ""  # folder that modules are imported from besides those installed; empty for none
    folder: str = ""  # of a trained agent, handed to the factory before the environment; empty for none
    wrapper: str = ""  # "module:attribute" of what is put around the policy; empty for nothing
    digest: str = ""  # tells it from what it was before its code was edited; empty where nobody asks

    def make(self, env: Any, seed: int) -> Policy:
        """Return a new policy; ValueError naming it if its factory cannot be found, fails in any way or makes none."""
        try:
            factory = self.factory
            if isinstance(factory, str):
                _check_unchanged(self)
                factory = load_factory(factory, self.search, self.digest)
            arguments = (self.folder, env) if self.folder else (env,)
            policy = factory(*arguments, seed=seed) if _takes_seed(factory) else factory(*arguments)
            policy = load_factory(self.wrapper)(policy, env) if self.wrapper else policy
        except (Exception, SystemExit) as error:
            raise ValueError(f"policy {self.label!r} cannot be made: {told(error)}") from error
        if not callable(getattr(policy, "predict", None)):
            got = type(policy).__name__
            raise ValueError(f"policy {self.label!r}: its factory must return something with `predict`, got {got}")
        return policy

    @property
    def origin(self) -> str:
        """Where it comes from, for the record."""
        factory = self.factory
        if not isinstance(factory, str):
            factory = f"{getattr(factory, '__module__', '?')}:{getattr(factory, '__qualname__', repr(factory))}"
        return f"{factory} {self.folder}".strip() + f"{_BEHIND}{self.wrapper}" * bool(self.wrapper)

    @classmethod
    def of_origin(cls, label: str, origin: str) -> "PolicySource":
        """Find a source again; modules are sought in the current folder too."""
        made, _, wrapper = origin.partition(_BEHIND)
        factory, _, folder = made.partition(" ")
        return cls(label=label, factory=factory, search=str(Path.cwd()), folder=folder, wrapper=wrapper)


@cache
def _check_unchanged(source: PolicySource) -> None:
    """Raise ValueError if what this process is about to load is not what its evaluation began with."""
    if source.digest and source.digest != digest_of(source.factory, source.search, source.folder, source.wrapper):
        raise ValueError("its files have changed since the evaluation began")


def known_policies() -> list[str]:
    """Return the names that installed packages have registered."""
    return sorted({entry.name for entry in entry_points(group=_NAMES)})


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return words that ask for the known name most like what was given; none where no name is."""
    return "".join(f" (did you mean {name!r}?)" for name in difflib.get_close_matches(given, list(known), 1))


def find_policy(text: str) -> PolicySource:
    """Find what a user means by a policy.

    It is a registered name, "module:attribute", "path/file.py:attribute", or the folder of a trained agent, each also
    as "LABEL=…" to call it otherwise, and as "…+shield" to put the shield, or another registered wrapper, around it.
    Modules are sought in the current folder too.

    Raises ValueError saying why a policy cannot be found or loaded, FileNotFoundError for a file that does not exist.
    """
    source = _digested(_find(text))
    assert isinstance(source.factory, str)
    load_factory(source.factory, source.search, source.digest)
    return source


def _digested(source: PolicySource) -> PolicySource:
    """Note what a policy is made of now."""
    return replace(source, digest=digest_of(source.factory, source.search, source.folder, source.wrapper))


def _find(text: str) -> PolicySource:
    """Find what a user means, without looking at it."""
    before, _, after = text.partition("=")
    label, given = (before, after) if after and _LABEL.fullmatch(before) else (text, text)
    inner, plus, name = given.rpartition("+")
    if plus and (wrappers := entry_points(group=_WRAPPERS, name=name)):
        return replace(_find(inner), label=label, wrapper=_only(wrappers))
    if registered := entry_points(group=_NAMES, name=given):
        return PolicySource(label=label, factory=_only(registered))
    if given and Path(given).is_dir():
        return PolicySource(label=label, factory=_reader(Path(given)), folder=str(Path(given).resolve()))
    place, colon, attribute = given.rpartition(":")
    if not colon or not place or not attribute:
        raise ValueError(
            f"no policy {given!r}{did_you_mean(given, known_policies())}: known are {', '.join(known_policies())}; "
            "or give module:attribute, file.py:attribute, or the folder of a trained agent"
        )
    factory, search = given, str(Path.cwd())
    if place.endswith(".py"):
        factory, search = f"{Path(place).resolve()}:{attribute}", ""
        if not Path(place).is_file():
            raise FileNotFoundError(f"policy {given!r}: there is no file {place}")
    return PolicySource(label=label, factory=factory, search=search)


def find_policies(policies: str | Iterable[str] | Mapping[str, str | Factory]) -> tuple[PolicySource, ...]:
    """Find several policies; a mapping has labels as keys, and what `find_policy` takes or factories as values."""
    if isinstance(policies, Mapping):
        found = tuple(_labelled(label, value) for label, value in policies.items())
    else:
        found = tuple(find_policy(text) for text in ([policies] if isinstance(policies, str) else policies))
    labels = [source.label for source in found]
    if not labels or not all(label.isprintable() for label in labels):
        raise ValueError(f"there must be at least one policy, and names without line breaks, got {labels}")
    if twice := sorted({label for label in labels if labels.count(label) > 1}):
        raise ValueError(f"policies must have different names, got {', '.join(twice)} twice: write LABEL=… before one")
    return found


def _labelled(label: str, value: str | Factory) -> PolicySource:
    if not _LABEL.fullmatch(label):
        raise ValueError(f"a label must consist of letters, digits and . _ + -, got {label!r}")
    return (
        find_policy(f"{label}={value}")
        if isinstance(value, str)
        else _digested(PolicySource(label=label, factory=value))
    )


def _only(registered: Iterable[EntryPoint]) -> str:
    """Return where the one entry point of a name leads; ValueError if packages disagree."""
    values = sorted({entry.value for entry in registered})
    if len(values) > 1:
        name = next(iter(registered)).name
        raise ValueError(f"policy {name!r} is registered by several packages: {', '.join(values)}")
    return values[0]


def _reader(folder: Path) -> str:
    """Return where the reader of an agent's folder is found, chosen by the files in the folder."""
    readers = entry_points(group=_FOLDERS)
    if fitting := [entry for entry in readers if (folder / entry.name).is_file()]:
        return _only(fitting)
    raise ValueError(f"{folder}: not a trained agent: there must be a file {', '.join(sorted(readers.names))}")


@cache
def load_factory(path: str, search: str = "", digest: str = "") -> Factory:
    """Import what "module:attribute" or "file.py:attribute" names; ValueError says what is missing.

    A module of a user may fail in any way when it is imported; that way is named. What lies beside a file can be
    imported from it. With another `digest` than the last, what was imported before is imported anew.
    """
    place, _, attribute = path.rpartition(":")
    file = Path(place) if place.endswith(".py") else None
    search = str(file.parent) if file else search
    if search and search not in sys.path:
        sys.path.append(search)  # last: a file of the user's must not stand in for an installed module
    if _imported.setdefault((path, search), digest) != digest:
        _imported[path, search] = digest
        _forget({name.partition(".")[0] for name in modules_of(path, search)})
    try:
        module = _module_of(file) if file else importlib.import_module(place)
    except (Exception, SystemExit) as error:
        raise ValueError(f"policy {path!r} cannot be imported: {type(error).__name__}: {error}") from error
    try:
        found: Any = operator.attrgetter(attribute)(module)
    except AttributeError as error:
        raise ValueError(f"policy {path!r}: {error}") from None
    if not callable(found):
        raise ValueError(f"policy {path!r} must be a callable that takes the environment, got {type(found).__name__}")
    return found


_imported: dict[tuple[str, str], str] = {}  # path and search of what this process has imported: its digest


def _forget(tops: set[str]) -> None:
    """Let modules of these packages be imported anew."""
    importlib.invalidate_caches()
    for name in [name for name in sys.modules if name.partition(".")[0] in tops]:
        del sys.modules[name]


def _module_of(file: Path) -> ModuleType:
    """Run a file as a module: as it is now, whatever was compiled of it within the same second."""
    name = f"policy_{file.stem}_{zlib.crc32(str(file).encode()):08x}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)  # dataclasses and pickle look it up there
    exec(compile(file.read_bytes(), file, "exec"), module.__dict__)
    return module


def _takes_seed(factory: Factory) -> bool:
    """Tell whether a factory takes a seed, or hands it on as a method of a class that takes one."""
    owner: Any = getattr(getattr(factory, "func", factory), "__self__", None)  # `func` of a functools.partial
    try:
        options = inspect.signature(factory).parameters
        hands_on = isinstance(owner, type) and any(o.kind is o.VAR_KEYWORD for o in options.values())
        return "seed" in options or (hands_on and "seed" in inspect.signature(owner).parameters)
    except ValueError:  # some built-in callables have no signature
        return False


def told(error: BaseException) -> str:
    """Return an error in one line: kind, message, and file and line it was raised in."""
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {error}{place}".replace("\n", " ")
