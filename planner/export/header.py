"""What every exported file carries: the plan's hash, the spec's hash, the version of the plan's schema.

The plan's hash is the SHA-256 of the plan's canonical JSON: the tree of plan.json without the keys
`plan_sha256` and `$schema`, object keys sorted, no blanks, UTF-8 unescaped, each number as Python's `repr`
writes it (shortest text that reads back the same; RFC 8785 but for the exponent's spelling). So a plan may be
indented or reordered by any JSON tool and keeps its hash, and no figure of it can change unseen.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any

from planner.errors import InputError
from planner.nouns.plan import SCHEMA_VERSION

_OUTSIDE = ("plan_sha256", "$schema")
# In columns, not in `#` lines: every reader of CSV then takes the file as it is.
HEADER_COLUMNS = ("plan_sha256", "spec_sha256", "schema_version")


def plan_sha256(document: Mapping[str, Any]) -> str:
    """The hash of a plan's tree. Raises ValueError for what JSON cannot hold (NaN, half a surrogate pair)."""
    inside = {key: value for key, value in document.items() if key not in _OUTSIDE}
    text = json.dumps(inside, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def sealed(document: Mapping[str, Any]) -> dict[str, Any]:
    """The plan with its schema version and hash, right after the version of planner."""
    body = {**document, "schema_version": SCHEMA_VERSION}
    first = {key: body.pop(key) for key in ("planner", "schema_version")}
    return {**first, "plan_sha256": plan_sha256(first | body), **body}


def check_seal(document: Mapping[str, Any], file: str) -> None:
    """Raises InputError unless the plan is as planner wrote it, in a version of the schema that we know."""
    again = "make it again with `planner plan`"
    if "plan_sha256" not in document:
        raise InputError(f"{file} has no plan_sha256; {again}")
    try:
        found = plan_sha256(document)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file} is not a plan: {error}") from error
    if document["plan_sha256"] != found:
        raise InputError(
            f"{file} was changed after planner wrote it: its plan_sha256 is not that of its content; "
            f"change the spec and {again}"
        )
    if document.get("schema_version") != SCHEMA_VERSION:
        version = document.get("schema_version")
        raise InputError(
            f"{file} has schema_version {version!r}, this planner knows {SCHEMA_VERSION}; {again}"
        )


def header(document: Mapping[str, Any]) -> dict[str, str]:
    """The figures that identify a plan, by the names under which every exported file carries them."""
    return {
        "plan_sha256": str(document["plan_sha256"]),
        "spec_sha256": str(document["spec"]["sha256"]),
        "schema_version": str(document["schema_version"]),
        "planner": str(document["planner"]),
    }


def header_cells(document: Mapping[str, Any]) -> list[str]:
    """The header in the columns HEADER_COLUMNS, the same in every row."""
    return [header(document)[name] for name in HEADER_COLUMNS]


def comment_lines(document: Mapping[str, Any], *more: str) -> Iterator[str]:
    """The header as lines that begin with `#`, for the top of scripts and lists."""
    for name, value in header(document).items():
        yield f"# {name}: {value}"
    for line in more:
        yield f"# {line}"
