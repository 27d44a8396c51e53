"""The truth beside simulated data: the unit as it was drawn."""

from __future__ import annotations

import json
from pathlib import Path

from planner.simulate.campaign import Truth
from planner.units import from_si


def truth_path(data: Path) -> Path:
    """`truth.json` in the data's folder; beside the truth of other data, DATA.truth.json."""
    beside = data.parent / "truth.json"
    try:
        whose = json.loads(beside.read_bytes()).get("data")
    except FileNotFoundError:
        return beside
    except (OSError, ValueError, AttributeError, RecursionError):
        whose = None
    return beside if whose == data.name else data.with_name(f"{data.stem}.truth.json")


def truth_text(truth: Truth, data: str = "") -> str:
    """Every coefficient in its display unit; `curve` comes on top of `value`, at `temperature_degc`.

    `references_si`: how far the bench's references are off (rad, relative, K), where they are.
    """
    terms = []
    for t in truth.terms:
        entry: dict[str, object] = {
            "error": t.error,
            "term": t.term,
            "value": from_si(t.value, t.unit),
            "unit": t.unit,
            "hidden": t.hidden,
        }
        if t.nonlinear:
            entry["nonlinear_si"] = dict(t.nonlinear)
        if t.curve is not None and t.temperatures_degc is not None:
            entry["temperature_degc"] = [round(float(x), 6) for x in t.temperatures_degc]
            entry["curve"] = [from_si(float(x), t.unit) for x in t.curve]
        terms.append(entry)
    document: dict[str, object] = {"data": data, "seed": truth.seed, "terms": terms}
    if truth.references:
        document["references_si"] = dict(truth.references)
    return json.dumps(document, indent=1) + "\n"
