"""A plan with a right seal and wrong content is a clear fault, wherever it is acted on."""

import copy
import random
from functools import partial

import pytest

from planner.bench_run import limits
from planner.bench_run.job import job_from
from planner.catalog import exports
from planner.errors import PlannerError
from planner.protocols import ExportOptions
from tests.bench_run.rig import small_document
from tests.export.samples import resealed

WRONG = [None, 0, -1, 1e308, "x", "", [], {}, True, [1], {"a": 1}, "mon 8", "xxx 99:99", "mon 08:00"]


def places(tree, path=()):
    """Paths of all that stands in a tree, of lists the first few."""
    yield path
    for key in tree if isinstance(tree, dict) else range(min(len(tree), 4)) if isinstance(tree, list) else ():
        yield from places(tree[key], (*path, key))


def spoiled(document: dict, rng: random.Random) -> dict:
    """One thing left out, of another kind, or one too many."""
    document = copy.deepcopy(document)
    *path, last = rng.choice([path for path in places(document) if path])
    holder = document
    for key in path:
        holder = holder[key]
    match rng.choice(["out", "wrong", "wrong", "strange"]):
        case "out":
            del holder[last]
        case "strange" if isinstance(holder, dict):
            holder["strange"] = 1
        case _:
            holder[last] = rng.choice(WRONG)
    return resealed(document)


@pytest.mark.parametrize("seed", [1, 2])
def test_it_is_exported_and_run_or_refused_and_never_breaks(seed):
    rng, refused = random.Random(seed), 0
    for _ in range(25):
        document = spoiled(small_document(), rng)
        acts = [partial(form.files, options=ExportOptions()) for form in exports().values()]
        for act in (*acts, lambda document: limits.check(job_from(document))):
            try:
                act(document)
            except PlannerError:
                refused += 1
    assert refused > 25
