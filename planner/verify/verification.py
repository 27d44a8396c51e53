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

    flown: what the flights are, in words; where: `flight` or `range`, at which temperatures
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
    where: str
    flown: str
    confidence: float
    notes: tuple[str, ...]
    files: ThroughFiles = field(default_factory=ThroughFiles)

    @property
    def verdict(self) -> Verdict:
        """Broken if the recount, the way through files or any requirement fails; kept if all are kept."""
        verdicts = {o.verdict for o in self.outcomes}
        if not self.recount.ok or not self.files.ok or "broken" in verdicts:
            return "broken"
        return "undecided" if not verdicts or "undecided" in verdicts else "kept"
