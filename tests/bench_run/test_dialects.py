"""Tables and chambers described by a file: read, refused where wrong, and driven by."""

import json
import re
from pathlib import Path

import pytest

from planner.bench_run.bench_check import check_chamber, check_table
from planner.bench_run.dry import PaperJournal
from planner.bench_run.equipment import BenchLines, Equipment
from planner.bench_run.journal import Past
from planner.bench_run.paper import PaperChamber, PaperClock, PaperLine, PaperTable
from planner.bench_run.runner import execute
from planner.bench_run.table_words import TableWords
from planner.control import words
from planner.control.dialect_files import OURS, chamber_dialect, known_dialects, table_dialect
from planner.control.orders import AxisOrder
from planner.errors import InputError
from planner.nouns.bench import BenchFacts
from tests.bench_run.rig import Rig, small_job

ANSWERS_ALL = """
dialect: 1
device: table
name: answers_all
connection: {ends_with: "\\r\\n", reply_within: 1 s}
acknowledgement: {accepted: ["ok"], refused: ["error{any}"]}
units: {position: rad, rate: rpm, acceleration: rad/s^2}
decimals: 9
orders:
  stop: ["stop {axis}"]
  position: ["go {axis} {value}"]
  rate: ["turn {axis} {value}"]
questions:
  position: {ask: "where {axis}?", answer: ["{axis} at {value} rad"]}
"""


@pytest.fixture
def answers_all(tmp_path) -> Path:
    path = tmp_path / "answers_all.yaml"
    path.write_text(ANSWERS_ALL)
    return path


def test_ours_are_found_by_name_and_say_what_they_lack():
    assert {"acutrol", "scpi_table", "espec_p300", "scpi_chamber"} <= set(known_dialects())
    for path in OURS.glob("*.yaml"):
        read = table_dialect if "device: table" in path.read_text() else chamber_dialect
        assert read(path.stem).name == path.stem
        assert read(str(path)) == read(path.stem)
    assert chamber_dialect().lacks() == []
    assert any("interlock" in text for text in table_dialect().lacks())


def test_the_acutrol_dialect_says_what_the_exported_scripts_say():
    told = TableWords(table_dialect(), 2)
    bench = BenchFacts("table", "rate_table", 2, 20.0, rate_dps=600.0, angular_acceleration_dps2=500.0)
    orders = [AxisOrder(1, "rate", -200.0), AxisOrder(2, "position", 12.3456789)]
    assert told.motion(orders) == [word for order in orders for word in words.demand(order)]
    assert told.limits(bench, 0.0) == list(words.limits(bench))
    assert told.prepare() == list(words.INTERLOCKS)
    assert told.stop_all() == [words.OFF]


def test_toml_says_the_same(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'dialect = 1\ndevice = "chamber"\nname = "mine"\n[orders]\nsetpoint = ["T={value}"]\n'
        '[questions.temperature]\nask = "T?"\nanswer = ["{measured}"]\n'
    )
    read = chamber_dialect(str(path))
    assert read.orders.setpoint == ("T={value}",)
    assert len(read.lacks()) == 3
    path.write_text("dialect = [")
    with pytest.raises(InputError, match="cannot be read as TOML"):
        chamber_dialect(str(path))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("device: table", "device: chamber"), "is the dialect of a chamber, not of a table"),
        (("go {axis} {value}", "go {axis}"), r"orders\.position: no \{value\}"),
        (("go {axis}", "go {axes}"), r"unknown place \{axes\}"),
        (("at {value} rad", "at"), r"every shape needs \{value\}"),
        (("units: {position: rad", "units: {position: m"), "wrong dimension"),
        (("decimals: 9", "decimals: 9\nspeed: fast"), "speed"),
        (("  stop:", "  stops:"), "stop"),
        (("dialect: 1", "dialect: 2"), "dialect"),
        (("reply_within: 1 s", "reply_within: 1"), "reply_within"),
        ((ANSWERS_ALL, "- 1\n"), "is no dialect"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_at_its_place(change, message, answers_all):
    answers_all.write_text(ANSWERS_ALL.replace(*change))
    with pytest.raises(InputError, match=message):
        table_dialect(str(answers_all))


def test_an_unknown_name_is_told_what_there_is():
    with pytest.raises(InputError, match="did you mean 'acutrol'"):
        table_dialect("acutroll")
    with pytest.raises(InputError, match="is the dialect of a chamber"):
        table_dialect("espec_p300")


def test_a_package_offers_one_by_an_entry_point(answers_all, monkeypatch):
    from importlib import metadata

    entry = metadata.EntryPoint("answers_all", f"{__name__}:OFFERED", "planner.dialects")
    found = metadata.entry_points

    def entry_points(**given):
        own = given.get("group") == "planner.dialects" and given.get("name", entry.name) == entry.name
        return metadata.EntryPoints([entry]) if own else found(**given)

    monkeypatch.setattr(metadata, "entry_points", entry_points)
    monkeypatch.setitem(globals(), "OFFERED", answers_all)
    assert known_dialects()["answers_all"]
    assert table_dialect("answers_all").connection.reply_within == 1.0


OFFERED = None


@pytest.mark.parametrize("names", [("scpi_table", "scpi_chamber"), ("answers_all", "espec_p300")])
def test_a_campaign_is_run_in_any_dialect(names, answers_all, tmp_path):
    """On instruments of paper that understand what their file says: every order arrives in its words."""
    job, clock, said = small_job(), PaperClock(), []
    spoken = table_dialect(str(answers_all) if names[0] == "answers_all" else names[0])
    air = chamber_dialect(names[1])
    table, chamber = PaperTable(spoken, clock), PaperChamber(air, clock)
    lines = BenchLines(PaperLine(table, said.append), PaperLine(chamber, said.append), spoken, air)
    done = execute(job, Equipment(dict.fromkeys(job.used_benches, lines), clock), PaperJournal(Past()))
    assert done.steps == len(job.steps)
    turned = {"scpi_table": "AXIS1:VEL -200", "answers_all": "turn 1 -33.333333333"}[names[0]]
    assert any(turned in text for text in said)
    if names[0] == "answers_all":
        assert any("go 1 4.71238898" in text for text in said)  # 270 deg
        assert not any("ECP" in text or "Interlock" in text for text in said)


def test_bench_check_moves_nothing_unless_told():
    rig = Rig()
    tried = [*check_table(rig.table_line, rig.clock, table_dialect(), 2, moving=False)]
    tried += check_chamber(rig.chamber_line, rig.clock, chamber_dialect(), moving=False)
    assert all(one.ok for one in tried), tried
    assert not [m for _, m in [*rig.table_line.sent, *rig.chamber_line.sent] if "?" not in m]
    tried = [*check_table(rig.table_line, rig.clock, table_dialect(), 2, moving=True)]
    tried += check_chamber(rig.chamber_line, rig.clock, chamber_dialect(), moving=True)
    assert all(one.ok for one in tried), tried
    assert rig.table.at(1).rate_dps == 0.0
    assert rig.chamber.setpoint_degc == 20.0


def test_bench_check_says_what_fails():
    rig = Rig("doubled_reply@9", "chamber.nan_reading@1+")
    tried = [*check_table(rig.table_line, rig.clock, table_dialect(), 1, moving=False)]
    tried += check_chamber(rig.chamber_line, rig.clock, chamber_dialect(), moving=False)
    wrong = {(one.device, one.what): one.seen for one in tried if not one.ok}
    assert re.search("1 answers were lost", wrong["table", "replies"])
    assert "is no number" in wrong["chamber", "temperature"]
    assert json.dumps([vars(one) for one in tried])
