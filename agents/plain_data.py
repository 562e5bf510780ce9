"""Plain data from YAML, whoever wrote it: short, shallow, each key once; no code, no aliases that multiply."""

from pathlib import Path
from typing import Any

import yaml

MOST_BYTES = 64_000  # of a text; an agent's has some hundred
MOST_DEPTH = 20  # of lists and mappings within each other


class _PlainLoader(yaml.SafeLoader):
    """Refuses what YAML allows and plain data does not need."""

    depth = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node; errors say where."""
        mark = self.peek_event().start_mark
        if self.check_event(yaml.AliasEvent):
            raise yaml.MarkedYAMLError(problem="an alias", problem_mark=mark)
        if self.depth == MOST_DEPTH:
            raise yaml.MarkedYAMLError(problem=f"nested more than {MOST_DEPTH} deep", problem_mark=mark)
        self.depth += 1
        node = super().compose_node(parent, index)
        self.depth -= 1
        return node

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """Construct a mapping whose keys all differ."""
        mapping = super().construct_mapping(node, deep)
        if len(mapping) < len(node.value):
            keys = [self.construct_object(key) for key, _ in node.value]
            key = next(key for key in keys if keys.count(key) > 1)
            raise yaml.MarkedYAMLError(problem=f"the key {key!r} stands there twice", problem_mark=node.start_mark)
        return mapping


class _PlainDumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        """Write what stands in two places twice."""
        return True


def to_yaml(content: Any) -> str:
    """Return plain data as a YAML text that `read_yaml` takes."""
    return yaml.dump(content, Dumper=_PlainDumper, sort_keys=False)


def read_yaml(file: Path) -> Any:
    """Return the plain data of a YAML file; ValueError in one line, naming the file and the line in it."""
    with file.open("rb") as stream:
        text = stream.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise ValueError(f"{file}: no YAML: more than {MOST_BYTES} bytes")
    try:
        return yaml.load(text.decode(), _PlainLoader)
    except Exception as error:  # PyYAML's constructors raise anything for what is not of the type that its tag says
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}: " if mark else ""
        reason = getattr(error, "problem", None) or f"{type(error).__name__}: {error}"
        raise ValueError(f"{file}: no YAML: {place}{' '.join(str(reason).split())}") from None
