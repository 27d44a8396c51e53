"""A spec file → the frozen typed spec, or every fault in it at once."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from planner.errors import Fault, InputError
from planner.spec.alternatives import with_alternatives
from planner.spec.copies import with_copies
from planner.spec.model import Spec
from planner.spec.places import fault_at
from planner.spec.review import Review
from planner.spec.rules import review
from planner.spec.scatter import with_scatter
from planner.spec.sentences import faults_of
from planner.spec.yaml12 import MAX_BYTES, Document, Path, read_yaml


@dataclass(frozen=True)
class LoadedSpec:
    """A spec that can be planned, where it came from, and what is odd about it.

    sha256: of the file's bytes; path: the file as the user named it; folder: what `{file: …}` is relative to
    absent: keys that a spec of the sensor alone does not have; what stands in their place says nothing
    data: the file's bytes, which reports quote and `update` edits
    """

    spec: Spec
    sha256: str
    path: FilePath
    warnings: tuple[Fault, ...]
    absent: tuple[str, ...] = ()
    data: bytes = b""

    @property
    def folder(self) -> FilePath:
        """Where the files lie that the spec names."""
        return self.path.parent

    @property
    def text(self) -> str:
        """The file's text."""
        return self.data.decode("utf-8-sig")


def load_spec(path: FilePath) -> LoadedSpec:
    """Load a spec file.

    Raises InputError with every fault at its file:line:column: unreadable files, YAML, unknown and missing
    keys, units, and whatever contradicts itself (see `planner.spec.rules`).
    """
    data = spec_bytes(FilePath(path))
    return spec_from_bytes(data, FilePath(path))


def spec_from_bytes(data: bytes, path: FilePath) -> LoadedSpec:
    """As `load_spec`, for bytes at hand; `path` names them, and files are relative to its folder."""
    document = read_document(data, path)
    document, wrong = with_alternatives(document)
    spec, faults, warnings = _checked(document, path.parent)
    faults = [*wrong, *faults]
    if spec is None or faults:
        count = f"{len(faults)} faults" if len(faults) > 1 else "1 fault"
        raise InputError(f"{path.name} cannot be used: {count}", faults)
    return LoadedSpec(spec, hashlib.sha256(data).hexdigest(), path, tuple(sorted(warnings)), data=data)


def read_document(data: bytes, path: FilePath) -> Document:
    """The YAML of a spec, a mapping. Raises InputError when it is none."""
    document = read_yaml(data, str(path))
    _refuse_other_shapes(document)
    return document


def checked_parts(data: bytes, path: FilePath, parts: Sequence[str], original: bytes) -> LoadedSpec:
    """As `spec_from_bytes`, with the faults of some parts alone. original: bytes for the digest."""
    spec, faults, _ = _checked(read_document(data, path), path.parent)
    mine = [fault for fault in faults if not fault.path or fault.path.split(".")[0].split("[")[0] in parts]
    if spec is None or mine:
        found = mine or faults
        raise InputError(f"{path.name} cannot be used: {len(found)} fault{'s' * (len(found) > 1)}", found)
    return LoadedSpec(spec, hashlib.sha256(original).hexdigest(), path, (), data=original)


def spec_bytes(path: FilePath) -> bytes:
    """The bytes of a spec's file. Raises InputError when it cannot be read."""
    try:
        if path.is_dir():
            raise _whole_file(path, "is a folder; give the spec file in it")
        with path.open("rb") as file:  # not all of an endless or giant file: one byte too many is enough
            return file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise _whole_file(path, "does not exist; 'planner init' writes a spec to start from") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _whole_file(path, f"cannot be read: {reason}") from None


def _whole_file(path: FilePath, message: str) -> InputError:
    return InputError("no spec", [Fault(str(path), 0, 0, "", message, "P001")])


def _refuse_other_shapes(document: Document) -> None:
    if isinstance(document.value, dict):
        return
    kinds = {type(None): "is empty", list: "is a list"}
    what = kinds.get(type(document.value), "is a single value")
    message = f"the file {what}; a spec is lines of 'key: value' ('planner init' writes one to start from)"
    raise InputError("no spec", [fault_at(document, "P008", (), message)])


def _checked(document: Document, folder: FilePath) -> tuple[Spec | None, list[Fault], Sequence[Fault]]:
    """The spec if its form is right, all faults, and the warnings."""
    empty = dict(_nothings(document, document.value, ()))
    try:
        spec: Spec | None = Spec.model_validate(document.value)
        found: dict[Path, list[Fault]] = {}
    except ValidationError as error:
        spec, found = None, {}
        for path, fault in faults_of(error, document, document.value, Spec):
            found.setdefault(path, []).append(fault)
    for path, fault in empty.items():
        found[path] = [fault]
    faults = [fault for several in found.values() for fault in several]
    draft = spec if spec is not None and not found else _draft(document.value, found)
    if draft is None:
        return None, faults, ()
    seen = Review(draft, document, folder, frozenset(_part(path) for path in found))
    review(seen)
    return with_scatter(with_copies(spec)) if spec else None, faults + seen.faults, seen.warnings


def _nothings(document: Document, value: Any, path: Path) -> Iterator[tuple[Path, Fault]]:
    """A key without a value: YAML reads it as nothing, and nobody means that."""
    if value is None:
        yield path, fault_at(document, "P009", path, "is empty; write a value, or remove the key", key=True)
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from _nothings(document, item, (*path, key))


def _draft(value: dict[Any, Any], found: dict[Path, list[Fault]]) -> Spec | None:
    """The spec without the parts in which something was found; None when even that has no form."""
    from planner.spec.draft import Draft  # a model of its own takes 12 ms to build; good specs need none

    rest = copy.deepcopy(value)
    for path in found:
        _remove(rest, _part(path))
    try:
        return Draft.model_validate(rest)
    except ValidationError:
        return None


def _part(path: Path) -> Path:
    """The smallest part of a spec that can be taken out and leaves the rest to be checked."""
    depth = {"unit": 4, "benches": 2, "tests": 2, "plan": 2}
    if path[:1] == ("requirement",):
        entry = path[:2] if len(path) > 1 and isinstance(path[1], int) else path[:1]
        optional = path[len(entry) : len(entry) + 1]
        return (*entry, *optional) if optional in (("rule",), ("at",), ("temperature",)) else entry
    return path[: depth.get(str(path[0]), 1)] if path else path


def _remove(value: Any, path: Sequence[Any]) -> None:
    """Take a part out; an item of a list leaves a None, so that the others keep their numbers."""
    for part in path[:-1]:
        value = value[part] if isinstance(value, list) or part in value else {}
    if isinstance(value, list):
        value[path[-1]] = None
    elif path and isinstance(value, dict):
        value.pop(path[-1], None)
