"""Every code block of the documentation runs as it stands, in the order of the pages, in one empty folder.

`sh` goes through bash with `planner` of this tree; `python` goes on from block to block of a page; `toml` and
`yaml` are parsed. What would cost minutes (`no-run`) is only asked whether its commands and options exist.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import jsonschema
import pytest
from typer.testing import CliRunner

from planner.cli import app
from planner.export.schemas import schema_of
from tests.docs.forked import write_client
from tests.specs import ROOT

DOCS = ROOT / "planner" / "docs"
ORDER = (
    "tutorial.md",
    "how_to/own_flight.md",
    "how_to/own_bench.md",
    "how_to/benches_and_shifts.md",
    "how_to/recordings.md",
    "how_to/loop.md",
    "how_to/cluster.md",
    "how_to/own_effect.md",
    "how_to/python.md",
)
KNOWN = {"sh", "sh no-run", "python", "toml", "yaml", "text"}


@dataclass(frozen=True)
class Block:
    page: str
    line: int
    kind: str
    text: str


def blocks(path: Path) -> Iterator[Block]:
    text = path.read_text(encoding="utf-8")
    for found in re.finditer(r"^```([\w ][\w -]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        yield Block(path.name, text[: found.start()].count("\n") + 1, found[1], found[2])


ALL = [block for path in sorted(DOCS.rglob("*.md")) for block in blocks(path)]


def test_every_page_is_run_and_every_kind_of_block_is_known():
    with_blocks = {str(p.relative_to(DOCS)) for p in DOCS.rglob("*.md") if list(blocks(p))}
    assert with_blocks <= set(ORDER)
    assert {block.kind for block in ALL} <= KNOWN


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """An environment in which `planner` and `python` are those of this test, without a terminal."""
    place = tmp_path_factory.mktemp("bin")
    (place / "python").write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} "$@"\n')
    (place / "python").chmod(0o755)
    write_client(place, str(place / "door"))
    paths = {"PATH": f"{place}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    environment = {**os.environ, **paths, "NO_COLOR": "1", "OMP_NUM_THREADS": "1"}
    server = subprocess.Popen(
        [sys.executable, "-m", "tests.docs.forked", str(place / "door")],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert server.stdout is not None
    assert server.stdout.readline() == "ready\n"
    yield environment
    server.kill()
    server.wait()
    server.stdout.close()


def test_every_block_runs(tmp_path: Path, program: dict[str, str]) -> None:
    for name in ORDER:
        found = list(blocks(DOCS / name))
        python = [b for b in found if b.kind == "python"]
        for block in found:
            if block.kind == "sh":
                ran(block, ["bash", "-euo", "pipefail", "-c", block.text], tmp_path, program)
            elif block.kind == "python" and block is python[-1]:  # with those before it: they share names
                text = "\n".join(b.text for b in python)
                ran(block, ["planner", "-c", text], tmp_path, program)
            elif block.kind == "python" and "open(" in block.text:  # what later blocks of the shell read
                ran(block, ["planner", "-c", block.text], tmp_path, program)
            elif block.kind == "toml":
                tomllib.loads(block.text)
    for file, of in (
        ("plans/own/plan.json", "plan"),
        ("plans/verified/verify.json", "verify"),
        ("cal/calibration.json", "calibration"),
        ("loop/diagnosis.json", "diagnosis"),
        ("sweep/sweep.json", "sweep"),
    ):
        jsonschema.validate(json.loads((tmp_path / file).read_text(encoding="utf-8")), schema_of(of))


def ran(block: Block, command: list[str], folder: Path, environment: dict[str, str]) -> None:
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    told = f"{block.page}:{block.line}\n{block.text}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    assert done.returncode == 0, told
    assert "Traceback" not in done.stderr, told


@pytest.mark.parametrize(
    "block", [b for b in ALL if b.kind == "sh no-run"], ids=lambda b: f"{b.page}:{b.line}"
)
def test_what_is_too_long_to_run_is_a_command_line_that_there_is(block: Block) -> None:
    for line in block.text.splitlines():
        words = shlex.split(line)
        help_text = CliRunner().invoke(app, [words[1], "--help"]).stdout
        for option in (word.partition("=")[0] for word in words if word.startswith("-")):
            assert re.search(rf"(^|\s|,){re.escape(option)}\b", help_text), f"{line}: {option}"
