"""A reduction of recordings: what became of each, the noise terms, the best record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from planner.recordings.allan import AllanResult, NoiseTerm
from planner.recordings.reduction import LeftOut, Reduction
from planner.recordings.rest_allan import RECORD_LIMITS_S
from planner.report.blocks import Items, Report, Table, Text, existing, section, table
from planner.units import from_si

_NAMES = {
    "quantisation": "quantisation",
    "white_noise": "random walk",
    "bias_instability": "bias instability",
    "random_walk": "rate random walk",
    "ramp": "ramp",
}
# the customary units of IEEE Std 952; the factor turns the channel's SI unit with seconds into them
_SHOWN = {
    "gyro": {
        "quantisation": ("deg/s", "deg", 1.0),
        "white_noise": ("deg/s", "deg/√h", 60.0),
        "bias_instability": ("deg/s", "deg/h", 3600.0),
        "random_walk": ("deg/s", "deg/h/√h", 3600.0 * 60.0),
        "ramp": ("deg/s", "deg/h/h", 3600.0 * 3600.0),
    },
    "acc": {
        "quantisation": ("m/s^2", "m/s", 1.0),
        "white_noise": ("m/s^2", "m/s/√h", 60.0),
        "bias_instability": ("mg", "mg", 1.0),
        "random_walk": ("mg", "mg/√h", 60.0),
        "ramp": ("mg", "mg/h", 3600.0),
    },
}


def reduction_report(reduction: Reduction) -> Report:
    """What became of the recordings, the noise terms and the recommended record."""
    left_out = tuple(_left_out(reduction.left_out))
    parts = (
        section("recordings", "Recordings", _recordings(reduction), Items(left_out) if left_out else None),
        section("noise", "Noise", noise_terms(reduction.allan)),
        section("record", "The best record", *map(Text, _record(reduction))),
    )
    return Report("Reduction of recordings", "", "", sections=existing(*parts))


def _record(reduction: Reduction) -> Iterator[str]:
    if reduction.snippet is None:
        return
    bound = ", a lower bound: no channel gets worse before" if reduction.record_is_bound else ""
    yield f"best averaging time of one dwell{bound}; in the spec's tests:"
    yield f"    {reduction.snippet}"
    if not reduction.record_is_bound and (reduction.record or 0.0) < RECORD_LIMITS_S[0]:
        yield (
            f"(the noise alone asks for {reduction.record:.2g} s; the temperature rate needs "
            f"{RECORD_LIMITS_S[0]:g} s)"
        )


def _recordings(reduction: Reduction) -> Table | None:
    rows = [
        _recording(reduction, unit, run)
        for unit, run in dict.fromkeys((r.unit, r.run) for r in reduction.rows)
    ]
    return table("recordings", "unit | run | rows | samples used | left out | seconds | degC", rows)


def _recording(reduction: Reduction, unit: str, run: int) -> tuple[str, ...]:
    data = reduction.table
    mine = (data.unit == unit) & (data.run == run)
    rows = [row for row in reduction.rows if (row.unit, row.run) == (unit, run)]
    t = data.temperature_degc[mine]
    return (
        unit,
        str(run),
        str(len(rows)),
        str(sum(row.n_samples for row in rows)),
        str(sum(sum(row.left_out.values()) for row in rows)),
        f"{data.duration[mine].sum():.1f}",
        "—" if "temp_degc" in data.absent else f"{t.min():.1f} … {t.max():.1f}",
    )


def _left_out(left_out: Sequence[LeftOut]) -> Iterator[str]:
    for unit, run, reason in dict.fromkeys((part.unit, part.run, part.reason) for part in left_out):
        these = [part for part in left_out if (part.unit, part.run, part.reason) == (unit, run, reason)]
        yield f"{unit} run {run}: {sum(part.end - part.start for part in these):.1f} s gave no row: {reason}"


def noise_terms(results: Sequence[AllanResult]) -> Table | None:
    """The noise terms that are seen, in customary units."""
    return table(
        "noise by Allan deviation: the terms that are seen",
        "channel | term | value | 95 % | unit | best time, s",
        (
            (one.channel, *_cells(one.channel, term), f"{'≥ ' if one.at_end else ''}{one.best_time:.3g}")
            for one in results
            for term in one.terms
            if term.seen
        ),
    )


def _cells(channel: str, term: NoiseTerm) -> tuple[str, str, str, str]:
    """Name, value, interval and unit of a term."""
    base, shown, factor = _SHOWN[channel.partition("_")[0]][term.name]
    value, low, high = (from_si(x, base) * factor for x in (term.value, term.low, term.high))
    return _NAMES[term.name], f"{value:.3g}", f"{low:.3g} … {high:.3g}", shown
