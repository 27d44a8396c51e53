"""A campaign to simulate when there is no plan: every test at a few temperatures, three repeats."""

from __future__ import annotations

from planner.nouns.choices import Campaign, TestVisits
from planner.plan.by_hand import chosen_by_hand, fixed_repeats, temperatures_of
from planner.spec.even_points import even_points
from planner.spec.model import Spec

REPEATS = 3  # the fewest from which a spread can be told with any confidence
POINTS = 5


def default_campaign(spec: Spec) -> Campaign:
    """What the spec fixes, and for the rest three repeats at about five of the candidate temperatures."""
    visits = tuple(_visit(spec, test) for test in spec.tests)
    return Campaign(visits, (), float("nan"), float("nan"), False)


def _visit(spec: Spec, test: str) -> TestVisits:
    chosen = chosen_by_hand(spec, test)
    if chosen is None:
        choice = spec.plan.temperatures
        count = min(choice.candidates, key=lambda n: (abs(n - POINTS), n))
        temperatures: tuple[float, ...] = even_points(*choice.range, count)
    else:
        temperatures = tuple(sorted(temperatures_of(spec, chosen)[0]))
    repeats = fixed_repeats(spec, test)
    each = repeats if isinstance(repeats, tuple) else (repeats or max(REPEATS, spec.plan.repeats.least),)
    each = each * len(temperatures) if len(each) == 1 else each
    return TestVisits(test, temperatures, each)
