"""What a policy is made of: the files of its code and of a trained agent, so that its rows are kept while these last.

This project's own packages are left out, `provenance.sources` tells those for a whole evaluation; so is what a policy
reads by itself.
"""

import ast
import importlib.util
import inspect
import sysconfig
import uuid
from collections.abc import Callable, Iterator
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from hydrone_gym.evaluation.provenance import CODE, PARTS, hash_of


def digest_of(factory: str | Callable[..., Any], search: str, folder: str, wrapper: str) -> str:
    """Return a hash of what a `PolicySource` is made from, wherever that lies; OSError for what cannot be read.

    A factory that is neither found by its name nor in a file, such as a lambda, gets one that no other has: whether it
    is what it was cannot be told.
    """
    import joblib

    named = [wrapper]
    files = {f"{wrapper} {name}": file for name, file in modules_of(wrapper).items()}
    if isinstance(factory, str):
        place, _, attribute = factory.rpartition(":")
        named.append(attribute if place.endswith(".py") else factory)
        files |= modules_of(factory, search)
    else:
        try:
            named.append(joblib.hash(factory))
            files |= _defining(factory)
        except Exception:  # whatever pickle and inspect raise for what they do not know
            return uuid.uuid4().hex
    agent = (file for file in Path(folder).rglob("[!.]*") if file.is_file()) if folder else ()
    files |= {file.relative_to(folder).as_posix(): file for file in agent}
    return joblib.hash([*named, hash_of(files)])


def _defining(factory: Any) -> dict[str, Path]:
    """Return the files that a factory is made of: a class, function or method, or an object with arguments for one."""
    owner = getattr(factory, "func", factory)  # of a functools.partial
    owner = getattr(owner, "__self__", owner)
    owner = owner if inspect.isclass(owner) or inspect.isfunction(owner) else type(owner)
    file, module = Path(inspect.getsourcefile(owner) or ""), owner.__module__
    if module == "__main__":
        return _imported(file)
    package = file.parent if file.stem == "__init__" else file
    root = str(package.parents[module.count(".")])
    installed = root in (sysconfig.get_path("purelib"), sysconfig.get_path("platlib"))
    return modules_of(f"{module}:", "" if installed else root)


def modules_of(path: str, search: str = "") -> dict[str, Path]:
    """Return the files, by their modules' names, that "module:attribute" or "file.py:attribute" is made of.

    Of a file, and of a module in the folder `search`: it and what it imports from the same folder, at once or through
    others. Of an installed package: all of it.
    """
    place = path.rpartition(":")[0]
    if place.endswith(".py"):
        return _imported(Path(place))
    top = place.partition(".")[0]
    if not top or top in PARTS:
        return {}
    spec, local = importlib.util.find_spec(top), PathFinder.find_spec(top, [search])
    if local is not None and (spec is None or spec.origin == local.origin):
        return _imported(*_files_of(place, Path(search)), folder=Path(search))
    if spec is None or spec.submodule_search_locations is None:
        return {top: Path(spec.origin)} if spec is not None and spec.has_location and spec.origin else {}
    folders = map(Path, spec.submodule_search_locations)
    files = ((file, file.relative_to(folder)) for folder in folders for file in folder.rglob("*"))
    return {".".join((top, *place.parts)): file for file, place in files if file.suffix in CODE}


def _imported(*files: Path, folder: Path | None = None) -> dict[str, Path]:
    """Return files and what they import from a folder, unless given that of the first, by the modules' names."""
    folder = files[0].parent if folder is None else folder
    waiting, found = list(files), dict[str, Path]()
    while waiting:
        file = waiting.pop()
        name = ".".join(file.relative_to(folder).with_suffix("").parts)
        if name not in found:
            found[name] = file
            waiting += (other for module in _names(file, name) for other in _files_of(module, folder))
    return found


def _names(file: Path, name: str) -> Iterator[str]:
    """Yield the dotted names that a module may import; none of a file that is no Python."""
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = name.split(".")[: -node.level] if node.level else []
            module = ".".join((*package, *filter(None, [node.module])))
            yield from (f"{module}.{alias.name}".lstrip(".") for alias in node.names)


def _files_of(module: str, folder: Path) -> list[Path]:
    """Return the files in a folder that are run to import a module: its own, and those of the packages it lies in."""
    parts = module.split(".")
    if parts[0] in PARTS:
        return []
    places = [folder.joinpath(*parts[: k + 1]) for k in range(len(parts))]
    return [file for place in places for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file()]
