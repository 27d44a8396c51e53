"""A diagnosis in sentences and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from planner import catalog
from planner.nouns.diagnosed_spreads import BUDGETED, Assumption
from planner.nouns.diagnosis import (
    LEAST_P,
    Diagnosis,
    FoundEffect,
    FoundTerm,
    NavigationCost,
    NextMeasurement,
    ReferenceSuspect,
    ResidualChange,
    UnitDiagnosis,
    Unknown,
)
from planner.nouns.sensor import short
from planner.report.blocks import Table, table
from planner.report.numbers import NOTHING, SPACE, digits, display_unit, hours, in_unit, quantity

MOST_DIGITS = 7
MILLI_G = 0.1  # m/s²: smaller residuals are read more easily in mg
HELD_OUT = {
    "runs": "on power-ons that the fit has not seen",
    "branches": "on branches of the temperature that the fit has not seen",
    "blocks": "on blocks of time left out of the fit, which flatters",
    "none": "on the rows that were fitted",
}
VARIABLES = {
    "temperature": "temperature",
    "temperature_rate": "rate of temperature",
    "time_on": "time since power-on",
    "day": "day",
    "time_of_day": "time of day",
    "rate": "rate",
    "specific_force": "specific force",
    "orientation": "orientation",
    "time_on_and_rate": "time since power-on and rate, as a scale factor does",
    "time_on_and_specific_force": "time since power-on and specific force, as a scale factor does",
    "day_and_rate": "day and rate, as a scale factor does",
    "day_and_specific_force": "day and specific force, as a scale factor does",
    "time_on_and_temperature": "time since power-on and temperature",
    "rate_and_specific_force": "rate and specific force, as a scale factor does",
    "temperature_and_rate": "temperature and rate",
    "bench": "bench",
    "unexplained": "no variable of the table",
}


def plain_name(effect: str) -> str:
    """What people call an effect: `g-sensitivity`."""
    known = catalog.effects()
    return known[effect].title if effect in known else effect.replace("_", " ")


def headed(effect: str) -> str:
    """The same at the head of a sentence."""
    name = plain_name(effect)
    return name[:1].upper() + name[1:]


def varies_with(name: str) -> str:
    """The variable of an unnamed part, in words."""
    return VARIABLES.get(name, name.replace("_", " "))


def headline(found: UnitDiagnosis) -> str:
    """The verdict in a few words."""
    if found.verdict == "clean":
        looked, unseen = _looked_for(found)
        return "Nothing is missing" + ("" if looked > unseen else ", as far as these data can tell")
    if found.verdict == "untestable":
        return "These data cannot tell"
    names = joined(list(dict.fromkeys(plain_name(e.effect) for e in found.effects)))
    wrong = joined([s.hypothesis.replace("_", " ") for s in found.faults])
    if not found.effects and wrong:
        return f"Reference suspect: {wrong}" + (", and something without a name" if found.unknown else "")
    if wrong:
        names = f"{names}; reference suspect: {wrong}"
    if not found.effects:
        return "Something is missing that has no name here"
    return f"Missing: {names}" + (", and something without a name" if found.unknown else "")


def sentence(found: UnitDiagnosis) -> str:
    """The verdict in one sentence."""
    on: dict[str, list[str]] = {}
    for e in found.effects:
        on.setdefault(e.effect, []).extend(short(c) for c in e.channels)
    named = joined([f"{plain_name(effect)} ({', '.join(channels)})" for effect, channels in on.items()])
    rest = joined([f"{name} ({', '.join(channels)})" for name, channels in _unnamed(found).items()])
    if found.verdict == "clean":
        return _clean(found)
    if found.verdict == "untestable":
        return "No channel has the readings and references that a test needs."
    if not found.effects and found.faults:
        wrong = joined([s.hypothesis.replace("_", " ") for s in found.faults])
        units = joined(list(dict.fromkeys(of_the_unit(s) for s in found.faults if s.alias)))
        text = "The bench explains what the declared model leaves"
        text += f": {wrong}; no record here tells it from {units}" if units else f", not the unit: {wrong}"
        return f"{text}; something that varies with {rest} is left." if rest else f"{text}."
    if not found.effects:
        return (
            f"It varies with {rest}; no effect of the library explains it."
            if rest
            else "No effect explains it."
        )
    text = f"The declared model lacks {named}"
    if rest:
        return f"{text}; something that varies with {rest} is left and has no name."
    return f"{text}; with it in the model nothing else stands out."


def of_the_unit(s: ReferenceSuspect) -> str:
    """What a unit would have itself, that no record tells from a reference that is off."""
    return f"a common {plain_name(s.alias)} of the {s.channels[0].split('_')[0]}s"


def _unnamed(found: UnitDiagnosis) -> dict[str, list[str]]:
    """Variable, in words -> the channels on which something without a name varies with it."""
    on: dict[str, list[str]] = {}
    for u in found.unknown:
        on.setdefault(varies_with(u.varies_with), []).extend(map(short, u.channels))
    return on


def unnamed(parts: Sequence[Unknown]) -> str:
    """Channels of what has no name with chance and strength: `gyro_x (p < 0.001, 29.3 σ)`."""
    return joined(
        [
            f"{', '.join(map(short, u.channels))} (p {compared(u.p_value)}, {digits(u.strength, 3)}{SPACE}σ)"
            for u in parts
        ]
    )


def _looked_for(found: UnitDiagnosis) -> tuple[int, int]:
    """How many undeclared effects the data can show on some channel, and how many on none."""
    looked = {n.effect for n in found.not_found}
    return len(looked), len({u.effect for u in found.untestable} - looked)


def _clean(found: UnitDiagnosis) -> str:
    looked, unseen = _looked_for(found)
    effects = "1 undeclared effect" if looked == 1 else f"{looked} undeclared effects"
    bench = joined([s.hypothesis.replace("_", " ") for s in found.reference_suspects])
    noise = f"noise and a bench as accurate as the spec says ({bench})" if bench else "noise"
    text = (
        f"What the declared model leaves is {noise}: of the {effects} that these data can show none stands "
        "out, nor does anything without a name"
    )
    sensors = {n.sensor for n in found.not_found}
    if len(sensors) == 1:
        text += f"; only the {next(iter(sensors))}s could be judged"
    return f"{text}; {unseen} effects cannot be seen in them." if unseen else f"{text}."


def joined(parts: Sequence[str]) -> str:
    """`a, b and c`."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else list(parts))


# ---------------------------------------------------------------- tables


def found_table(found: Sequence[FoundEffect]) -> Table | None:
    """Every coefficient of every found effect."""
    return table(
        "What the declared model lacks; p is family-wise, over everything looked for",
        "effect | channel | term | value | 95 % interval | unit | p | strength, σ",
        (row for effect in found for row in _found_rows(effect)),
        wide=("p", "strength, σ"),
    )


def curve_table(curves: Sequence[FoundEffect]) -> Table | None:
    """What was measured of something without a name, node by node, beside zero where it was left out."""
    return table(
        "Measured over it, with what is declared; `planner update` declares it under its name",
        "curve | channel | term | value | 95 % interval | unit | p | strength, σ",
        (row for curve in curves for row in _found_rows(curve)),
        wide=("p", "strength, σ"),
    )


def _found_rows(effect: FoundEffect) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for i, t in enumerate(effect.terms):
        first = i == 0
        rows.append(
            (
                plain_name(effect.effect) if first else "",
                f"all {effect.sensor}s" if t.channel == "all" else short(t.channel),
                t.name.replace("_", " "),
                *_value(t),
                chance(effect.p_value) if first else "",
                digits(effect.strength, 3) if first else "",
            )
        )
    return rows


def _value(t: FoundTerm) -> tuple[str, str, str]:
    """Value, interval and unit, with as many digits as the interval leaves meaning to."""
    unit = t.unit if t.parameter else display_unit(t.unit)
    low, value, high = (x / t.scale if t.parameter else in_unit(x, t.unit) for x in (t.low, t.value, t.high))
    size, half = max(abs(low), abs(value), abs(high)), (high - low) / 2.0
    most = 3
    if math.isfinite(size) and 0.0 < half < size:
        most = min(MOST_DIGITS, max(most, 2 + math.floor(math.log10(size)) - math.floor(math.log10(half))))
    return digits(value, most), f"{digits(low, most)} … {digits(high, most)}", unit


def compared(p: float) -> str:
    """`= 0.004` or `< 0.001`."""
    return chance(p) if p < LEAST_P else f"= {chance(p)}"


def chance(p: float) -> str:
    """A family-wise p. The sign flips are a thousand, so that below one in a thousand it is extrapolated."""
    return f"<{SPACE}{digits(LEAST_P)}" if p < LEAST_P else digits(p, 2)


def residual_table(diagnosis: Diagnosis) -> Table | None:
    """Before and after of every channel."""
    return table(
        f"Residual, root mean square, {where_held_out(diagnosis)}; in σ: within a run, 1 is noise alone",
        "channel | before (95 %) | after (95 %) | noise floor | within a run | its floor | in σ | unit",
        map(_residual_row, diagnosis.residual),
        wide=("noise floor", "within a run", "its floor"),
    )


def where_held_out(diagnosis: Diagnosis) -> str:
    """On which rows the residuals are, plainly; several ways where the channels differ."""
    ways = dict.fromkeys(HELD_OUT[r.split] for r in diagnosis.residual)
    return joined(list(ways)) if ways else HELD_OUT["runs"]


def _residual_row(r: ResidualChange) -> tuple[str, ...]:
    unit = "mg" if r.unit == "g" and r.before < MILLI_G else r.unit

    def shown(x: float) -> str:
        return digits(in_unit(x, unit), 3)

    return (
        short(r.channel),
        f"{shown(r.before)} ({_interval(r.before_low, r.before_high, unit)})",
        f"{shown(r.after)} ({_interval(r.after_low, r.after_high, unit)})",
        shown(r.noise_floor),
        _arrow(shown(r.within_before), shown(r.within_after)),
        shown(r.noise_floor_within),
        _arrow(digits(r.sigma_before, 3), digits(r.sigma_after, 3)),
        unit,
    )


def _arrow(before: str, after: str) -> str:
    return before if before == after else f"{before}{SPACE}→{SPACE}{after}"


def _interval(low: float, high: float, unit: str) -> str:
    return f"{digits(in_unit(low, unit), 2)}{SPACE}…{SPACE}{digits(in_unit(high, unit), 2)}"


def how_held_out(diagnosis: Diagnosis) -> tuple[str, ...]:
    """How the residuals were held out: one sentence for all channels that share it."""
    groups: dict[str, list[str]] = {}
    for r in diagnosis.residual:
        groups.setdefault(r.how, []).append(short(r.channel))
    whole = len(groups) == 1
    return tuple(f"{'All channels' if whole else ', '.join(c)}: {how}." for how, c in groups.items())


def navigation_table(costs: Sequence[NavigationCost]) -> Table | None:
    """What it means in flight."""
    return table(
        "Navigation error from what was found",
        "requirement | nobody compensates | as the declared calibration leaves it | compensated "
        "| limit | unit",
        (
            (
                c.error.replace("_", " "),
                *(length(x, c, "") for x in (c.before, c.as_calibrated, c.after, c.limit)),
                c.unit,
            )
            for c in costs
        ),
    )


def length(si: float, cost: NavigationCost, unit: str | None = None) -> str:
    """An error of a requirement with its unit; what is a millionth of the limit is rounding, and 0."""
    size = 0.0 if abs(si) < 1e-6 * abs(cost.limit) else si
    return digits(in_unit(size, cost.unit), 3) if unit == "" else quantity(size, cost.unit, 3)


def rival_name(rival: str) -> str:
    """An effect's name, or that the rival is something that goes with a variable."""
    return plain_name(rival) if rival in catalog.effects() else f"anything over {varies_with(rival)}"


def rivals_table(found: Sequence[FoundEffect]) -> Table | None:
    """Effects that the data cannot tell from those found."""
    return table(
        "Rivals that these data do not refuse",
        "found | on | rival | separated by, σ",
        (
            (
                plain_name(e.effect),
                ", ".join(map(short, e.channels)),
                rival_name(r.effect),
                digits(r.separated_by, 2),
            )
            for e in found
            for r in e.rivals
        ),
    )


def next_table(wanted: Sequence[NextMeasurement]) -> Table | None:
    """What to measure next."""
    return table(
        "What would tell rivals apart best per hour",
        "to tell | bench | do | separation, σ | hours",
        (
            (
                " or ".join(map(plain_name, m.separates)),
                m.bench.replace("_", " "),
                in_words(m),
                digits(m.separation, 2),
                hours(m.time_s),
            )
            for m in wanted
        ),
    )


def in_words(m: NextMeasurement) -> str:
    """A bench run as a sentence."""
    c = m.condition
    repeats = int(float(c.get("repeats", 1)))
    parts = [str(c.get("do", m.test))]
    if "temperature_degc" in c:
        parts.append(f"at {digits(float(c['temperature_degc']), 3)}{SPACE}°C")
    if "temperature_rate_k_min" in c:
        parts.append(f"changing by {digits(float(c['temperature_rate_k_min']), 2)}{SPACE}K/min")
    if "days_later" in c:
        parts.append(f"{digits(float(c['days_later']), 2)} days later")
    parts.append("once" if repeats == 1 else f"{repeats} times")
    return ", ".join(parts)


def assumptions_table(found: UnitDiagnosis) -> Table | None:
    """What the spec assumes beside what the data say."""
    known = (a for a in found.assumptions if a.assumed is not None or math.isfinite(a.measured))
    exceeded = {(b.error, b.part) for b in found.budget_exceeded}
    return table(
        "Spreads that the spec assumes, and what the data say",
        "error | channel | part | assumed | measured | 95 % interval |",
        (_assumption_row(a, (a.error, a.part) in exceeded) for a in known),
    )


def _assumption_row(a: Assumption, exceeded: bool) -> tuple[str, ...]:
    """Of a dozen intervals one lies above its budget by chance: the diagnosis says which is beyond that."""
    told = math.isfinite(a.measured)
    above = a.assumed is not None and a.low > a.assumed
    by_chance = above and a.part in BUDGETED and not exceeded
    odd = above or (a.assumed is not None and a.high < a.assumed)
    return (
        a.error,
        short(a.channel),
        a.part.replace("_", " "),
        NOTHING if a.assumed is None else quantity(a.assumed, a.unit, 3),
        quantity(a.measured, a.unit, 3) if told else "the data cannot tell",
        _interval(a.low, a.high, a.unit) if told else NOTHING,
        "above, as one of so many is by chance" if by_chance else "contradicted" if odd else "",
    )
