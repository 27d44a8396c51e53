"""Tests that hands leave out: with 0 repeats a test is not used, or not at that temperature.

    plan: {fixed: {rates: {repeats: 0}, static: {temperatures: 3, repeats: [2, 0, 3]}}}

Everybody but the rules sees a spec without them, so that no test of the spec is ever made no times.
"""

from __future__ import annotations

from collections.abc import Iterable

from planner.spec.even_points import even_points
from planner.spec.model import Spec, Test
from planner.spec.plan_choice import FixedTest


def is_unused(test: Test, fixed: FixedTest | None) -> bool:
    """Whether hands fix a test at no repeats, or at no temperature."""
    by_hand = fixed or FixedTest()
    repeats = by_hand.repeats if by_hand.repeats is not None else test.repeats
    temperatures = by_hand.temperatures if by_hand.temperatures is not None else test.temperatures
    none = not any(repeats) if isinstance(repeats, tuple) else repeats == 0
    return none or temperatures == 0


def without_unused(spec: Spec) -> Spec:
    """The spec without tests that hands do not use, and without temperatures at which they do not.

    `plan.fixed` goes on naming the former, which is how `unused_tests` knows them.
    """
    fixed = dict(spec.plan.fixed)
    tests = dict(spec.tests)
    for name, test in spec.tests.items():
        by_hand = fixed.get(name)
        if is_unused(test, by_hand):
            fixed[name] = FixedTest(repeats=0)
            del tests[name]
        elif by_hand is not None and isinstance(by_hand.repeats, tuple) and 0 in by_hand.repeats:
            fixed[name] = _visited(spec, test, by_hand, by_hand.repeats)
    if fixed == spec.plan.fixed and len(tests) == len(spec.tests):
        return spec
    plan = spec.plan.model_copy(update={"fixed": fixed})
    return spec.model_copy(update={"tests": tests, "plan": plan})


def _visited(spec: Spec, test: Test, by_hand: FixedTest, repeats: Iterable[int]) -> FixedTest:
    """A hand-made choice without the temperatures that have 0 repeats."""
    chosen = by_hand.temperatures if by_hand.temperatures is not None else test.temperatures
    assert isinstance(chosen, int | tuple)  # "room" has one temperature, and rules ask for as many repeats
    degc = even_points(*spec.plan.temperatures.range, chosen) if isinstance(chosen, int) else chosen
    made = [(t, n) for t, n in zip(degc, repeats, strict=True) if n > 0]
    return by_hand.model_copy(  # validated already: what is read from a file has its unit
        update={"temperatures": tuple(t for t, _ in made), "repeats": tuple(n for _, n in made)}
    )


def unused_tests(spec: Spec) -> tuple[str, ...]:
    """Names of the tests that hands do not use, of a spec as it was loaded."""
    return tuple(name for name in spec.plan.fixed if name not in spec.tests)
