"""Which reader reads a file; of one that none of ours reads, what it is and what to do about it."""

from __future__ import annotations

from pathlib import Path

from planner import catalog
from planner.errors import InputError, unusable_file
from planner.nouns.given_files import RECORDING
from planner.protocols import RawReader

HEAD_BYTES = 8192

_SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (b"\x1f\x8b", "packed by gzip; unpack it first"),
    (b"BZh", "packed by bzip2; unpack it first"),
    (b"\xfd7zXZ", "packed by xz; unpack it first"),
    (b"7z\xbc\xaf", "packed by 7-Zip; unpack it first"),
    (b"Rar!", "packed by RAR; unpack it first"),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook; save the sheet as CSV"),
    (b"%PDF", "a PDF; the numbers must be in a table"),
    (b"#ROSBAG", "a ROS bag; write its topic to CSV, as by `rostopic echo -b FILE -p /imu > imu.csv`"),
    (b"SQLite format 3", "a database, as a ROS 2 bag is; write its topic to CSV"),
    (b"\x89MCAP", "an MCAP log; write its topic to CSV"),
    (b"TDSm", "a TDMS file of LabVIEW; export it as text"),
    (b"ULog", "a log of PX4; write it to CSV by ulog2csv"),
    (b"\xa3\x95", "a log of ArduPilot; write it to CSV by mavlogdump.py --format csv"),
)


def foreign(head: bytes) -> str:
    """`a ROS bag; write its topic to CSV …` for the first bytes of a file; nothing for others."""
    if head.startswith(b"PK\x03\x04"):
        if b"xl/" in head or b"[Content_Types].xml" in head:
            return "an Excel workbook; save the sheet as CSV"
        return "a zip archive; unpack it first"
    if head.lstrip()[:1] in (b"{", b"[") and b":" in head[:4096]:
        return "JSON; write its arrays as columns of a CSV"
    return next((said for signature, said in _SIGNATURES if head.startswith(signature)), "")


def reader_of(path: Path, name: str | None = None) -> RawReader:
    """The reader for a file, by name or by what the file holds. Raises InputError when none fits."""
    readers = catalog.readers()
    if name is not None and name not in readers:
        raise InputError(f"no reader is called {name!r}; there are {', '.join(readers)}")
    try:
        with path.open("rb") as file:
            head = file.read(HEAD_BYTES)
    except OSError as error:
        raise unusable_file(path, error, RECORDING) from error
    if not head:
        raise unusable_file(path, "is empty", RECORDING)
    if path.suffix.lower() != ".npz" and (said := foreign(head)):
        raise InputError(f"{path}: this is {said}")
    in_turn = sorted(readers.values(), key=lambda r: r.name == "text")  # text takes what is left
    fit = next((reader for reader in in_turn if reader.recognises(path, head)), None)
    if name is not None:
        if fit is not None and fit.name != name and not readers[name].recognises(path, head):
            raise InputError(
                f"{path}: this is {fit.name}, not {name}: write `format: {fit.name}`, or leave format out"
            )
        return readers[name]
    if fit is None:
        broken = "".join(f"; {one}" for one in catalog.unloadable("readers"))
        wrong = f"is of no format that can be read (there are {', '.join(readers)}{broken})"
        raise unusable_file(path, wrong, RECORDING)
    return fit
