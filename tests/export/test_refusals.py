"""What bad plans, formats and places get: a message, exit 2, and nothing half-written."""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from planner import cli
from planner.catalog import exports
from planner.errors import InputError
from planner.export.json import document_text
from planner.export.outputs import places
from planner.own_files import LIST
from planner.protocols import ExportFormat, ExportOptions
from planner.whole_files import write_all_whole
from tests.export.samples import bench, resealed, small, turning
from tests.outcome import Outcome, Run


@pytest.fixture
def plan(tmp_path) -> Path:
    file = tmp_path / "plan" / "plan.json"
    file.parent.mkdir()
    file.write_text(document_text(turning({"rate_1_dps": 50})))
    return file


@pytest.fixture
def export(run: Run) -> Run:
    """`planner export` with further arguments."""
    return lambda *arguments: run("export", *arguments)


@contextmanager
def no_file_beyond(limit: int) -> Iterator[None]:
    """As on a disk that is full: no file may grow beyond so many bytes."""
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)


def refused(done: Outcome, *words: str) -> None:
    assert done.code == 2, done.err
    for word in words:
        assert word in done.err
    assert done.out == ""


def everything(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_every_format_is_a_plug_in_that_keeps_the_protocol():
    assert {"acutrol", "chamber", "csv", "ics", "json"} <= set(exports())
    assert all(isinstance(form, ExportFormat) for form in exports().values())


@pytest.mark.parametrize("form", ["acutrol", "chamber", "csv", "ics", "json"])
def test_the_command_writes_into_a_folder_a_file_or_beside_the_plan(plan, tmp_path, form):
    answer = CliRunner().invoke(cli.app, ["export", str(plan), "--format", form, "--json"])
    assert answer.exit_code == 0, answer.output
    beside = json.loads(answer.stdout)["result"]["written"]
    assert {Path(path).parent for path in beside} == {plan.parent / f"export_{form}"}
    answer = CliRunner().invoke(
        cli.app, ["export", str(plan), "--format", form, "-o", str(tmp_path / "a" / "b")]
    )
    assert answer.exit_code == 0
    assert {p.name for p in (tmp_path / "a" / "b").iterdir()} == {LIST, *(Path(path).name for path in beside)}
    one = tmp_path / "c" / f"mine{exports()[form].suffix}"
    assert CliRunner().invoke(cli.app, ["export", str(plan), "--format", form, "-o", str(one)]).exit_code == 0
    assert one.read_bytes() == Path(beside[0]).read_bytes()
    assert len(list(one.parent.iterdir())) == len(beside)


def test_unknown_formats_and_dialects_say_what_was_meant(export, plan):
    refused(export(plan, "--format", "acutrl"), "unknown format 'acutrl'", "did you mean 'acutrol'?")
    refused(export(plan, "--format", "acutrol", "--dialect", "macros"), "did you mean 'macro'?")
    refused(export(plan, "--format", "csv", "--dialect", "host"), "csv has no dialects")


def test_a_plan_edited_by_hand_is_refused(export, plan):
    plan.write_text(plan.read_text().replace('"rate_1_dps": 50', '"rate_1_dps": 55'))
    before = everything(plan.parent)
    refused(export(plan, "--format", "acutrol"), "was changed after planner wrote it", "make it again")
    assert everything(plan.parent) == before


@pytest.mark.parametrize("content", [b"{", b"[]", b'{"steps": 1}', b"\xff\xfe", b"[" * 100_000])
def test_what_is_no_plan_is_refused(export, tmp_path, content):
    file = tmp_path / "plan.json"
    file.write_bytes(content)
    refused(export(file, "--format", "csv"), "is not a plan")


def test_places_that_cannot_be_written_are_refused(export, plan, tmp_path):
    (tmp_path / "file").write_text("in the way")
    before = everything(tmp_path)
    refused(export(plan, "--format", "acutrol", "-o", tmp_path / "file" / "x"), "cannot write")
    refused(export(plan, "--format", "acutrol", "-o", "/proc/no/such"), "cannot write /proc/no")
    assert everything(tmp_path) == before


def test_a_full_device_is_refused_and_stays_a_device(export, plan):
    refused(export(plan, "--format", "csv", "-o", "/dev/full"), "cannot write /dev/full", "No space left")
    assert not Path("/dev/full").is_file()


@pytest.mark.parametrize("form", ["acutrol", "ics", "json", "csv"])
def test_a_disk_that_fills_up_leaves_nothing(export, plan, tmp_path, form):
    before = everything(tmp_path)
    with no_file_beyond(300):
        done = export(plan, "--format", form, "-o", tmp_path / "new" / "deep")
    refused(done, "cannot write")
    assert everything(tmp_path) == before
    assert not (tmp_path / "new").exists()


def test_the_files_of_the_last_export_stay_when_the_disk_fills_up(export, plan, tmp_path):
    out = tmp_path / "out"
    assert export(plan, "--format", "acutrol", "-o", out).code == 0
    before = everything(out)
    with no_file_beyond(300):
        done = export(plan, "--format", "acutrol", "-o", out)
    refused(done, "cannot write")
    assert everything(out) == before


def test_no_file_appears_when_a_later_one_cannot_be_written(tmp_path, monkeypatch):
    calls = iter(range(3))

    def full(handle: int) -> None:
        if next(calls) == 2:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left"):
        write_all_whole({tmp_path / "new" / name: b"x" * 100 for name in "abc"})
    assert list(tmp_path.iterdir()) == []


def test_the_main_file_may_not_take_the_place_of_another(tmp_path):
    with pytest.raises(InputError, match="choose another"):
        places({"plan.json": "", "plan.schema.json": ""}, tmp_path / "plan.schema.json")


LIMITS = {"rate_dps": 600, "angular_acceleration_dps2": 500, "acceleration_g": 50}
CENTRIFUGE = {"kind": "centrifuge", "axes": 1, "arm_m": 1.0, "chamber": None}


@pytest.mark.parametrize(
    ("document", "message"),
    [
        (lambda: turning({"rate_1_dps": 600.1}), r"600.1 deg/s is over the limit of axis 1, 600 deg/s"),
        (lambda: turning({"rate_1_dps": -700}), r"-700 deg/s is over"),
        (lambda: turning({"rate_3_dps": 10}), "axis 3 is named, but the bench has 2"),
        (lambda: turning({"position_2_deg": 10}, axes=1), "axis 2 is named, but the bench has 1"),
        (
            lambda: turning({"acceleration_g": -51}, **CENTRIFUGE, limits=LIMITS),
            "-51 g is over the limit of the load",
        ),
        (lambda: turning({"acceleration_g": 20}, **CENTRIFUGE, limits=LIMITS), "on an arm of 1 m is 802.4"),
        (
            lambda: turning({"rate_1_dps": 500}, move=0.5, axes=1),
            "needs 1.00 s to move, the plan leaves 0.50 s",
        ),
        (lambda: turning({"position_1_deg": 180}, move=1.0), "needs 1.20 s to move"),
        (lambda: small([("soak", 60.0, {"temperature_degc": -70})]), "-70 degC is outside"),
        (
            lambda: small([("soak", 60.0, {"temperature_degc": 0})], table=bench(chamber=None)),
            "has no chamber",
        ),
        (lambda: small([("soak", 60.0, {"bench": "oven"})]), "no bench 'oven' in the plan; it has table"),
        (lambda: small([("soak", 60.0, {}), ("soak", 60.0, {"start_s": 30.0})]), "starts before the bench"),
        (
            lambda: small([("soak", 60.0, {}), ("soak", 60.0, {}), ("soak", 60.0, {"start_s": 30.0})]),
            "start_s: 30 s, before the step that stands before it, 60 s",
        ),
        (lambda: small([("soak", 60.0, {"end_s": -1.0})]), "not a plan that planner writes"),
    ],
)
@pytest.mark.parametrize("form", ["acutrol", "chamber", "ics"])
def test_what_the_benches_cannot_do_is_refused_before_anything_is_written(document, message, form):
    if form == "chamber" and "kind" in str(document.__code__.co_consts):
        pytest.skip("that bench has no chamber")
    with pytest.raises(InputError, match=message):
        exports()[form].files(document(), ExportOptions("host" if form != "ics" else None))


def test_what_is_just_within_the_limits_passes():
    for document in (
        turning({"rate_1_dps": 600}),
        turning({"acceleration_g": -50}, **CENTRIFUGE, limits=LIMITS | {"rate_dps": 1270}),
        small([("soak", 60.0, {"temperature_degc": -65}), ("soak", 60.0, {"temperature_degc": 85})]),
    ):
        assert exports()["ics"].files(document, ExportOptions()).files


def test_a_missing_bench_ends_the_command_with_two(export, plan):
    document = turning({"rate_1_dps": 50})
    document["benches"] = {"other": bench()}
    plan.write_text(document_text(resealed(document)))
    refused(export(plan, "--format", "acutrol"), "no bench 'table'")
    assert sorted(p.name for p in plan.parent.iterdir()) == ["plan.json"]


def test_a_plan_of_many_wrong_steps_names_the_first_and_counts_the_rest():
    document = small([("soak", 60.0, {"temperature_degc": 99})] * 50)
    with pytest.raises(InputError, match=r"50 in all") as caught:
        exports()["chamber"].files(document, ExportOptions("host"))
    assert len(caught.value.faults) == 20
