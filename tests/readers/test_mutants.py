"""Damaged files are read with an account or refused in words: never an internal error.

`benchmarks/study_mutants.py` does the same a hundred thousand times.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner.errors import InputError
from planner.recordings.recording import Recording
from planner.recordings.samples import Account
from tests.readers.mutants import MAPS, NAMES, attempt, good_files, guess, mutated

KINDS = [*MAPS, "dwells.csv"]
TEXTS = ("csv", "tsv", "txt", "log", "dwells.csv")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    return good_files(tmp_path_factory.mktemp("good"))


@pytest.mark.parametrize("kind", KINDS)
def test_the_good_files_are_read(tmp_path: Path, good: dict[str, bytes], kind: str) -> None:
    """Else the damage would tell nothing."""
    path = tmp_path / f"a.{kind}"
    path.write_bytes(good[kind])
    assert attempt(path, kind) == "read"


@pytest.mark.parametrize("kind", KINDS)
def test_damage_is_read_or_refused(tmp_path: Path, good: dict[str, bytes], kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    rng = np.random.default_rng([17, KINDS.index(kind)])
    outcomes = set()
    for _ in range(200 if kind in TEXTS else 100):
        path.write_bytes(mutated(good[kind], rng))
        outcomes.add(attempt(path, kind))
    assert outcomes <= {"read", "refused"}
    assert "refused" in outcomes


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("broken", ["1e200", "1e308", "inf", "-1e999"])
def test_a_guess_is_not_upset_by_a_number_beyond_all_numbers(tmp_path: Path, broken: str) -> None:
    rows = [f"{k / 100},0.1,0.2,0.3,0,0,9.8" for k in range(200)]
    rows[7] = f"0.07,{broken},0.2,0.3,0,0,{broken}"
    path = tmp_path / "a.csv"
    path.write_text("\n".join([",".join(NAMES), *rows, ""]))
    assert guess(path) == "read"


@pytest.mark.parametrize("kind", ["csv", "tsv", "txt", "log"])
def test_a_guess_of_damage_is_a_map_or_refused(tmp_path: Path, good: dict[str, bytes], kind: str) -> None:
    path = tmp_path / f"a.{kind}"
    rng = np.random.default_rng([18, KINDS.index(kind)])
    for _ in range(20):
        path.write_bytes(mutated(good[kind], rng))
        assert guess(path) in ("read", "refused")


# ---------------------------------------------------------------- every fault has its line


FAULTS = {
    "a cell too many": (lambda row: row + ",9", "8 cells where the table has 7 columns"),
    "a cell too few": (lambda row: row.rpartition(",")[0], "6 cells where the table has 7 columns"),
    "digits of another script": (lambda row: "\u0661\u0662" + row, "is not a number"),
    "a fraction sign": (lambda row: row.replace(",", ",\u00bd", 1), "is not a number"),
    "a quote that never closes": (lambda row: '"' + row, "a quote is opened and never closed"),
    "a return within the line": (
        lambda row: row.replace(",", ",\r", 1),
        "a carriage return stands within the line",
    ),
    "an underscore": (lambda row: row.replace(",", ",1_0", 1), "is not a number"),
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("rows", [[5], [3, 9, 30]])
def test_a_fault_is_told_with_its_line(
    tmp_path: Path, good: dict[str, bytes], fault: str, rows: list[int]
) -> None:
    change, said = FAULTS[fault]
    lines = good["csv"].decode().split("\n")
    for row in rows:
        lines[row] = change(lines[row])
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines), newline="")
    account = Account()
    kept = sum(len(samples) for samples in Recording(path, MAPS["csv"]).samples(account))
    assert kept == 40 - len(rows)
    assert account.counts["unreadable_row"] == len(rows)
    assert f"{path}:{rows[0] + 1}:1" in account.remarks[0]
    assert said in account.remarks[0]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_dwell_table_is_told_with_its_line(
    tmp_path: Path, good: dict[str, bytes], fault: str
) -> None:
    from planner.dwells.dwell_files import read_dwells

    change, _ = FAULTS[fault]
    lines = good["dwells.csv"].decode().split("\n")
    header = next(i for i, line in enumerate(lines) if line.startswith("unit,"))
    place = header + 2
    unit, _, rest = lines[place].partition(",")
    lines[place] = f"{unit},{change(rest)}" if "quote" not in fault else change(lines[place])
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines), newline="")
    with pytest.raises(InputError) as caught:
        read_dwells(path)
    assert [fault.line for fault in caught.value.faults] == [place + 1]


def test_many_rows_with_faults_go_through_little_memory(tmp_path: Path) -> None:
    """Blocks of 16 MB, however many rows are bad among them; the quick way takes over after each."""
    import tracemalloc

    rng = np.random.default_rng(1)
    count = 100_000
    numbers = rng.normal(size=(1000, 6)).round(4)
    texts = [",".join(map(str, row)) for row in numbers.tolist()]
    path = tmp_path / "a.csv"
    with path.open("w") as file:
        file.write(",".join(NAMES) + "\n")
        for first in range(0, count, 1000):
            file.writelines(f"{(first + k) / 100},{text}\n" for k, text in enumerate(texts))
            file.write("torn,1\n")
    account = Account()
    tracemalloc.start()
    kept = sum(len(samples) for samples in Recording(path, MAPS["csv"]).samples(account))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert kept == count
    assert account.counts["unreadable_row"] == count // 1000
    assert peak < 100e6  # one block of text is 16 MB, its numbers 20; a million rows need no more
