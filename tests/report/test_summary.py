"""The summary in the terminal."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest
from rich.console import Console

from planner.nouns.plan import Plan
from planner.plan.spec_to_sensitivity import sensitivity_rows
from planner.report.console import show
from planner.report.subjects.plan import plan_report
from planner.report.subjects.sensitivity import allowed_report, sensitivity_report
from tests.report import sample


def printed(plan: Plan, width: int = 80, *, terminal: bool = False) -> str:
    out = io.StringIO()
    console = Console(
        file=out, width=width, force_terminal=terminal, color_system="standard" if terminal else None
    )
    show(plan_report(plan, constraints=sample.constraints()), console)
    assert console.width == width
    return out.getvalue()


def test_the_answer_comes_first_and_plain() -> None:
    text = printed(sample.plan())
    lines = text.splitlines()
    assert lines[0] == "small UAV, one minute"
    assert lines[1].startswith("29.85 h (1.24 days). Proved:")
    assert lines[2] == "position: 26.54 m <= 30 m (margin 3.46 m, 11.5 %; at the end, worst case): met"
    assert "\x1b" not in text
    assert "\u202f" not in text


def test_a_pipe_gets_every_part_whatever_its_width() -> None:
    line = next(line for line in printed(sample.plan(), 40).splitlines() if line.startswith("gyro.bias"))
    assert line.split() == [
        "gyro.bias",
        "deg/s",
        "0.0087",
        "0.002",
        "0.001",
        "0.001",
        "0.0035",
        "0.0012",
        "899.8",
        "29.5",
        "%",
    ]


@pytest.mark.parametrize("width", [40, 60, 80, 200])
def test_fits_any_terminal(width: int) -> None:
    for line in printed(sample.plan(), width, terminal=True).splitlines():
        assert Console().render_str(line).cell_len <= width + line.count("\x1b") * 8


def test_a_missed_requirement_and_markup_in_names_are_shown() -> None:
    text = printed(replace(sample.fixed_plan(), name="[bold]x[/] [y]"))
    assert text.startswith("[bold]x[/] [y]\n")
    assert "26.54 m > 20 m" in text
    assert "NOT met" in text
    assert "Hand-made plan" in text


def test_an_empty_plan_is_no_error() -> None:
    bare = replace(sample.plan(), tests=(), allowances=(), requirements=(), steps=(), reasons=(), notes=())
    assert "29.85 h" in printed(bare)


def test_sensitivities_are_listed_per_display_unit() -> None:
    out = io.StringIO()
    show(sensitivity_report(sensitivity_rows(sample.sensitivities())), Console(file=out, width=30))
    row = next(line for line in out.getvalue().splitlines() if line.startswith("gyro.bias "))
    # 300 m per deg/s along (0.9, 0.1, 0.42)
    assert row.split() == ["gyro.bias", "x", "deg/s", "270", "30", "126", "299.5"]


def test_allowed_errors_show_genetic_beside_exact() -> None:
    out = io.StringIO()
    show(allowed_report(sample.allowed(sample.plan().allowances)), Console(file=out, width=60))
    text = out.getvalue()
    assert "use 62.0 %" in text
    assert "0.36 %" in text
    assert "200 generations" in text
    row = next(line for line in text.splitlines() if line.endswith("0.36 %") and line.startswith("gyro.bias"))
    assert row.split() == ["gyro.bias", "0.01214", "0.01218", "deg/s", "0.36", "%"]
