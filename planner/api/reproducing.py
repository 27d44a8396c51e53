"""Whether the same spec gives the same plan here: reproduce."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.api.answer import Answer, Row
from planner.api.planning import plan as planned
from planner.errors import InputError
from planner.nouns.progress import Progress, silent

if TYPE_CHECKING:
    from planner.report.blocks import Report

SAME = 1e-6  # relative: other versions of the solvers round otherwise, a campaign does not
_OF_THE_MAKING = ("planner", "plan_sha256", "packages", "path", "$schema", "genetic", "notes")


@dataclass(frozen=True)
class ReproduceAnswer(Answer):
    """A plan and the one that its spec gives here. Rows: what differs, `key`, `then`, `now`.

    packages: of those whose versions differ, (then, now)
    """

    then: Mapping[str, Any]
    now: Mapping[str, Any]

    @cached_property
    def differences(self) -> tuple[tuple[str, Any, Any], ...]:
        """Keys with values that differ by more than SAME; the genetic campaign and notes are left out."""
        keys = [key for key in {**self.then, **self.now} if key not in _OF_THE_MAKING]
        return tuple(d for key in keys for d in _differences(key, self.then.get(key), self.now.get(key)))

    @property
    def same(self) -> bool:
        """Whether it is the same plan."""
        return not self.differences

    @property
    def packages(self) -> dict[str, tuple[str | None, str | None]]:
        """Package -> (then, now) where its version differs; planner itself among them."""
        then, now = (
            {**t.get("packages", {}), "planner": str(t.get("planner"))} for t in (self.then, self.now)
        )
        names = dict.fromkeys([*then, *now])
        return {n: (then.get(n), now.get(n)) for n in names if then.get(n) != now.get(n)}

    def to_dict(self) -> dict[str, Any]:
        """Whether it is the same, what differs, and which packages do."""
        return {
            "same": self.same,
            "identical": self.then.get("plan_sha256") == self.now.get("plan_sha256"),
            "time_s": {"then": self.then["time_s"], "now": self.now["time_s"]},
            "differences": list(self.rows()),
            "packages": {name: {"then": a, "now": b} for name, (a, b) in self.packages.items()},
        }

    def rows(self) -> Sequence[Row]:
        """One row a figure that differs."""
        return [{"key": key, "then": then, "now": now} for key, then, now in self.differences]

    @cached_property
    def reports(self) -> tuple[Report, ...]:
        """The answer, the packages, the first differences."""
        from planner.report.blocks import Report, existing, section, table

        told = "The same plan" if self.same else f"Another plan: {len(self.differences)} figures differ"
        absent = "not there"
        packages = [(name, str(a or absent), str(b or absent)) for name, (a, b) in self.packages.items()]
        changed = [(key, str(a), str(b)) for key, a, b in self.differences[:SHOWN]]
        found = existing(
            section("packages", "Packages", table("Other versions", "package | then | here", packages)),
            section("figures", "Figures", table("What differs", "key | then | here", changed)),
        )
        return (Report("reproduce", "", told, sections=found),)

    @property
    def exit_code(self) -> int:
        """1 when it is another plan."""
        return 0 if self.same else 1


SHOWN = 20


def _differences(key: str, then: Any, now: Any) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(then, Mapping) and isinstance(now, Mapping):
        for name in {**then, **now}:
            yield from _differences(f"{key}.{name}", then.get(name), now.get(name))
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for i, (a, b) in enumerate(zip(then, now, strict=True)):
            yield from _differences(f"{key}[{i}]", a, b)
    elif not _same(then, now):
        yield key, then, now


def _same(then: Any, now: Any) -> bool:
    figures = all(isinstance(x, (int, float)) and not isinstance(x, bool) for x in (then, now))
    return math.isclose(then, now, rel_tol=SAME, abs_tol=1e-12) if figures else bool(then == now)


def reproduce(
    plan: str | Path, *, spec: str | Path | None = None, progress: Progress = silent
) -> ReproduceAnswer:
    """Plan the spec of a plan again, and say whether it is the same plan here.

    spec: left out, the YAML file with the plan's digest is looked for beside the plan, above it, and in the
    current folder. Raises InputError for a plan that was changed, and for a spec that is none of its.
    """
    from planner.export.documents import read_sealed_plan

    then = read_sealed_plan(Path(plan))
    wanted = str(then["spec"].get("sha256", ""))
    found = _spec_of(wanted, Path(plan)) if spec is None else Path(spec)
    made = planned(found, progress=progress)
    if made.spec.sha256 != wanted:
        raise InputError(
            f"{found} is not the spec of {plan}: its digest is {made.spec.sha256[:12]}…, the plan's "
            f"{wanted[:12]}…; it was changed since, or is another"
        )
    return ReproduceAnswer(then, made.to_dict())


def _spec_of(digest: str, plan: Path) -> Path:
    """The file with a digest, near a plan. Raises InputError where there is none."""
    own = [plan.resolve()] if plan.is_dir() else []
    near = dict.fromkeys([*own, *plan.resolve().parents[:3], Path.cwd()])
    folders = [each for folder in near for each in (folder, folder / "requirements_specs")]
    for folder in folders:
        for file in sorted([*folder.glob("*.yaml"), *folder.glob("*.yml")]):
            if hashlib.sha256(file.read_bytes()).hexdigest() == digest:
                return file
    raise InputError(f"no YAML file near {plan} has the digest of its spec, {digest[:12]}…; give --spec SPEC")
