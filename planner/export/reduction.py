"""The account of a reduction as JSON: every row, every stretch without one, every count and its reason."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from planner import __version__
from planner.errors import InputError
from planner.export.json_figures import json_text
from planner.recordings.allan import AllanResult
from planner.recordings.clocks import Clock
from planner.recordings.reduction import Reduction
from planner.units import from_si

_UNITS = {"gyro": "deg/s", "acc": "g"}
# IEEE Std 952, annex C: by its slope each term has the channel's unit times a power of the second
_PER = {"quantisation": "*s", "white_noise": "*sqrt(s)", "bias_instability": "", "random_walk": "/sqrt(s)"}


def account_text(reduction: Reduction) -> str:
    """The account's file. Same reduction, same bytes."""
    return json_text(reduction_document(reduction))


def refuse_overwriting(written: Sequence[Path], read: Sequence[Path]) -> None:
    """Raises InputError when a file that is to be written is one of those that are read."""
    sources = {path.resolve() for path in read}
    for path in written:
        if path.resolve() in sources:
            raise InputError(f"{path} is one of the files that are read; write the dwell table elsewhere")


def reduction_document(reduction: Reduction) -> dict[str, Any]:
    """Plain values for JSON; times in s, Allan deviations and noise terms in deg/s and g."""
    return {
        "planner": __version__,
        "source": reduction.table.source,
        "rows": [
            {
                "unit": row.unit,
                "run": row.run,
                "step": row.label,
                "start_s": row.start,
                "end_s": row.end,
                "samples": row.samples,
                "left_out": dict(row.left_out),
            }
            for row in reduction.rows
        ],
        "stretches_left_out": [
            {
                "unit": part.unit,
                "run": part.run,
                "kind": part.kind,
                "start_s": part.start,
                "end_s": part.end,
                "samples": part.samples,
                "reason": part.reason,
            }
            for part in reduction.left_out
        ],
        "files": {
            name: {
                "rate_hz": reduction.rates_hz[name],
                "samples": dict(counts),
                **_clock(reduction.clocks.get(name)),
            }
            for name, counts in reduction.counts.items()
        },
        "motions": 0 if reduction.motions is None else len(reduction.motions),
        "record_s": reduction.record,
        "record_is_lower_bound": reduction.record_is_bound,
        "spec_snippet": reduction.snippet,
        "allan": [_allan(one) for one in reduction.allan],
        "notes": list(reduction.table.notes),
    }


def _clock(clock: Clock | None) -> dict[str, Any]:
    """How a clock jitters; nothing of one that does not."""
    if clock is None:
        return {}
    return {
        "jitter": {"usual_step_s": clock.usual, "deviation_s": clock.deviation, "taken_over_s": clock.step}
    }


def _allan(one: AllanResult) -> dict[str, Any]:
    unit = _UNITS[one.channel.partition("_")[0]]

    def shown(values: Sequence[float]) -> list[float]:
        return [from_si(float(x), unit) for x in values]

    return {
        "channel": one.channel,
        "unit": unit,
        "tau_s": [float(tau) for tau in one.tau],
        "deviation": shown(one.deviation.tolist()),
        "low": shown(one.low.tolist()),
        "high": shown(one.high.tolist()),
        "terms": [
            {
                "name": term.name,
                "value": from_si(term.value, unit),
                "ci95": shown([term.low, term.high]),
                "unit": f"{unit}{_PER.get(term.name, '/s')}",
                "seen": term.seen,
            }
            for term in one.terms
        ],
        "best_time_s": one.best_time,
        "best_time_is_lower_bound": one.at_end,
    }
