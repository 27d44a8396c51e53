"""The rules that input files keep: what each asks, why, what to do, an example. One TOML a family.

P0 the file, P1 the form of a value, P2 requirement, flight and effects, P3 the unit's errors, P4 benches and
tests, P5 the plan, P6 flight files, P7 recordings and dwell tables, P8 histories, P9 plans.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path


@dataclass(frozen=True)
class Rule:
    """One rule: `says` what it asks, `why`, and the `remedy`; `wrong` and `right` show it in a spec."""

    code: str
    says: str
    why: str
    remedy: str
    wrong: str = ""
    right: str = ""


@cache
def rules() -> dict[str, Rule]:
    """code -> rule, in the order of the codes; read when first asked."""
    import tomllib

    found: dict[str, Rule] = {}
    for part in (Path(__file__).parent / "rules").glob("*.toml"):
        tables = tomllib.loads(part.read_text(encoding="utf-8"))
        found |= {code: Rule(code, **table) for code, table in tables.items()}
    return dict(sorted(found.items()))


def remedy(code: str) -> str:
    """What to do about a fault, by its rule; nothing for a code that is none."""
    return rules()[code].remedy if code in rules() else ""
