"""Small edits in a spec's text: what is not edited keeps its bytes, comments and layout included.

Places come from PyYAML's nodes, whose marks tell where every value begins and ends; the text has been read by
`planner.spec.load` before, so it is a mapping within bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml

Path = Sequence[str | int | float]
WIDTH = 100


@dataclass(frozen=True)
class _Edit:
    start: int
    end: int
    text: str


@dataclass
class SpecText:
    """A YAML text and the edits to be made in it; `edited` is the new text."""

    text: str
    edits: list[_Edit] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.newline = "\r\n" if "\r\n" in self.text else "\n"
        self.root: Any = yaml.compose(self.text, Loader=yaml.SafeLoader)

    def node(self, path: Path) -> Any:
        """The node at a path, or None."""
        node = self.root
        for part in path:
            node = _child(node, part)
            if node is None:
                return None
        return node

    def written(self, path: Path) -> dict[str, str] | None:
        """Key -> text of the mapping at a path, as it stands; None without one."""
        node = self.node(path)
        if not isinstance(node, yaml.MappingNode):
            return None
        return {str(k.value): self.text[v.start_mark.index : v.end_mark.index] for k, v in node.value}

    def settle(self) -> None:
        """Make the edits so far: later ones find their places in the text as it is then."""
        self.text, self.edits = self.edited(), []
        self.root = yaml.compose(self.text, Loader=yaml.SafeLoader)

    def replace(self, path: Path, value: str) -> None:
        """Another scalar in the place of the one at a path."""
        node = self.node(path)
        self.edits.append(_Edit(node.start_mark.index, node.end_mark.index, value))

    def append(self, path: Path, items: Sequence[str]) -> None:
        """Further items of the list at a path, in the list's own style; a single item becomes a list."""
        node = self.node(path)
        if isinstance(node, yaml.ScalarNode):
            one = self.text[node.start_mark.index : node.end_mark.index]
            self.edits.append(
                _Edit(node.start_mark.index, node.end_mark.index, f"[{', '.join([one, *items])}]")
            )
        elif node.flow_style:
            self._into_flow(node, items)
        else:
            lead = " " * node.start_mark.column + "- "
            self._after(node, [lead + item for item in items])

    def enter(self, path: Path, key: str, value: str, comment: str = "") -> None:
        """A further entry of the mapping at a path; its value is one line in flow style."""
        node = self.node(path)
        if node is None:
            self.enter(path[:-1], str(path[-1]), f"{{{key}: {value}}}", comment)
        elif node.flow_style:
            self._into_flow(node, [f"{key}: {value}"])
        else:
            indent = " " * node.value[0][0].start_mark.column
            note = [f"{indent}# {comment}"] if comment else []
            self._after(node, [*note, f"{indent}{key}: {value}"])

    def first(self, line: str) -> None:
        """A line before the first entry of the whole spec, behind the comments at its top."""
        at = self.root.start_mark.index
        end = ", " if self.root.flow_style else self.newline
        self.edits.append(_Edit(at + self.root.flow_style, at + self.root.flow_style, line + end))

    def remove(self, path: Path) -> None:
        """An entry of a mapping goes with its key; the last one of a mapping takes the mapping along."""
        mapping = self.node(path[:-1])
        if len(mapping.value) == 1 and len(path) > 1:
            self.remove(path[:-1])
            return
        index = next(i for i, (key, _) in enumerate(mapping.value) if key.value == str(path[-1]))
        key, value = mapping.value[index]
        if not mapping.flow_style:
            stop = self.text.find("\n", _last_leaf(value).end_mark.index)
            begin = key.start_mark.index - key.start_mark.column
            self.edits.append(_Edit(begin, len(self.text) if stop < 0 else stop + 1, ""))
        elif index + 1 < len(mapping.value):
            self.edits.append(_Edit(key.start_mark.index, mapping.value[index + 1][0].start_mark.index, ""))
        else:
            self.edits.append(_Edit(mapping.value[index - 1][1].end_mark.index, value.end_mark.index, ""))

    def head(self, lines: Sequence[str]) -> None:
        """Comment lines at the very top."""
        self.edits.append(_Edit(0, 0, "".join(f"# {line}{self.newline}" for line in lines)))

    def edited(self) -> str:
        """The text with all edits made."""
        out, last = [], 0
        for edit in sorted(self.edits, key=lambda e: e.start):
            out += [self.text[last : edit.start], edit.text]
            last = edit.end
        return "".join([*out, self.text[last:]])

    def _into_flow(self, node: Any, items: Sequence[str]) -> None:
        if not node.value:
            at = node.start_mark.index + 1
            self.edits.append(_Edit(at, at, ", ".join(items)))
            return
        last = node.value[-1][1] if isinstance(node, yaml.MappingNode) else node.value[-1]
        at = last.end_mark.index
        column = last.end_mark.column + sum(len(item) + 2 for item in items)
        lead = ", " if column < WIDTH + 10 else "," + self.newline + " " * (node.start_mark.column + 1)
        self.edits.append(_Edit(at, at, lead + ", ".join(items)))

    def _after(self, node: Any, lines: Sequence[str]) -> None:
        """New lines behind the last line of a block."""
        end = _last_leaf(node).end_mark
        written = self.newline.join(lines) + self.newline
        if end.column == 0 and end.index > 0:  # a block scalar ends where the next line begins
            self.edits.append(_Edit(end.index, end.index, written))
            return
        stop = self.text.find("\n", end.index)
        if stop < 0:
            self.edits.append(_Edit(len(self.text), len(self.text), self.newline + written))
        else:
            self.edits.append(_Edit(stop + 1, stop + 1, written))


def _child(node: Any, part: str | int | float) -> Any:
    if isinstance(node, yaml.SequenceNode):
        return node.value[part] if isinstance(part, int) and part < len(node.value) else None
    if not isinstance(node, yaml.MappingNode):
        return None
    return next((value for key, value in node.value if key.value == str(part)), None)


def _last_leaf(node: Any) -> Any:
    while not isinstance(node, yaml.ScalarNode) and not node.flow_style and node.value:
        node = node.value[-1][1] if isinstance(node, yaml.MappingNode) else node.value[-1]
    return node
