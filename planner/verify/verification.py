"""The noun of `planner verify`: recount and flights of one plan, and the verdict on both."""

from __future__ import annotations

from dataclasses import dataclass, field

from planner.verify.linearity import LinearPoint
from planner.verify.outcome import Claim, RequirementOutcome, Verdict
from planner.verify.recount import Recount
from planner.verify.through_files import ThroughFiles
from planner.verify.weak import Weak


@dataclass(frozen=True)
class Verification:
    """Everything that verify found.

    outcomes: every requirement in every family of curves that was flown, family by family
    flown: what the flights are, in words; temperature, curves: which were asked for
    """

    version: str
    name: str
    spec_sha256: str
    plan_sha256: str
    recount: Recount
    outcomes: tuple[RequirementOutcome, ...]
    claims: tuple[Claim, ...]
    weak: tuple[Weak, ...]
    linear: tuple[LinearPoint, ...]
    flights: int
    wanted: int
    stopped: bool
    seed: int
    temperature: str
    curves: str
    flown: str
    confidence: float
    notes: tuple[str, ...]
    files: ThroughFiles = field(default_factory=ThroughFiles)

    @property
    def families(self) -> tuple[str, ...]:
        """Those that were flown."""
        return tuple(dict.fromkeys(o.family for o in self.outcomes))

    @property
    def worst(self) -> tuple[RequirementOutcome, ...]:
        """Of every requirement the family in which it stands worst."""
        found: dict[int, RequirementOutcome] = {}
        for o in self.outcomes:
            found[o.index] = max(found.get(o.index, o), o, key=_badness)
        return tuple(found[i] for i in sorted(found))

    @property
    def verdict(self) -> Verdict:
        """Broken if the recount, the way through files or any requirement fails; kept if all are kept."""
        verdicts = {o.verdict for o in self.outcomes}
        if not self.recount.ok or not self.files.ok or "broken" in verdicts:
            return "broken"
        return "undecided" if not verdicts or "undecided" in verdicts else "kept"


def _badness(o: RequirementOutcome) -> tuple[int, float]:
    """Broken before undecided before kept; then what is nearest to the limit."""
    return ("kept", "undecided", "broken").index(o.verdict), o.at_promise / o.limit
