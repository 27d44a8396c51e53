"""What comes in the place of a name is as sure as the name was, though its bins by themselves are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.diagnose.channels.prepared import prepared
from planner.diagnose.hypotheses.chance import Flips
from planner.diagnose.hypotheses.found import ALPHA_UNKNOWN, SINGLE, Found, Question, significant
from planner.diagnose.hypotheses.scores import chance_of, score
from planner.diagnose.search.sensor import SIGNS, begin
from planner.diagnose.search.stepwise import _needless
from planner.diagnose.vetoes import unnamed
from tests.diagnose.hall import days, hidden, read
from tests.diagnose.worlds import DECLARED


def _asked(seed: int) -> tuple[Found, Question, int]:
    """A gyro's squared sensitivity at a force, believed by its name; all that has one or none is asked."""
    hall = days(seed, 24)
    table = replace(read(hall, seed), acc=None)
    begun = begin(prepared(hidden(table, "gyro", 0, 4.5e-4 * hall.up[:, 1] ** 2)), "gyro", DECLARED)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size=(999, len(begun.cuts)))
    flips = Flips(signs, len(begun.cuts) < SIGNS)
    blocks = range(len(begun.pool.blocks))
    question = Question(
        tuple(blocks[: begun.library]),
        tuple(blocks[begun.library :]),
        flips,
        lambda p, _, b: (p, b),
        lambda *_: None,
    )
    name = next(b for b in blocks if begun.pool.blocks[b].key == ("g_squared_sensitivity", (0,)))
    return Found(begun.pool, [name], []), question, name


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.further("seed", [3, 4])
def test_bins_in_the_place_of_a_sure_name_stay(seed: int) -> None:
    """A name of 7e-9 gave way to eight bins that beat it decisively; they were at 8e-4: nothing was left."""
    found, question, name = _asked(seed)
    alone = found.tried([])
    null = alone.chance(question)
    scores = {g: score(found.pool, [g]) for g in question.generic if 0 in found.axes(g)}
    unsure = [
        g
        for g, s in scores.items()
        if s.log_p < np.log(SINGLE) and not significant(found.pool, g, s, null, ALPHA_UNKNOWN)
    ]
    assert unsure
    for bins in unsure:
        by_itself, instead = found.tried([]), found.tried([name])
        by_itself.unknown = [bins]
        _needless(by_itself, question)
        assert not by_itself.unknown
        instead.stands_for(bins, [name], question)
        instead.library, instead.unknown = [], [bins]
        _needless(instead, question)
        assert instead.unknown == [bins]
        assert instead.stood_for[found.pool.blocks[bins].key] < ALPHA_UNKNOWN


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_where_bins_beat_a_name_they_stand_for_it(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found, question, name = _asked(seed)
    sure = chance_of(found.pool, name, found.share(name), found.chance(question))
    monkeypatch.setattr(unnamed, "_margin", lambda *_: -np.inf)
    unnamed.unname_where_unnamed_wins(found, question)
    assert not found.library
    (bins,) = found.unknown
    assert found.stood_for[found.pool.blocks[bins].key] == pytest.approx(sure)


@pytest.mark.parametrize("seed", [1])
@pytest.mark.further("seed", [2])
def test_bins_that_tell_nothing_go_whatever_they_stand_for(seed: int) -> None:
    found, question, name = _asked(seed)
    scores = {g: score(found.pool, [g]) for g in question.generic if 0 in found.axes(g)}
    nothing = max(scores, key=lambda g: scores[g].log_p)
    found.stands_for(nothing, [name], question)
    found.library, found.unknown = [], [nothing]
    _needless(found, question)
    assert not found.unknown
