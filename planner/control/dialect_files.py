"""Dialects by name or by file: ours, those of installed packages, and a laboratory's own YAML or TOML.

A package offers one by a line of its `pyproject.toml`; what stands there is the path of the file:

    [project.entry-points."planner.dialects"]
    their_table = "their_package.dialects:TABLE"      # TABLE = Path(__file__).with_name("table.yaml")
"""

from __future__ import annotations

import importlib.metadata
import tomllib
from pathlib import Path
from typing import Literal, TypeVar

from pydantic import ValidationError

from planner.control.dialect import ChamberDialect, TableDialect
from planner.errors import InputError, unusable_file
from planner.nouns.given_files import DIALECT
from planner.spec.places import did_you_mean
from planner.spec.yaml12 import MAX_BYTES, Document, read_yaml

OURS = Path(__file__).parent / "dialects"
GROUP = "planner.dialects"
DEFAULT: dict[str, str] = {"table": "acutrol", "chamber": "espec_p300"}
Read = TypeVar("Read", TableDialect, ChamberDialect)
Device = Literal["table", "chamber"]


def table_dialect(given: str | None = None) -> TableDialect:
    """By name or path; None: Acutrol. Raises InputError with every fault of the file at its line."""
    return _dialect(given or DEFAULT["table"], TableDialect, "table")


def chamber_dialect(given: str | None = None) -> ChamberDialect:
    """By name or path; None: ESPEC P300. Raises InputError with every fault of the file at its line."""
    return _dialect(given or DEFAULT["chamber"], ChamberDialect, "chamber")


def known_dialects() -> dict[str, str]:
    """Name -> where it comes from: ours, and the packages'. Nothing is imported."""
    found = {path.stem: "planner" for path in sorted(OURS.glob("*.yaml"))}
    for entry in sorted(importlib.metadata.entry_points(group=GROUP), key=lambda e: e.name):
        package = entry.dist.name if entry.dist is not None else entry.value
        if entry.name in found:
            raise InputError(
                f"two dialects of one name: {entry.name} of {found[entry.name]} and of {package}; "
                "uninstall one of the packages, or rename its dialect"
            )
        found[entry.name] = package
    return found


def _dialect(given: str, model: type[Read], device: Device) -> Read:
    path = Path(given)
    if not path.suffix and not path.exists():
        path = _by_name(given)
    document = _document(path)
    if not isinstance(document.value, dict):
        raise InputError(f"{path} is no dialect; it is lines of 'key: value'")
    if document.value.get("device") not in (device, None):
        raise InputError(f"{path} is the dialect of a {document.value['device']}, not of a {device}")
    try:
        return model.model_validate(document.value)
    except ValidationError as error:
        from planner.spec.sentences import faults_of

        faults = [fault for _, fault in faults_of(error, document, document.value, model)]
        raise InputError(f"{path.name} cannot be used", faults) from None


def _by_name(name: str) -> Path:
    known = known_dialects()
    if name not in known:
        raise InputError(f"unknown dialect {name!r}{did_you_mean(name, known)}; or give the path of a file")
    if known[name] == "planner":
        return OURS / f"{name}.yaml"
    (entry,) = importlib.metadata.entry_points(group=GROUP, name=name)
    try:
        return Path(str(entry.load()))
    except Exception as error:  # nobody else's fault may end the program without a word why
        raise InputError(f"the dialect {name!r} of {known[name]} cannot be used: {error}") from error


def _document(path: Path) -> Document:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise unusable_file(path, error, DIALECT) from error
    if path.suffix.lower() != ".toml":
        return read_yaml(data, str(path))
    try:
        return Document(str(path), tomllib.loads(data.decode()), {}, {(): (1, 1)})
    except (ValueError, RecursionError) as error:  # of the decoder and of TOML
        raise InputError(f"{path} cannot be read as TOML: {error}") from error
