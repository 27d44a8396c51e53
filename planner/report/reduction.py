"""A reduction on the terminal: what became of each recording, the noise terms, the best record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from planner.learn.allan import AllanResult, NoiseTerm
from planner.learn.reduction import LeftOut, Reduction
from planner.learn.rest_allan import RECORD_LIMITS_S
from planner.units import from_si

if TYPE_CHECKING:
    from rich.console import Console

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


def print_reduction(reduction: Reduction, console: Console) -> None:
    """Print what became of the recordings, the noise terms and the recommended record."""
    _print_recordings(reduction, console)
    _print_left_out(reduction.left_out, console)
    if reduction.allan:
        _print_terms(reduction.allan, console)
    if reduction.snippet is not None:
        bound = ", a lower bound: no channel gets worse before" if reduction.record_is_bound else ""
        console.print(f"best averaging time of one dwell{bound}; in the spec's tests:", markup=False)
        console.print(f"    {reduction.snippet}", markup=False)
        if not reduction.record_is_bound and (reduction.record or 0.0) < RECORD_LIMITS_S[0]:
            console.print(
                f"(the noise alone asks for {reduction.record:.2g} s; the temperature rate needs "
                f"{RECORD_LIMITS_S[0]:g} s)",
                markup=False,
            )


def _print_recordings(reduction: Reduction, console: Console) -> None:
    from rich.table import Table

    table = Table(title="recordings", title_justify="left")
    for name in ("unit", "run", "rows", "samples used", "left out", "seconds", "degC"):
        table.add_column(name, justify="left" if name == "unit" else "right")
    data = reduction.table
    for unit, run in dict.fromkeys((row.unit, row.run) for row in reduction.rows):
        mine = (data.unit == unit) & (data.run == run)
        rows = [row for row in reduction.rows if (row.unit, row.run) == (unit, run)]
        t = data.temperature_degc[mine]
        warmth = "—" if "temp_degc" in data.absent else f"{t.min():.1f} … {t.max():.1f}"
        table.add_row(
            unit,
            str(run),
            str(len(rows)),
            str(sum(row.samples for row in rows)),
            str(sum(sum(row.left_out.values()) for row in rows)),
            f"{data.duration[mine].sum():.1f}",
            warmth,
        )
    console.print(table)


def _print_left_out(left_out: Sequence[LeftOut], console: Console) -> None:
    for unit, run, reason in dict.fromkeys((part.unit, part.run, part.reason) for part in left_out):
        these = [part for part in left_out if (part.unit, part.run, part.reason) == (unit, run, reason)]
        seconds = sum(part.end - part.start for part in these)
        console.print(f"{unit} run {run}: {seconds:.1f} s gave no row: {reason}", markup=False)


def _print_terms(results: Sequence[AllanResult], console: Console) -> None:
    from rich.table import Table

    table = Table(title="noise by Allan deviation: the terms that are seen", title_justify="left")
    for name in ("channel", "term", "value", "95 %", "unit", "best time, s"):
        table.add_column(name, justify="left" if name in ("channel", "term", "unit") else "right")
    for one in results:
        best = f"{'≥ ' if one.at_end else ''}{one.best_time:.3g}"
        for term in (term for term in one.terms if term.seen):
            table.add_row(one.channel, *_cells(one.channel, term), best)
    console.print(table)


def _cells(channel: str, term: NoiseTerm) -> tuple[str, str, str, str]:
    """Name, value, interval and unit of a term."""
    base, shown, factor = _SHOWN[channel.partition("_")[0]][term.name]
    value, low, high = (from_si(x, base) * factor for x in (term.value, term.low, term.high))
    return _NAMES[term.name], f"{value:.3g}", f"{low:.3g} … {high:.3g}", shown
