"""The spread of an error that no test alone tells, counted again: s = σ √n from all tests together.

σ is the standard error by verify's own least squares over the records: those of the plan's steps where it is
made by hand, else one power-on of every test at the middle of the range; n the fewest repeats of a test that
calibrates the error. s is never less than the run-to-run. The least squares weighs the walk over the days of
the campaign, too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from planner.errors import InputError
from planner.spec.model import Spec
from planner.verify.calibrations import estimators
from planner.verify.chance import chance_of
from planner.verify.draws import unit_of
from planner.verify.findings import Document
from planner.verify.records import Records, records_of
from planner.verify.recount_spread import one_repeat

SAME = 2e-3  # found 1e-4 apart: three modes for a walk over the days there, floors of V of their own


def added_together(
    document: Document, spec: Spec, errors: Collection[str], by_hand: bool
) -> dict[str, float]:
    """Error -> what the records add to its run-to-run, SI: √(n σ² − s_run²); infinite if nothing tells it."""
    if not errors:
        return {}
    sigma = _sigmas(records_of(document if by_hand else {"steps": [*_each_test_once(spec)]}, spec), spec)
    found = {}
    for error in errors:
        n = _fewest(document, error) if by_hand else 1
        sensor, _, effect = error.partition(".")
        run = getattr(spec.unit, sensor)[effect].run_to_run_largest
        found[error] = float(np.sqrt(max(n * sigma.get(error, np.inf) ** 2 - run**2, 0.0)))
    return found


def _fewest(document: Document, error: str) -> int:
    return min(int(n) for t in document["tests"] if error in t["calibrates"] for n in t["repeats"])


def _sigmas(records: Records, spec: Spec) -> dict[str, float]:
    """Error -> its largest standard error, SI, over channels, terms and nodes."""
    chance = chance_of(spec)
    found: dict[str, float] = {}
    try:
        made = estimators(records, unit_of(spec), spec.effects, chance)
    except InputError:  # fewer records than coefficients tell none of them
        return found
    for sensor, several in made.items():
        for e in several:
            error = np.where(e.undetermined, np.inf, e.error)
            for column, sigma in zip(e.model.columns, error.tolist(), strict=True):
                name = f"{sensor}.{column.effect}"
                found[name] = max(found.get(name, 0.0), sigma)
    return found


def _each_test_once(spec: Spec) -> Iterator[Mapping[str, Any]]:
    """One power-on of every test, one after the other, as steps of a plan."""
    clock = 0.0
    for name in spec.tests:
        steps = [*one_repeat(spec, name, clock)]
        yield from steps
        clock = steps[-1]["end_s"]
