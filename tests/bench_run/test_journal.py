import json
from pathlib import Path

import pytest

from planner.bench_run.journal import Entry, open_journal, read_past
from planner.errors import InputError

STEPS = ["a", "b", "c"]


def entry(step, power_on=1):
    return Entry(step, 0.0, 1.0, 1, power_on, "2026-01-01T00:00:00.000+00:00", -40.0)


def written(path, *steps):
    journal = open_journal(path, "hash", STEPS, resume=False)
    journal.power_on()
    for step in steps:
        journal.finished(entry(step))
    journal.close()


def test_what_was_written_is_read_back(tmp_path):
    path = tmp_path / "run.jsonl"
    written(path, "a", "b")
    journal = open_journal(path, "hash", STEPS, resume=True)
    assert journal.past.entries == (entry("a"), entry("b"))
    assert (journal.session, journal.power_ons) == (2, 1)


def test_every_cut_through_the_file_leaves_the_lines_before_it(tmp_path):
    path = tmp_path / "run.jsonl"
    written(path, "a", "b", "c")
    data = path.read_bytes()
    for cut in range(len(data) + 1):
        path.write_bytes(data[:cut])
        whole = data[:cut].count(b'"step": ') - (data[:cut].rpartition(b"\n")[2].count(b'"step": '))
        told = b"\n" in data[:cut]
        if not told:  # nothing is told any more: only whoever knows that nothing was made may begin
            with pytest.raises(InputError, match="--resume --from-start"):
                open_journal(path, "hash", STEPS, resume=True)
        journal = open_journal(path, "hash", STEPS, resume=True, from_start=not told)
        journal.close()
        assert [e.step for e in journal.past.entries] == STEPS[:whole]
        assert all(json.loads(line) for line in path.read_bytes().splitlines())


def test_a_journal_is_not_overwritten(tmp_path):
    path = tmp_path / "run.jsonl"
    written(path, "a")
    with pytest.raises(InputError, match="--resume"):
        open_journal(path, "hash", STEPS, resume=False)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("hash", "other"), "another plan"),
        (lambda text: text.replace('"a"', '"b"'), "in order"),
        (lambda text: text + text.splitlines()[-1] + "\n", "in order"),
        (lambda text: text.replace('"step": "a"', '"step": "a" nonsense'), "not JSON"),
        (
            lambda text: text.replace('"start_s"', '"begin_s"'),
            "line 4, is no line of a journal of planner: see start_s, begin_s",
        ),
        (lambda text: text.replace('"start_s": 0.0', '"start_s": "0"'), "line 4, .* see start_s"),
        (lambda text: text.replace('"start_s": 0.0', '"start_s": NaN'), "line 4, .* see start_s"),
        (lambda text: text + "[" * 100_000 + "]" * 100_000 + "\n", "line 5, is not JSON"),
        (lambda text: text.replace('"journal": 1', '"diary": 1'), "no journal"),
        (lambda text: "[1]\n", "no line of a journal"),
    ],
)
def test_a_journal_that_does_not_fit_is_refused_and_left_alone(change, message, tmp_path):
    path = tmp_path / "run.jsonl"
    written(path, "a")
    path.write_text(change(path.read_text()))
    before = path.read_bytes()
    with pytest.raises(InputError, match=message):
        open_journal(path, "hash", STEPS, resume=True)
    assert path.read_bytes() == before


def test_two_runs_do_not_share_a_journal(tmp_path):
    path = tmp_path / "run.jsonl"
    journal = open_journal(path, "hash", STEPS, resume=False)
    with pytest.raises(InputError, match="in use"):
        open_journal(path, "hash", STEPS, resume=True)
    journal.close()


def test_a_folder_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        open_journal(tmp_path / "file" / "run.jsonl", "hash", STEPS, resume=False)


def test_no_journal_tells_of_nothing(tmp_path):
    assert read_past(tmp_path / "run.jsonl", "hash", STEPS).entries == ()


def test_a_journal_of_a_run_that_never_reached_the_bench_is_gone_on_with(tmp_path):
    path = tmp_path / "run.jsonl"
    written(path)
    journal = open_journal(path, "hash", STEPS, resume=False)
    journal.close()
    assert (journal.session, journal.power_ons, journal.past.entries) == (2, 1, ())
    with pytest.raises(InputError, match="another plan"):
        open_journal(path, "other", STEPS, resume=False)


def test_nothing_that_is_there_is_resumed_or_begun_by_mistake(tmp_path):
    path = tmp_path / "run.jsonl"
    with pytest.raises(InputError, match=r"is not there.*--resume --from-start"):
        open_journal(path, "hash", STEPS, resume=True)
    assert not path.exists()
    path.write_text("my own notes, without a line end")
    for from_start in (False, True):
        with pytest.raises(InputError, match="is no journal of planner"):
            open_journal(path, "hash", STEPS, resume=True, from_start=from_start)
    assert path.read_text() == "my own notes, without a line end"
    path.unlink()
    written(path, "a")
    with pytest.raises(InputError, match="tells of 1 finished steps; leave --from-start out"):
        open_journal(path, "hash", STEPS, resume=True, from_start=True)


def test_a_record_that_has_no_end_is_told_of(tmp_path):
    path = tmp_path / "run.jsonl"
    journal = open_journal(path, "hash", STEPS, resume=False)
    for step in ("a", "b"):
        journal.begun(step, 1.0)
    journal.void("b", "a reply was in doubt", 1.0, 2.0)
    journal.finished(entry("a"))
    journal.begun("b", 3.0)
    journal.close()
    journal = open_journal(path, "hash", STEPS, resume=True)
    journal.close()
    assert [begun.step for begun in journal.past.begun] == ["b"]


def test_benches_side_by_side_keep_their_own_order(tmp_path):
    path = tmp_path / "run.jsonl"
    journal = open_journal(path, "hash", STEPS, resume=False)
    for step in ("a", "c"):
        journal.finished(entry(step))
    journal.close()
    lanes = (["a", "b"], ["c"])
    open_journal(path, "hash", STEPS, resume=True, lanes=lanes).close()
    with pytest.raises(InputError, match="in order"):
        open_journal(path, "hash", STEPS, resume=True)


def test_a_device_is_no_journal(tmp_path):
    """/dev/full has no end: to read it back would fill the memory."""
    with pytest.raises(InputError, match="is no file"):
        open_journal(Path("/dev/full"), "hash", STEPS, resume=False)
