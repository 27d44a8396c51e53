"""The chamber's commands with their times, in the language of ESPEC P300 controllers, and its setpoints.

`POWER,ON`, `MODE,CONSTANT`, `TEMP,S-40.0` (degrees Celsius, tenths), `TEMP?`. Each line of the script carries
`|delay_ms`, as the host's table script does. The chamber ends at room temperature.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from planner.control import words
from planner.control.limits import by_bench
from planner.control.words import figure, rounding_note
from planner.errors import InputError
from planner.export._checked import checked_plan
from planner.export._scripts import Block, Command, file_name, host_lines, milliseconds
from planner.export._setpoints import setpoint_text, setpoints
from planner.export._shifts import start_notes
from planner.export.header import comment_lines
from planner.nouns.bench import BenchFacts
from planner.nouns.step import Step
from planner.protocols import Exported, ExportOptions


class ChamberScript:
    """Chamber scripts, one a bench, and the setpoints as a list beside each."""

    name = "chamber"
    suffix = ".txt"
    dialects = ("host",)

    def files(self, document: Mapping[str, Any], options: ExportOptions) -> Exported:
        """`<bench>.chamber.txt` and `<bench>.setpoints.csv` of every bench with a chamber."""
        plan = checked_plan(document)
        steps = by_bench(plan.steps)
        chambers = {b: plan.benches[b] for b in steps if plan.benches[b].chamber is not None}
        if not chambers:
            raise InputError("no bench of this plan has a chamber")
        files: dict[str, str | bytes] = {}
        for bench, facts in chambers.items():
            about = (
                f"bench: {file_name(bench)}",
                f"start_s: {figure(steps[bench][0].start_s)}",
                "units: degC, ms",
            )
            lines = [*comment_lines(document, *about), *host_lines(blocks(facts, steps[bench]))]
            files[f"{file_name(bench)}.chamber.txt"] = "\n".join(lines) + "\n"
        for bench, facts in chambers.items():
            files[f"{file_name(bench)}.setpoints.csv"] = setpoint_text(document, facts, steps[bench])
        rounded = [rounding_note(b, (step.temperature_degc for step in steps[b])) for b in chambers]
        missing = (f"{b} has no chamber" for b in steps if b not in chambers)
        notes = (f"{note}; the setpoint list has them as planned" for note in rounded if note)
        return Exported(files, (*missing, *notes, *start_notes(plan)))


def blocks(bench: BenchFacts, steps: Sequence[Step]) -> Iterator[Block]:
    """Power and mode once, then each setpoint: until it is soaked, and with a look at it while it is held."""
    first: tuple[Command, ...] = (Command(words.POWER_ON), Command(words.CONSTANT))
    for point in setpoints(bench, steps):
        start, soaked, end = (milliseconds(t) for t in (point.start_s, point.soaked_s, point.end_s))
        yield Block((*first, Command(words.setpoint(point.degc))), soaked - start)
        yield Block((Command(words.READ_TEMPERATURE),), end - soaked)
        first = ()


FORMAT = ChamberScript()
