"""The tables of docs/paper-to-code.md and docs/deviations.md: every function exists and every test can be found."""

import ast
import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("paper-to-code.md", "deviations.md")


def tables(page):
    """Yield each row of each table as a dict from column title to cell."""
    columns = None
    for line in (ROOT / "docs" / page).read_text(encoding="utf-8").splitlines():
        if not line.startswith("|"):
            columns = None
            continue
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if columns is None:
            columns = cells
        elif not set(line) <= set("|-: "):
            assert len(cells) == len(columns), f"{page}: {line}"
            yield dict(zip(columns, cells, strict=True))


def named(column, page):
    """The code spans of a column, over all tables of a page that have it."""
    spans = []
    for row in tables(page):
        if column in row:
            found = re.findall(r"`([^`]+)`", row[column])
            assert found, f"{page}: no {column.lower()} in {row}"
            spans += found
    return sorted(set(spans))


def resolve(path):
    """Import a dotted path: a module, then attributes of what is in it."""
    parts = path.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError as error:
            if not (error.name and path.startswith(error.name)):
                raise
            continue
        for attribute in parts[length:]:
            found = getattr(found, attribute)
        return found
    raise ModuleNotFoundError(path)


def functions_in(node):
    tree = ast.parse((ROOT / node).read_text(encoding="utf-8"))
    return {item.name for item in ast.walk(tree) if isinstance(item, ast.FunctionDef) and item.name.startswith("test_")}


@pytest.mark.parametrize("path", sorted({path for page in PAGES for path in named("Function", page)}))
def test_function_exists(path):
    assert callable(resolve(path)) or isinstance(resolve(path), property)


@pytest.mark.parametrize("node", named("Test", "paper-to-code.md"))
def test_test_exists(node):
    file, _, function = node.partition("::")
    assert (ROOT / file).is_file()
    functions = functions_in(file)
    assert function in functions if function else functions


def test_every_erratum_has_its_row():
    marks = [row["#"] for row in tables("deviations.md") if "#" in row]
    assert marks == [f"E{number}" for number in range(1, 17)]


def test_every_equation_has_its_row():
    covered = set()
    for row in tables("paper-to-code.md"):
        for first, last in re.findall(r"\((\d+)\)(?:–\((\d+)\))?", row.get("Paper", "")):
            covered |= set(range(int(first), int(last or first) + 1))
    assert covered == set(range(1, 17))


@pytest.mark.parametrize("mark", [f"E{number}" for number in range(1, 16)])
def test_code_and_model_docstring_name_the_erratum(mark):
    """The module that a deviation points to says so itself, or the package docstring of the model does."""
    row = next(row for row in tables("deviations.md") if row.get("#") == mark)
    path = re.findall(r"`([^`]+)`", row["Function"])[0]
    found = resolve(path)
    module = (ROOT / Path(*path.split(".")[:3])).with_suffix(".py")
    module = module if module.is_file() else (ROOT / Path(*path.split(".")[:2])).with_suffix(".py")
    texts = [module.read_text(encoding="utf-8"), importlib.import_module("hydrone_gym.physics").__doc__]
    assert found is not None
    assert any(re.search(rf"\b{mark}\b", text) for text in texts)


def test_docstring_of_the_model_fits_a_terminal():
    lines = importlib.import_module("hydrone_gym.physics").__doc__.splitlines()
    assert len(lines) <= 150
    assert max(map(len, lines)) <= 120


def test_a_wrong_name_is_noticed():
    with pytest.raises(AttributeError):
        resolve("hydrone_gym.physics.dynamics.no_such_function")
    with pytest.raises(ModuleNotFoundError):
        resolve("no_such_package.anything")
