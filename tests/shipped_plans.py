"""Plans of the shipped specs, made once a test run and shared by its workers.

The first worker that asks for a plan makes it behind a lock of the operating system, which falls with its
owner; another that asks for it makes the next one meanwhile, and then reads what the first wrote. The folder
belongs to one run of pytest, and a file's name holds the hash of every file of planner and of every shipped
file, so no plan of other code can be met.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import pickle
from functools import cache
from pathlib import Path
from typing import Any

from planner.export.json import plan_text
from planner.pipelines import planning as pipeline
from planner.pipelines.planned import Planned
from tests.specs import ROOT, SHIPPED, shipped

NAMES = sorted(path.stem for path in SHIPPED.glob("*.yaml"))
LONG = ["published_one_bench"]  # thousands of steps, all of kinds that published_two_benches has
SAMPLE = [name for name in NAMES if name not in LONG]
FOLDER = "PLANNER_TESTS_SHIPPED_PLANS"  # in the environment: workers and what they start know it


def share_in(folder: Path) -> None:
    """Keep the plans of this run in a folder that all its workers see."""
    folder.mkdir(exist_ok=True)
    os.environ[FOLDER] = str(folder)


@cache
def shipped_plan(name: str) -> Planned:
    """What `planner plan` makes of a shipped spec or the `starter`, its genetic algorithm included."""
    folder = os.environ.get(FOLDER)
    if folder is None:  # benchmarks have no workers to share with
        return made(name)
    others = (n for n in NAMES if not kept_in(folder, n).exists())
    while not there(folder, name):
        other = next(others, None)
        there(folder, other or name, wait=other is None)
    planned = pickle.loads(kept_in(folder, name).read_bytes())
    assert isinstance(planned, Planned)
    return planned


def there(folder: str, name: str, *, wait: bool = False) -> bool:
    """Whether a plan is kept, made here if it was not; False where another worker is at it."""
    kept = kept_in(folder, name)
    with kept.with_suffix(".lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            return False
        if not kept.exists():
            part = kept.with_suffix(".part")
            part.write_bytes(pickle.dumps(made(name)))
            part.replace(kept)
    return True


def kept_in(folder: str, name: str) -> Path:
    """The file of a plan."""
    return Path(folder) / f"{name}-{sources()}.pickle"


@cache
def shipped_document(name: str) -> dict[str, Any]:
    """The same as plan.json holds it; copy it before a change."""
    document: dict[str, Any] = json.loads(plan_text(shipped_plan(name).plan))
    return document


def made(name: str) -> Planned:
    """The plan of a shipped spec, planned here and now."""
    return pipeline.plan(shipped(name), lambda message: None)


@cache
def sources() -> str:
    """Hash of planner's sources and of the shipped specs with their flights."""
    digest = hashlib.sha256()
    ours = [p for p in (ROOT / "planner").rglob("*") if p.is_file() and p.suffix != ".pyc"]
    for path in sorted([*ours, *(p for p in SHIPPED.rglob("*") if p.is_file())]):
        digest.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes())
    return digest.hexdigest()[:32]
