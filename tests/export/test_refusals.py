"""What bad plans, formats and places get: a message, exit 2, and nothing half-written."""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from planner import cli
from planner.catalog import exports
from planner.errors import InputError
from planner.export.json import document_text
from planner.export.outputs import places
from planner.protocols import ExportFormat, ExportOptions
from planner.whole_files import write_all_whole
from tests.export.samples import bench, resealed, small, turning


@pytest.fixture
def plan(tmp_path) -> Path:
    file = tmp_path / "plan" / "plan.json"
    file.parent.mkdir()
    file.write_text(document_text(turning({"rate_1_dps": 50})))
    return file


def run(*arguments: object, limit: int | None = None) -> subprocess.CompletedProcess:
    """The command in a process of its own; `limit`: no file may grow beyond so many bytes."""

    def limited() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-m", "planner", "export", *map(str, arguments)]
    return subprocess.run(
        command, capture_output=True, text=True, check=False, preexec_fn=limited if limit else None
    )


def refused(done: subprocess.CompletedProcess, *words: str) -> None:
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
    assert done.stdout == ""


def everything(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_every_format_is_a_plug_in_that_keeps_the_protocol():
    assert {"acutrol", "chamber", "csv", "ics", "json"} <= set(exports())
    assert all(isinstance(form, ExportFormat) for form in exports().values())


@pytest.mark.parametrize("form", ["acutrol", "chamber", "csv", "ics", "json"])
def test_the_command_writes_into_a_folder_a_file_or_beside_the_plan(plan, tmp_path, form):
    answer = CliRunner().invoke(cli.app, ["export", str(plan), "--format", form, "--json"])
    assert answer.exit_code == 0, answer.output
    beside = json.loads(answer.stdout)["written"]
    assert {Path(path).parent for path in beside} == {plan.parent / f"export_{form}"}
    answer = CliRunner().invoke(
        cli.app, ["export", str(plan), "--format", form, "-o", str(tmp_path / "a" / "b")]
    )
    assert answer.exit_code == 0
    assert len(list((tmp_path / "a" / "b").iterdir())) == len(beside)
    one = tmp_path / "c" / f"mine{exports()[form].suffix}"
    assert CliRunner().invoke(cli.app, ["export", str(plan), "--format", form, "-o", str(one)]).exit_code == 0
    assert one.read_bytes() == Path(beside[0]).read_bytes()
    assert len(list(one.parent.iterdir())) == len(beside)


def test_unknown_formats_and_dialects_say_what_was_meant(plan):
    refused(run(plan, "--format", "acutrl"), "unknown format 'acutrl'", "did you mean 'acutrol'?")
    refused(run(plan, "--format", "acutrol", "--dialect", "macros"), "did you mean 'macro'?")
    refused(run(plan, "--format", "csv", "--dialect", "host"), "csv has no dialects")


def test_a_plan_edited_by_hand_is_refused(plan):
    plan.write_text(plan.read_text().replace('"rate_1_dps": 50', '"rate_1_dps": 55'))
    before = everything(plan.parent)
    refused(run(plan, "--format", "acutrol"), "was changed after planner wrote it", "make it again")
    assert everything(plan.parent) == before


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"steps": 1}', b"\xff\xfe", b"[" * 100_000])
def test_what_is_no_plan_is_refused(tmp_path, content):
    file = tmp_path / "plan.json"
    file.write_bytes(content)
    refused(run(file, "--format", "csv"), "is not a plan")


def test_places_that_cannot_be_written_are_refused(plan, tmp_path):
    (tmp_path / "file").write_text("in the way")
    before = everything(tmp_path)
    refused(run(plan, "--format", "acutrol", "-o", tmp_path / "file" / "x"), "cannot write")
    refused(run(plan, "--format", "acutrol", "-o", "/proc/no/such"), "cannot write /proc/no")
    assert everything(tmp_path) == before


def test_a_full_device_is_refused_and_stays_a_device(plan):
    refused(run(plan, "--format", "csv", "-o", "/dev/full"), "cannot write /dev/full", "No space left")
    assert not Path("/dev/full").is_file()


@pytest.mark.parametrize("form", ["acutrol", "ics", "json", "csv"])
def test_a_disk_that_fills_up_leaves_nothing(plan, tmp_path, form):
    before = everything(tmp_path)
    refused(run(plan, "--format", form, "-o", tmp_path / "new" / "deep", limit=300), "cannot write")
    assert everything(tmp_path) == before
    assert not (tmp_path / "new").exists()


def test_the_files_of_the_last_export_stay_when_the_disk_fills_up(plan, tmp_path):
    out = tmp_path / "out"
    assert run(plan, "--format", "acutrol", "-o", out).returncode == 0
    before = everything(out)
    refused(run(plan, "--format", "acutrol", "-o", out, limit=300), "cannot write")
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


def test_killed_exports_leave_whole_files_only(plan, tmp_path):
    """Eight kills at moments spread over the run; every file that is there is one of the two versions."""
    out = tmp_path / "out"
    assert run(plan, "--format", "acutrol", "-o", out).returncode == 0
    first = everything(out)
    other = tmp_path / "other.json"
    other.write_text(document_text(turning({"rate_1_dps": 20})))
    assert run(other, "--format", "acutrol", "-o", tmp_path / "second").returncode == 0
    second = everything(tmp_path / "second")
    command = [sys.executable, "-m", "planner", "export", "--format", "acutrol", "-o", str(out)]
    for i in range(8):
        with subprocess.Popen(
            [*command, str(other if i % 2 else plan)], stdout=subprocess.DEVNULL
        ) as process:
            time.sleep(0.25 + 0.04 * i)
            process.kill()
        for name, content in everything(out).items():
            if not Path(name).name.startswith("."):
                assert content in (first[name], second[name])


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


def test_a_missing_bench_ends_the_command_with_two(plan):
    document = turning({"rate_1_dps": 50})
    document["benches"] = {"other": bench()}
    plan.write_text(document_text(resealed(document)))
    refused(run(plan, "--format", "acutrol"), "no bench 'table'")
    assert sorted(p.name for p in plan.parent.iterdir()) == ["plan.json"]


def test_a_plan_of_many_wrong_steps_names_the_first_and_counts_the_rest():
    document = small([("soak", 60.0, {"temperature_degc": 99})] * 50)
    with pytest.raises(InputError, match=r"50 in all") as caught:
        exports()["chamber"].files(document, ExportOptions("host"))
    assert len(caught.value.faults) == 20
