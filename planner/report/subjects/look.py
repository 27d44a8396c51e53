"""A recording looked at: what is in it, what is odd, and the map that reads it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from planner.recordings.look import Look, Looked
from planner.recordings.samples import CHANNELS, READ
from planner.report.blocks import (
    Folded,
    Items,
    Picture,
    Report,
    Section,
    Table,
    Text,
    existing,
    facts,
    section,
    table,
)
from planner.report.charts.recording import allan_chart, signals
from planner.report.subjects.reduction import noise_terms
from planner.units import from_si

MOST_GAPS = 12


def look_report(seen: Look) -> Report:
    """The page, and what of it a terminal shows."""
    first = seen.power_ons[0]
    oddities = list(dict.fromkeys(f for one in seen.power_ons for f in one.findings))
    parts: list[Section | None] = [
        section(
            "findings", "What is odd", Items(tuple(oddities)) if oddities else Text("Nothing was found.")
        ),
        *(_power_on(seen, i, one) for i, one in enumerate(seen.power_ons)),
        section("noise", "Noise", *_noise(seen)),
        section("map", "The map that reads it", *_map(seen)),
    ]
    rests = sum(len(one.rests) for one in seen.power_ons)
    power_ons = len(seen.power_ons) + seen.more
    return Report(
        "Look at a recording",
        seen.path.name,
        _answer(seen, rests, power_ons),
        sections=existing(*parts),
        facts=facts(
            ("samples", f"{sum(one.file.account.counts[READ] for one in seen.power_ons)}"),
            ("rate", f"{first.file.rate:.5g} Hz"),
            ("power-ons", str(power_ons)),
            ("rests", str(rests)),
            ("turns between rests", str(sum(one.turns for one in seen.power_ons))),
            ("gravity at rest", _gravity(seen)),
            brief=("samples", "rate", "rests", "gravity at rest"),
        ),
    )


def _answer(seen: Look, rests: int, power_ons: int) -> str:
    seconds = sum(one.seconds for one in seen.power_ons)
    several = f" in {power_ons} power-ons" if power_ons > 1 else ""
    by = "by a guessed map" if seen.guessed else "by its map"
    return f"{seconds:.4g} s{several}, {rests} rest{'s' * (rests != 1)}, read {by}"


def _gravity(seen: Look) -> str:
    values = [g for one in seen.power_ons for g in one.gravity]
    return f"{np.median(values):.4f} g, from {min(values):.4f} to {max(values):.4f}" if values else ""


# ---------------------------------------------------------------- sections


def _power_on(seen: Look, number: int, one: Looked) -> Section | None:
    single = len(seen.power_ons) == 1
    title = "Signals" if single else f"Power-on {one.file.run}: signals"
    alt = f"signals of {seen.path.name} over time, {len(one.rests)} rests shaded"
    return section(
        f"signals-{number + 1}",
        title,
        Picture(
            f"signals{number + 1}", alt, "means of short windows, and their extremes", partial(signals, one)
        ),
        _rests(one),
        Items(tuple(_without(one)), "Without a row") if one.left_out else None,
        Items(tuple(_gaps(one)), "Gaps in time") if one.gaps else None,
    )


def _rests(one: Looked) -> Table | None:
    used = [i for i in range(6) if np.isfinite(one.file.windows.mean[:, i]).any()]
    rows = [
        (
            rest.row.step,
            f"{rest.row.start:.2f}",
            f"{rest.row.duration:.2f}",
            *(_value(float(rest.row.mean[i]), i) for i in used),
            "—" if rest.row.temperature_degc is None else f"{rest.row.temperature_degc:.1f}",
        )
        for rest in one.rests
    ]
    names = [f"{CHANNELS[i]}, {'deg/s' if i < 3 else 'g'}" for i in used]
    titles = " | ".join(["rest", "from, s", "lasts, s", *names, "°C"])
    return table("rests that were found, and their means", titles, rows, most=40)


def _value(value: float, channel: int) -> str:
    return f"{from_si(value, 'deg/s'):.4f}" if channel < 3 else f"{from_si(value, 'g'):.5f}"


def _without(one: Looked) -> Iterator[str]:
    for reason, seconds in sorted(one.left_out.items(), key=lambda item: -item[1]):
        yield f"{seconds:.1f} s: {reason}"


def _gaps(one: Looked) -> Iterator[str]:
    for gap in one.gaps[:MOST_GAPS]:
        yield f"{gap.seconds:.3g} s without samples after {gap.start:.2f} s"
    if len(one.gaps) > MOST_GAPS:
        yield f"and {len(one.gaps) - MOST_GAPS} more"


def _noise(seen: Look) -> Iterator[Picture | Table | Text | None]:
    if not seen.allan:
        yield Text("Nothing rests for 30 s, so there is no Allan deviation.")
        return
    alt = "Allan deviation of the longest rest"
    yield Picture("allan", alt, f"of {seen.noise_place}; bands hold 68 %", partial(allan_chart, seen.allan))
    yield noise_terms(seen.allan)


def _map(seen: Look) -> Iterator[Text | Folded | Items]:
    said = "Guessed; lines that say CHECK are not told by the file." if seen.guessed else "As given."
    yield Text(said)
    yield Items(tuple(line for line in seen.map_text.splitlines() if line.strip()), only="console")
    yield Folded("map.yaml", seen.map_text)
