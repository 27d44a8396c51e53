"""Why a plan is as it is: what binds, what every visit buys, what changes are worth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from planner.nouns.plan_file import PlanWhy, PriceFigures, Reason, RequirementFigures, WorthFigures
from planner.report.blocks import Report, Table, Text, existing, section
from planner.report.numbers import NOTHING, digits, hours, percent

SMALL_H = 0.005  # less is not shown in hours


def why_report(plan: PlanWhy) -> Report:
    """What `planner why` says of a plan's tree."""
    return Report(
        kind="Why this plan",
        title=plan.spec.name,
        answer=f"{hours(plan.time_s)} h",
        sentences=(*binding(plan), *_method(plan)),
        sections=existing(
            section("families", "Families of curves", families_table(plan)),
            section("worth", "What every visit buys", worth_table(plan.worth, plan.requirements)),
            section("tests", "What every test takes", None if plan.worth else tests_table(plan)),
            section(
                "repeats", "What asks for the repeats", None if plan.worth else asking_table(plan.reasons)
            ),
            section("prices", "What a change is worth", prices_table([*plan.prices, *limit_prices(plan)])),
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


def _method(plan: PlanWhy) -> Iterator[str]:
    """What a plan that prices no visit can say, and how to have one that does."""
    if plan.worth:
        return
    if plan.method == "published":
        yield (
            "The published method counts the repeats of each error by itself and prices no single record; "
            "with 'rule: {percentile: 95 %}' and 'plan: {method: information}' every visit is priced."
        )
    else:
        yield "The campaign was given by hand, so no visit of it is priced."


def tests_table(plan: PlanWhy) -> Table | None:
    """Hours of every test, and what it serves."""
    rows = [
        (t.test, hours(t.time_s), hours(t.power_on_s), str(sum(t.repeats)), ", ".join(t.calibrates))
        for t in sorted(plan.tests, key=lambda t: -t.time_s)
    ]
    return Table(
        "Hours of every test, the dearest first",
        ("test", "h", "powered, h", "repeats", "calibrates"),
        tuple(rows),
    )


def asking_table(reasons: Sequence[Reason]) -> Table | None:
    """Of every visit the error that needs its repeats most: n ≥ (t·s/d)², d the half-width needed."""
    if not reasons:
        return None
    visits: dict[tuple[str, float], list[Reason]] = {}
    for reason in reasons:
        visits.setdefault((reason.test, reason.temperature_degc), []).append(reason)
    first = [max(of, key=_tightness) for of in visits.values()]
    rows = tuple(
        (
            r.test,
            digits(r.temperature_degc),
            str(r.repeats),
            r.error,
            f"{digits(r.half_width)} of {digits(r.needed_half_width)} {r.unit}",
            r.bound_by,
        )
        for r in first
    )
    heads = (
        "test",
        "°C",
        "repeats",
        "the error that needs them most",
        "half-width reached of needed",
        "set by",
    )
    return Table("What asks for the repeats of every visit", heads, rows)


def _tightness(r: Reason) -> float:
    return r.half_width / r.needed_half_width if r.needed_half_width else 0.0


def limit_prices(plan: PlanWhy) -> Iterator[PriceFigures]:
    """What limits wider by 1 % save at first, where the plan knows it."""
    for index, r in enumerate(plan.requirements):
        rate = plan.hours_per_limit.get(str(index), 0.0)
        if rate and not plan.prices:
            step = 0.01 * r.limit
            change = f"{r.error} {digits(r.limit)} {r.unit}: {digits(step, 2)} {r.unit} wider, about"
            yield PriceFigures(change=change, time_s=-3600.0 * rate * step)


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
