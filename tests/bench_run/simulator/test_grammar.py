import string

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.bench_run.simulator.grammar import (
    COMMANDS,
    LONGEST_MESSAGE,
    Command,
    GrammarError,
    parse,
    short_form,
)

AXES = 3


@st.composite
def spelled(draw):
    """Any command in any legal spelling, and what it means."""
    name = draw(st.sampled_from(sorted(COMMANDS)))
    words = name.removesuffix("?").split(":")
    header = (
        ":" + ":".join(draw(st.sampled_from([w, short_form(w)])) for w in words) + "?" * name.endswith("?")
    )
    header = "".join(draw(st.sampled_from([c.lower(), c.upper()])) for c in header)
    axis, mode, value, given_as = 0, None, None, []
    for kind in COMMANDS[name]:
        if kind in ("axis", "one_axis"):
            axis = draw(st.integers(1 if kind == "one_axis" else 0, AXES))
            given_as.append(str(axis) if axis else draw(st.sampled_from(["ALL", "all", "All"])))
        elif kind == "mode":
            mode = draw(st.sampled_from("pr"))
            given_as.append(draw(st.sampled_from([mode, mode.upper()])))
        else:
            value = draw(st.floats(-1e6, 1e6, allow_nan=False))
            given_as.append(repr(value))
    text = header + " " * draw(st.integers(1, 3)) + ",".join(given_as)
    return text, Command(name, axis, mode, value)


@given(st.lists(spelled(), min_size=1, max_size=5))
@settings(deadline=None, max_examples=200)
def test_every_legal_spelling_means_what_it_says(commands):
    frame = ";".join(text for text, _ in commands)
    assert parse(frame, AXES) == tuple(command for _, command in commands)


@given(st.text(alphabet=string.printable + "é\x00", max_size=60))
@settings(deadline=None, max_examples=300)
def test_anything_else_is_refused_and_nothing_worse(text):
    try:
        commands = parse(text, AXES)
    except GrammarError:
        return
    assert all(command.name in COMMANDS for command in commands)


@given(spelled(), st.data())
@settings(deadline=None, max_examples=200)
def test_a_letter_lost_from_a_word_is_refused_unless_it_is_the_short_form(command, data):
    text, meant = command
    end = text.index(" ")
    cut = data.draw(st.integers(0, end - 1))
    try:
        (found,) = parse(text[:cut] + text[cut + 1 :], AXES)
    except GrammarError:
        return
    assert found == meant


@pytest.mark.parametrize(
    "text",
    [
        ":Demand:Position,1,90",
        ":Demand:Position1,90",
        ":Demand:Position 1 90",
        ":Demand:Position 1",
        ":Demand:Position 1,90,0",
        ":Demand:Position 1,ninety",
        ":Demand:Position 1,nan",
        ":Demand:Position 1,inf",
        ":Demand:Position 4,90",
        ":Demand:Position 0,90",
        ":Demand:Posit 1,90",
        "Demand:Position 1,90",
        ":Mode:Position",
        ":Mode:Position 1;",
        ";:Mode:Position 1",
        ":Mode:Position 1,2",
        ":Read:Position? ALL",
        ":Read:Position 1",
        ":Status:ECP?",
        ":Limit:Rate q,1,600",
        ":Limit:Rate 1,p,600",
        ":Interlock:Close",
        "*OPC",
        "*OPC?",
        "*WAI",
        "*RST",
        "*IDN?",
        "",
        " ",
        ":Mode:Position ١",
    ],
)
def test_what_no_controller_must_be_trusted_with(text):
    with pytest.raises(GrammarError):
        parse(text, AXES)


@pytest.mark.parametrize("text", [":DEM:POS 1,90", ":dem:position 1,90", ":Demand:Pos  1,+9.0e1"])
def test_short_forms_case_and_blanks(text):
    assert parse(text, AXES) == (Command("Demand:Position", 1, None, 90.0),)


def test_a_message_is_at_most_32_kb():
    command = ":Mode:Off ALL"
    count = (LONGEST_MESSAGE + 1) // (len(command) + 1)
    frame = ";".join([command] * count)
    assert len(frame) <= LONGEST_MESSAGE
    assert len(parse(frame, AXES)) == count
    with pytest.raises(GrammarError, match="32768"):
        parse(frame + ";" + command, AXES)
