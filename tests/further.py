"""Tests that run a sample of their cases, and what the others are: `@pytest.mark.further("seed", [6, 7])`.

The mark stands beside the `parametrize` of the same names. The suite runs the sample; all cases together are
run by benchmarks/study_further_cases.py, which hands every function through `whole`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pytest


def whole(marks: Sequence[pytest.Mark]) -> list[pytest.Mark]:
    """The marks, every sample with its further cases. Raises ValueError where these have no sample."""
    further = {mark.args[0]: list(mark.args[1]) for mark in marks if mark.name == "further"}
    known = {mark.args[0] for mark in marks if mark.name == "parametrize"}
    if further.keys() - known:
        raise ValueError(f"further cases without a sample: {', '.join(sorted(further.keys() - known))}")
    return [completed(mark, further) for mark in marks if mark.name != "further"]


def completed(mark: pytest.Mark, further: Mapping[object, list[object]]) -> pytest.Mark:
    """A `parametrize` with the further cases of its names; any other mark as it is."""
    if mark.name != "parametrize" or mark.args[0] not in further:
        return mark
    names, sample = mark.args
    cases = further[names]
    return pytest.mark.parametrize(names, [*sample, *cases], **mark.kwargs).mark
