"""Reading back the files that planner wrote."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planner.errors import Fault, InputError, unusable_file
from planner.export.header import check_seal
from planner.nouns.given_files import PLAN

REQUIRED = ("planner", "spec", "requirements", "allowances", "tests", "steps", "time_s", "bound_s", "gap")


def read_plan(path: Path) -> dict[str, Any]:
    """plan.json as a tree of plain values; a folder stands for the plan.json in it.

    Raises InputError for a file that cannot be read, is not JSON, or is no plan.
    """
    return {**_plan(_file(path)), "path": str(path)}


def read_sealed_plan(path: Path) -> dict[str, Any]:
    """plan.json for those who act on it: as `read_plan`, and exactly as planner wrote it.

    Raises InputError also when the content is not that of its `plan_sha256`.
    """
    document = _plan(_file(path))
    check_seal(document, str(_file(path)))
    return document


def _file(path: Path) -> Path:
    return path / "plan.json" if path.is_dir() else path


def _plan(file: Path) -> dict[str, Any]:
    return json_tree(file, "is not a plan", REQUIRED, PLAN)


def json_tree(file: Path, fault_said: str, required: Sequence[str], give: str) -> dict[str, Any]:
    """The tree of a JSON file of ours. fault_said: `is not a plan`; give: what the user should have given.

    Raises InputError for a file that cannot be read, is not JSON, or lacks a required key.
    """
    try:
        data = sys.stdin.buffer.read() if str(file) == "-" else file.read_bytes()
        if not data.strip():
            raise unusable_file(file, "is empty", give)
        document = json.loads(data)
    except OSError as error:
        raise unusable_file(file, error, give) from error
    except json.JSONDecodeError as error:
        fault = Fault(str(file), error.lineno, error.colno, "", f"not JSON: {error.msg}", "P901")
        raise InputError(f"{file} {fault_said}", [fault]) from error
    except UnicodeDecodeError as error:
        raise unusable_file(file, f"{fault_said}: it is no text", give) from error
    except (RecursionError, ValueError) as error:
        raise InputError(f"{file} {fault_said}: {error}") from error
    missing = [key for key in required if not isinstance(document, dict) or key not in document]
    if missing:
        raise InputError(f"{file} {fault_said}: {', '.join(missing)} missing; give {give}")
    return dict(document)
