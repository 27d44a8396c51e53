"""A spec's text → the same in the present format; what it says stays, and its comments and layout too.

Format 1 is the first and the only one so far. What has changed within it since are defaults: a plan was made
by the published method where nothing was said, and is made by information now, which does not read some keys.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from pathlib import Path as FilePath

from planner.errors import InputError
from planner.spec.load import LoadedSpec, read_document, spec_from_bytes
from planner.spec.text_edit import SpecText
from planner.spec.yaml12 import Path, decode

FORMAT = 1
IDLE = "P531"  # the rule of keys that the method does not read
_OLDER = (0, 1, "0", "1", "1.0", "v0", "v1", False, True)


@dataclass(frozen=True)
class Migration:
    """A spec in the present format. changes: a sentence each, none when it was; old: the text before."""

    spec: LoadedSpec
    changes: tuple[str, ...]
    old: str

    @property
    def diff(self) -> str:
        """The difference of the texts, as `diff -u` writes it."""
        name = str(self.spec.path)
        lines = difflib.unified_diff(
            self.old.splitlines(keepends=True), self.spec.text.splitlines(keepends=True), name, name
        )
        return "".join(line if line.endswith("\n") else f"{line}\n" for line in lines)


def migrated(data: bytes, path: FilePath, *, published: bool = False) -> Migration:
    """The bytes of a spec → the spec in format 1, checked.

    published: plan as before, when nothing was said about the method. Raises InputError for a later format,
    and for what else `planner check` finds wrong, at its place in the old text.
    """
    old = decode(data, str(path))
    text, changes = _in_this_format(data, old, path)
    if changes:
        _refuse_other_faults(data, path)
    loaded = spec_from_bytes(text.encode(), path)
    if published and loaded.spec.plan.method != "published":
        text, change = _published(text)
        changes.append(change)
    else:
        text, removed = _without_idle_keys(text, loaded)
        changes += removed
    return Migration(spec_from_bytes(text.encode(), path), tuple(changes), old)


def _in_this_format(data: bytes, text: str, path: FilePath) -> tuple[str, list[str]]:
    """The text with `planner: 1` as its first entry."""
    tree = read_document(data, path).value
    edit = SpecText(text)
    if "planner" not in tree:
        edit.first(f"planner: {FORMAT}")
        return edit.edited(), [f"the format is said: planner: {FORMAT}"]
    found = tree["planner"]
    if found == FORMAT and not isinstance(found, bool):
        return text, []
    if found not in _OLDER:
        raise InputError(
            f"{path.name} says planner: {found}; this planner reads format {FORMAT}: update planner"
        )
    edit.replace(("planner",), str(FORMAT))
    return edit.edited(), [f"the format {found} is written planner: {FORMAT}"]


def _refuse_other_faults(data: bytes, path: FilePath) -> None:
    """Faults at their places in the old text, where the user can mend them."""
    try:
        spec_from_bytes(data, path)
    except InputError as refusal:
        others = [fault for fault in refusal.faults if fault.path != "planner"]
        if others:
            said = f"{len(others)} fault{'s' * (len(others) > 1)} that no migration mends"
            raise InputError(f"{path.name} has {said}", others) from None


def _published(text: str) -> tuple[str, str]:
    edit = SpecText(text)
    if edit.node(("plan", "method")) is None:
        edit.enter(("plan",), "method", "published")
    else:
        edit.replace(("plan", "method"), "published")
    return edit.edited(), "plan.method: published, as plans were made when nothing was said"


def _without_idle_keys(text: str, loaded: LoadedSpec) -> tuple[str, list[str]]:
    idle = [warning.path for warning in loaded.warnings if warning.code == IDLE]
    for name in idle:  # one by one: places move, and neighbours share a comma
        edit = SpecText(text)
        where: Path = tuple(name.split("."))
        edit.remove(where)
        text = edit.edited()
    return text, [f"{name} is left out: method information does not read it" for name in idle]
