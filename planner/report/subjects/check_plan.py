"""The check of a batch, planned: what to record so that units are decided, and when it may stop."""

from __future__ import annotations

from collections.abc import Sequence

from planner.fleet.check_plan import Check, CheckTest
from planner.fleet.judge import ErrorRates
from planner.report.blocks import Items, Report, Table, existing, facts, section, table
from planner.report.numbers import counted, digits, hours, percent


def checks_report(checks: Sequence[Check], rates: ErrorRates, name: str, notes: Sequence[str]) -> Report:
    """The cheapest check, the others beside it, and how to use them."""
    best = checks[0]
    return Report(
        kind="A check that decides",
        title=name,
        answer=f"{hours(best.time_s)} h a unit: {_words(best)}",
        sentences=(
            f"It accepts {percent(best.decides)} of the units at {percent(best.load)} of the limit. With "
            f"`--looks {best.looks}` (so many power-ons a temperature at most) it stops after "
            f"{digits(best.expected, 3)} on average.",
        ),
        notes=tuple(notes),
        facts=facts(
            ("load", percent(best.load)),
            ("decided", percent(best.decides)),
            ("good rejected, at most", percent(rates.good_rejected)),
            ("bad accepted, at most", percent(rates.bad_accepted)),
        ),
        sections=existing(
            section("checks", "Checks, the cheapest first", checks_table(checks)),
            section("basis", "How to read this", Items(BASIS)),
        ),
    )


BASIS = (
    "Units of that load are drawn, their residuals about what the plan had left of every term. Hours are of "
    "one unit: install, ramps, soaks, power-ons, remove.",
    "Fewer than three temperatures, or a narrow range, do not show what the temperature table leaves: it is "
    "then counted as planned, which takes room.",
    "With --looks the decisions of all looks together keep the stated rates; the boundaries are exact "
    "for Gaussian estimates. Power-ons of several tests come in turn; all of a temperature count.",
)


def _words(c: Check) -> str:
    """`static (motions 1, 2), 4 power-ons at each of -60, 0, 60 degC`."""
    tests = " and ".join(_test(t) for t in c.tests)
    degc = ", ".join(f"{t:.0f}" for t in c.temperatures_degc)
    where = f"at {degc} degC" if len(c.temperatures_degc) == 1 else f"at each of {degc} degC"
    of = " of either" if len(c.tests) == 2 else " of each" if len(c.tests) > 2 else ""
    return f"{tests}, {counted(c.power_ons, 'power-on')}{of} {where}"


def _test(t: CheckTest) -> str:
    return f"{t.test} (motions {', '.join(str(f + 1) for f in t.faces)})"


def checks_table(checks: Sequence[Check]) -> Table | None:
    """A row per number of temperatures."""
    return table(
        "The cheapest check for each number of temperatures",
        "temperatures | tests and motions | power-ons of each | hours | decided, % | --looks | on average",
        (
            (
                ", ".join(f"{t:.0f}" for t in c.temperatures_degc),
                "; ".join(_test(t) for t in c.tests),
                str(c.power_ons),
                hours(c.time_s),
                f"{100 * c.decides:.1f}",
                str(c.looks),
                digits(c.expected, 3),
            )
            for c in checks
        ),
    )
