"""Why a plan is as it is: what binds, what every visit buys, what changes are worth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from planner.nouns.plan_file import PlanWhy, PriceFigures, RequirementFigures, WorthFigures
from planner.report.blocks import Report, Table, Text, existing, section
from planner.report.numbers import NOTHING, digits, hours, percent

SMALL_H = 0.005  # less is not shown in hours


def why_report(plan: PlanWhy) -> Report:
    """What `planner why` says of a plan's tree."""
    return Report(
        kind="Why this plan",
        title=plan.spec.name,
        answer=f"{hours(plan.time_s)} h",
        sentences=tuple(binding(plan)),
        sections=existing(
            section("families", "Families of curves", families_table(plan)),
            section("worth", "What every visit buys", worth_table(plan.worth, plan.requirements)),
            section("prices", "What a change is worth", prices_table(plan.prices)),
            section("of", "Of what", Text(f"Among {plan.proved_of}.") if plan.proved_of else None),
        ),
    )


def binding(plan: PlanWhy) -> Iterator[str]:
    """What binds, requirement by requirement, and what makes most of it."""
    for r in plan.requirements:
        total = sum(abs(share) for share in r.shares.values()) or 1.0
        largest = sorted(r.shares.items(), key=lambda item: -item[1])[:2]
        parts = " and ".join(f"{error} ({percent(share / total)})" for error, share in largest)
        curves = f"; of the curves, {r.family} are the worst" if r.family else ""
        yield (
            f"{r.error}: {digits(r.achieved)} of {digits(r.limit)} {r.unit} is used, "
            f"most of it by {parts}{curves}."
        )


def families_table(plan: PlanWhy) -> Table | None:
    """Families by requirements; the one that binds is marked."""
    if not plan.families:
        return None
    heads = tuple(f"{r.error}, {r.unit}" for r in plan.requirements)
    rows = []
    for name, figures in plan.families.items():
        cells = [
            digits(figures[str(i)]) + (" binds" if r.family == name else "")
            for i, r in enumerate(plan.requirements)
        ]
        rows.append((name, *cells))
    return Table("Promised under every family of temperature curves", ("curves", *heads), tuple(rows))


def worth_table(worth: Sequence[WorthFigures], requirements: Sequence[RequirementFigures]) -> Table | None:
    """Every visit: hours, and the figures without it and with a repeat less or more."""
    if not worth:
        return None
    several = len(requirements) > 1
    heads = [
        f"{words}{f': {r.error}' if several else ''}, {r.unit}"
        for r in requirements
        for words in ("without it", "one repeat less", "one more")
    ]
    rows = [
        (
            w.test,
            digits(w.temperature_degc),
            str(w.repeats),
            hours(w.time_s),
            hours(w.repeat_s),
            *(
                _figure(of, str(i))
                for i in range(len(requirements))
                for of in (w.without, w.one_fewer, w.one_more)
            ),
        )
        for w in worth
    ]
    return Table(
        "Every visit, with all others as they are (– : something that flies would be undetermined)",
        ("test", "°C", "repeats", "h", "h a repeat", *heads),
        tuple(rows),
    )


def _figure(of: Mapping[str, float | None], key: str) -> str:
    value = of.get(key)
    return NOTHING if value is None else digits(value)


def prices_table(prices: Sequence[PriceFigures]) -> Table | None:
    """Hours of every change, the largest saving first."""
    shown = sorted(prices, key=lambda p: p.time_s)
    rows = tuple((p.change, _signed(p.time_s)) for p in shown)
    return Table("Hours that a change adds (+) or saves (−)", ("change", "h"), rows) if rows else None


def _signed(seconds: float) -> str:
    if abs(seconds) / 3600 < SMALL_H:
        return "0"
    return f"{'−' if seconds < 0 else '+'}{abs(seconds) / 3600:.2f}"
