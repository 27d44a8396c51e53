"""A look at a recording as JSON."""

from __future__ import annotations

from typing import Any

from planner import __version__
from planner.recordings.look import Look, Looked
from planner.recordings.samples import READ


def look_document(seen: Look) -> dict[str, Any]:
    """Plain values for JSON: times in s, gravity in g."""
    return {
        "planner": __version__,
        "source": str(seen.path),
        "map": seen.map_text,
        "map_guessed": seen.guessed,
        "power_ons": [_power_on(one) for one in seen.power_ons],
        "power_ons_not_shown": seen.more,
    }


def _power_on(one: Looked) -> dict[str, Any]:
    clock = one.clock
    return {
        "unit": one.file.unit,
        "run": one.file.run,
        "samples": one.file.account.counts[READ],
        "seconds": one.seconds,
        "rate_hz": one.file.rate,
        "clock": None
        if clock is None
        else {"usual_step_s": clock.usual, "deviation_s": clock.deviation, "jitters": clock.jitters},
        "rests": [
            {"start_s": rest.row.start, "end_s": rest.row.end, "samples": rest.row.n_samples}
            for rest in one.rests
        ],
        "turns": one.turns,
        "gravity_g": list(one.gravity),
        "left_out_s": one.left_out,
        "gaps": [{"start_s": gap.start, "seconds": gap.seconds} for gap in one.gaps],
        "findings": list(one.findings),
    }
