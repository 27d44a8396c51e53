"""A plan in one of the export formats: which format, which dialect, and where its files go."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from planner import catalog
from planner.errors import InputError
from planner.export.documents import read_sealed_plan
from planner.protocols import Exported, ExportFormat, ExportOptions
from planner.spec.places import did_you_mean


def format_of(name: str, options: ExportOptions) -> tuple[ExportFormat, ExportOptions]:
    """The format by its name, with its dialect chosen. Raises InputError for what we do not know."""
    known = catalog.exports()
    if name not in known:
        raise InputError(f"unknown format {name!r}{did_you_mean(name, known)}")
    form: ExportFormat = known[name]
    if options.dialect is not None and options.dialect not in form.dialects:
        if not form.dialects:
            raise InputError(f"{name} has no dialects; leave --dialect out")
        raise InputError(f"unknown dialect {options.dialect!r}{did_you_mean(options.dialect, form.dialects)}")
    return form, replace(options, dialect=options.dialect or next(iter(form.dialects), None))


@contextmanager
def collector_paused() -> Iterator[None]:
    """No garbage collection: a long plan is millions of live objects; searching them doubles the time."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def exported_file(path: Path, name: str, options: ExportOptions) -> Exported:
    """The plan at `path` in the format called `name`.

    Raises InputError for an unknown format or dialect, a plan that is not as planner wrote it, or one that
    asks its benches for more than they can do.
    """
    form, options = format_of(name, options)
    with collector_paused():
        return form.files(read_sealed_plan(path), options)


def places(files: Mapping[str, str | bytes], out: Path) -> dict[Path, str | bytes]:
    """Where the files go: into `out` if that is a folder or has no suffix; else `out` is the first file.

    The other files then lie beside it under their own names. Raises InputError when they would collide.
    """
    names = list(files)
    if out.is_dir() or (not out.exists() and not out.suffix):
        return {out / name: files[name] for name in names}
    if out.name in names[1:]:
        raise InputError(f"{out.name} is the name of another file of this export; choose another")
    beside = out.parent if out.is_file() or not out.exists() else None
    rest = {} if beside is None else {beside / name: files[name] for name in names[1:]}
    return {out: files[names[0]], **rest}
