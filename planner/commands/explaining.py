"""The command that explains a rule by its code, no arithmetic: explain."""

from __future__ import annotations

from typing import Annotated

import typer

from planner.codes import Rule, rules
from planner.commands.options import AsJson
from planner.commands.output import answer
from planner.errors import InputError


def explain(
    code: Annotated[
        str | None, typer.Argument(metavar="[CODE]", help="As it stands behind a fault; left out: all.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Explain a rule that `check` or another command has named: what it asks, why, and what to do.

    Example: planner explain P111
    """
    known = rules()
    if code is None:
        answer({"rules": [vars(one) for one in known.values()]}, _listed(list(known.values())), as_json)
        return
    asked = code.strip("[] ").upper()
    if asked not in known:
        raise InputError(f"there is no rule {code[:20]!r}; `planner explain` lists all {len(known)}")
    answer(vars(known[asked]), _explained(known[asked]), as_json)


def _listed(known: list[Rule]) -> str:
    return "\n".join(f"{one.code}  {one.says}" for one in known)


def _explained(rule: Rule) -> str:
    lines = [f"{rule.code}  {rule.says}", "", f"Why:  {rule.why}", f"Do:   {rule.remedy}"]
    for word, shown in (("Wrong", rule.wrong), ("Right", rule.right)):
        if shown:
            lines += ["", f"{word}:", *(f"    {line}" for line in shown.splitlines())]
    return "\n".join(lines)
