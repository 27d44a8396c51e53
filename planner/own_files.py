"""A command replaces its own files alone: those that planner wrote, for the same spec.

Beside what it writes into a folder lies a list, `.planner-files.json`: of every file what it was made from (a
path from that folder on, so that a tree may be moved) and its SHA-256. What the list does not know as it
stands, as where the list was lost or a file was edited, is judged by its content: pages name their command,
JSON files their spec, exports their plan. A file that tells nothing is somebody's.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from html import unescape
from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError
from planner.whole_files import as_bytes, write_all_whole

LIST = ".planner-files.json"
Files = Mapping[Path, str | bytes]
_PAGE = re.compile(rb"<footer><p>Made by planner [^<]*(?:<code>(?P<command>.*?)</code>)?")
_PLANNERS = re.compile(rb'plan[_-]sha256|"title": "planner plan', re.IGNORECASE)
_HEAD, _TAIL = 1_000_000, 4_000  # bytes in which a file says what it is
_SPECS = (".yaml", ".yml")
_ELSEWHERE = "give another folder with -o, or --force to replace it"


@dataclass(frozen=True)
class Origin:
    """What a file says of itself.

    known: whether it can be told at all; else it is somebody's, unless the files beside it are ours
    other: the spec that it is of, where that is another one
    """

    known: bool
    other: str = ""


def write_own(files: Files, of: Path | str | None, out: Path | None = None, *, force: bool = False) -> None:
    """Write the files of an answer, all or none, and the lists that tell whose they are.

    of: the spec, plan or recording that they are of, a word for what is of none, as a comparison, None where
    nobody says; out: the file that the user named himself, which may go, and whose folder gets no list
    Raises InputError (P010) for files that are not planner's, or of another spec, unless `force`.
    """
    if not force:
        refuse_others({path: content for path, content in files.items() if path != out}, of)
    write_all_whole({**files, **({} if out in files else _lists(files, of))})


def refuse_others(files: Mapping[Path, str | bytes | None], of: Path | str | None) -> None:
    """Raises InputError (P010) if any of the files is there and is not planner's, or is of another spec.

    files: with the content that they are to have, where it is known: the same may be written again.
    """
    there = {path: content for path, content in files.items() if path.is_file()}
    faults = [fault for folder in {path.parent for path in there} for fault in _faults(folder, there, of)]
    if faults:
        raise refused(faults)


def refuse_unwritable(folder: Path) -> None:
    """Raises InputError for a folder that is none, or that must not be written to.

    One that is not there yet is made in the nearest that is.
    """
    there = next(place for place in (folder.absolute(), *folder.absolute().parents) if place.exists())
    if not there.is_dir():
        raise InputError(f"cannot write {folder}: {there} is no folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(f"cannot write {folder}: {there} must not be written to")


def refuse_existing(path: Path) -> None:
    """Raises InputError (P010) for a file that is there: what is written to start from replaces nothing."""
    if path.exists():
        raise refused([_fault(path, "exists already", "give another name, or --force to replace it")])


def refused(faults: list[Fault]) -> InputError:
    """The error of files that would be replaced."""
    what = "a file" if len(faults) == 1 else f"{len(faults)} files"
    return InputError(f"nothing is written: it would replace {what}", faults)


def _fault(path: Path, wrong: str, remedy: str = _ELSEWHERE) -> Fault:
    return Fault(str(path), 0, 0, "", f"{wrong}; {remedy}", "P010")


def _faults(folder: Path, there: Mapping[Path, str | bytes | None], of: Path | str | None) -> list[Fault]:
    """What stands in one folder and must not be replaced."""
    listed = _listed(folder)
    found: dict[Path, Origin] = {}
    for path, content in there.items():
        if path.parent == folder:
            old = path.read_bytes()
            if content is None or old != as_bytes(content):
                found[path] = _origin(path, old, listed, of)
    ours = not listed and any(one.known and not one.other for one in found.values())
    foreign = [_fault(p, "is not of planner's making") for p, o in found.items() if not (o.known or ours)]
    others = [_fault(p, f"is of {o.other}, not of {_named(of)}") for p, o in found.items() if o.other]
    return foreign + others


def _named(of: Path | str | None) -> str:
    return of.name if isinstance(of, Path) else str(of)


def _origin(path: Path, old: bytes, listed: Mapping[str, Mapping[str, Any]], of: Path | str | None) -> Origin:
    """By the list, if the file is as it was written; else by its content."""
    entry = listed.get(path.name, {})
    if entry.get("sha256") != hashlib.sha256(old).hexdigest():
        return _by_content(path, old, of)
    was = entry.get("of")
    if of is None or was == _of(of, path.parent):
        return Origin(True)
    if was is None or not _is_there(str(was), path.parent):  # written by hand from Python, or the spec moved
        return Origin(True, _by_content(path, old, of).other)
    return Origin(True, str(was))


def _is_there(was: str, folder: Path) -> bool:
    return " " in was or (folder / was).exists()


def _by_content(path: Path, old: bytes, of: Path | str | None) -> Origin:
    if path.suffix == ".json":
        return _of_document(old, of)
    page = _PAGE.search(old[-_TAIL:]) if path.suffix == ".html" else None
    if page:
        command = unescape((page["command"] or b"").decode(errors="replace"))
        specs = [word for word in re.split(r"[\s'=]+", command) if word.endswith(_SPECS)]
        other = specs and of is not None and _named(of) not in specs and not _is_plan(of)
        return Origin(True, specs[0] if other else "")
    return Origin(_PLANNERS.search(old[:_HEAD]) is not None)


def _is_plan(of: Path | str) -> bool:
    return isinstance(of, Path) and of.suffix not in _SPECS


def _of_document(old: bytes, of: Path | str | None) -> Origin:
    """Of a JSON file, which names its spec; the same spec has the same digest, or the same name still."""
    tree = _tree(old)
    if not tree.keys() & {"planner", "spec_sha256", "plan_sha256"}:
        return Origin(_PLANNERS.search(old[:_HEAD]) is not None)
    spec = tree.get("spec")
    if not isinstance(spec, dict) or of is None:
        return Origin(True)
    told = {str(spec.get(key)) for key in ("name", "sha256")}
    return Origin(True, "" if told & _figures(of) else f"the spec {str(spec.get('name'))!r}")


def _figures(of: Path | str) -> set[str]:
    """Digest and name of the spec at a path, or of the one that a plan there is of."""
    try:
        data = (of / "plan.json" if of.is_dir() else of).read_bytes() if isinstance(of, Path) else b""
    except OSError:
        return set()
    spec = _tree(data).get("spec")
    if isinstance(spec, dict):
        return {str(spec.get("name")), str(spec.get("sha256"))}
    name = re.search(r"^name:\s*(.+?)\s*(?: #.*)?$", data.decode(errors="replace"), re.MULTILINE)
    return {hashlib.sha256(data).hexdigest(), *([name[1].strip("'\"")] if name else [])}


def _lists(files: Files, of: Path | str | None) -> dict[Path, str]:
    """The list of each folder: its old entries whose files are still there, and the new ones."""
    found = {}
    for folder in sorted({path.parent for path in files}):
        entries = {name: entry for name, entry in _listed(folder).items() if (folder / name).exists()}
        for path, content in files.items():
            if path.parent == folder:
                digest = hashlib.sha256(as_bytes(content)).hexdigest()
                entries[path.name] = {"of": _of(of, folder), "sha256": digest}
        text = json.dumps({"files": dict(sorted(entries.items()))}, indent=1, ensure_ascii=False)
        found[folder / LIST] = f"{text}\n"
    return found


def _of(of: Path | str | None, folder: Path) -> str | None:
    """What a list says that a file is of: a path from its folder on, or the word."""
    if not isinstance(of, Path):
        return of
    try:
        return Path(os.path.relpath(of.resolve(), folder.resolve())).as_posix()
    except ValueError:  # another drive
        return of.resolve().as_posix()


def _listed(folder: Path) -> dict[str, Mapping[str, Any]]:
    """File -> entry of the folder's list; nothing where it has none that can be read."""
    try:
        entries = _tree((folder / LIST).read_bytes()).get("files")
    except OSError:
        return {}
    return {k: v for k, v in entries.items() if isinstance(v, dict)} if isinstance(entries, dict) else {}


def _tree(data: bytes) -> dict[str, Any]:
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return tree if isinstance(tree, dict) else {}
