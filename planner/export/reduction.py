"""The account of a reduction as JSON: every row, every stretch without one, every count and its reason."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from planner import __version__
from planner.errors import InputError, unusable_file
from planner.export.json_figures import json_text
from planner.nouns.calibration import RandomCharacteristic
from planner.nouns.given_files import REDUCTION_ACCOUNT
from planner.nouns.sensor import ErrorName
from planner.recordings.allan import AllanResult
from planner.recordings.clocks import Clock
from planner.recordings.coloured_noise import NoiseOfSamples
from planner.recordings.reduction import Reduction
from planner.units import from_si, unit_factor

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
                "step": row.step,
                "start_s": row.start,
                "end_s": row.end,
                "samples": row.n_samples,
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
        "noise": [_noise(one) for one in reduction.noise],
        "notes": list(reduction.table.notes),
    }


def noise_of_account(path: Path) -> list[RandomCharacteristic]:
    """White and coloured noise of the samples that a reduction's account tells, for random.json.

    Raises InputError for a file that is none.
    """
    try:
        told = json.loads(path.read_bytes())["noise"]
        return [one for channel in told for one in _characteristics(channel)]
    except OSError as error:
        raise unusable_file(path, error, REDUCTION_ACCOUNT) from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path} is no account of a reduction with noise in it: {error!r}") from error


def _characteristics(told: Mapping[str, Any]) -> Iterator[RandomCharacteristic]:
    part, _, axis = told["channel"].partition("_")
    error = ErrorName("accelerometer.bias" if part == "acc" else "gyro.bias")
    factor = unit_factor(told["unit"])[0]
    density = f"{told['unit']} s^(1/2)"
    for kind, key, unit, scale in (
        ("white_density_of_samples", "white_density", density, factor),
        ("coloured", "coloured", told["unit"], factor),
        ("coloured_correlation_time", "correlation_time_s", "s", 1.0),
    ):
        if told[key] is not None:
            value, (low, high) = told[key]["value"], told[key]["ci95"]
            yield RandomCharacteristic(
                kind, error, axis, unit, value * scale, low * scale, high * scale, float("nan"), True
            )


def _clock(clock: Clock | None) -> dict[str, Any]:
    """How a clock jitters; nothing of one that does not."""
    if clock is None:
        return {}
    return {
        "jitter": {"usual_step_s": clock.usual, "deviation_s": clock.deviation, "taken_over_s": clock.step}
    }


def _noise(one: NoiseOfSamples) -> dict[str, Any]:
    """White density in unit·√s, sigma of the coloured part in the unit, its correlation time in s."""
    unit = _UNITS[one.channel.partition("_")[0]]

    def shown(ends: tuple[float, float, float] | None) -> dict[str, Any] | None:
        if ends is None:
            return None
        value, low, high = (from_si(x, unit) for x in ends)
        return {"value": value, "ci95": [low, high]}

    time = None if one.time is None else {"value": one.time[0], "ci95": list(one.time[1:])}
    return {
        "channel": one.channel,
        "unit": unit,
        "white_density": shown(one.white),
        "coloured": shown(one.sigma),
        "correlation_time_s": time,
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
