"""What a file is that none of our readers reads, and what to do about it."""

from __future__ import annotations

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
