"""A spec file → the frozen typed spec, or every fault in it at once."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
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
from planner.spec.sentences import faults_of, meant_key
from planner.spec.unused_tests import without_unused
from planner.spec.yaml12 import MAX_BYTES, Document, Path, read_as_far, read_yaml

TWICE, UNKNOWN_KEY, MISSING = "P004", "P101", "P102"


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
    document = read_as_far(data, str(path))
    _refuse_other_shapes(document)
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
    found = _with_unread(found, document)
    faults = [fault for several in found.values() for fault in several]
    draft, gaps = (spec, frozenset[Path]()) if spec is not None and not found else _draft(document, found)
    if draft is None:
        return None, faults, ()
    seen = Review(draft, document, folder, gaps)
    review(seen)
    faults = faults + seen.faults
    if spec is None:
        return None, faults, seen.warnings
    used = spec if faults else without_unused(spec)
    return with_scatter(with_copies(used)), faults, seen.warnings


def _nothings(document: Document, value: Any, path: Path) -> Iterator[tuple[Path, Fault]]:
    """A key without a value: YAML reads it as nothing, and nobody means that."""
    if value is None:
        yield path, fault_at(document, "P009", path, "is empty; write a value, or remove the key", key=True)
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from _nothings(document, item, (*path, key))


def _with_unread(found: Mapping[Path, list[Fault]], document: Document) -> dict[Path, list[Fault]]:
    """The faults of the form, and those of the reading, below which the form has nothing to say.

    Where a key could not be read, the mapping that has it lacks nothing.
    """
    unread = [path for path, fault in document.unread if path and fault.code != TWICE]
    whole = any(not path for path, _ in document.unread)
    told: dict[Path, list[Fault]] = {}
    for path, faults in found.items():
        lacks = whole and len(path) == 1 and faults[0].code == MISSING
        if not lacks and not any(path[: len(part)] == part for part in unread):
            told[path] = faults
    for path, fault in document.unread:
        told.setdefault(path, []).append(fault)
    return told


def _draft(document: Document, found: Mapping[Path, Sequence[Fault]]) -> tuple[Spec | None, frozenset[Path]]:
    """The spec without the parts in which something was found, and those parts.

    Of a key that stands twice the first counts: nothing is taken out for it. An unknown key is as good as a
    faulty value of the known key that was meant.
    """
    from planner.spec.draft import drafted  # a model of its own takes 12 ms to build; good specs need none

    foreign = [path for path, faults in found.items() if all(f.code == UNKNOWN_KEY for f in faults)]
    faulty = [p for p, faults in found.items() if any(f.code not in (UNKNOWN_KEY, TWICE) for f in faults)]
    meant = {meant_key(path, Spec) for path in foreign} - {None, *document.values}
    return drafted(document.value, foreign, [*faulty, *(path for path in meant if path is not None)])
