"""Which reader a file needs: by its first bytes, and by its name where bytes do not tell.

A reader, and the library it is made with, is imported when a file needs it.
"""

from __future__ import annotations

from pathlib import Path

from tumble.errors import LogError
from tumble.file_names import SESSION_FILE
from tumble.files import note_input
from tumble.logs.options import ReadOptions
from tumble.logs.track import LoggedImu

_MAGIC = {
    b"PAR1": "parquet",
    b"#ROSBAG V2": "ros1",
    b"\x89MCAP0\r\n": "mcap",
    b"SQLite format 3\x00": "ros2",
}
_NO_LOGS = {
    b"\x89PNG": "a PNG picture",
    b"\xff\xd8\xff": "a JPEG picture",
    b"%PDF": "a PDF document",
    b"\x1f\x8b": "a gzip archive; unpack it first",
    b"PK\x03\x04": "a ZIP archive; unpack it first",
    b"\x28\xb5\x2f\xfd": "a zstd archive; unpack it first",
    b"ULog\x01\x12\x35": "a PX4 ULog, which is not read yet; convert it to CSV with ulog2csv",
}


_BAGS = ("ros1", "ros2", "mcap")


def find_format(path: Path) -> str:
    """Give `csv`, `parquet`, `imu_tk`, `ros1`, `ros2`, `mcap`, `session` or `folder`.

    Raises `LogError` where the file is empty, cannot be opened, or is known not to be a log.
    """
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            for part in path.iterdir():
                note_input(part)
            return "ros2"
        if (path / SESSION_FILE).is_file():
            return "session"
        return _pair_or(path, "folder")
    if path.exists() and not path.is_file():
        raise LogError(f"{path}: is a device or a pipe, not a log; give a file, or pipe it in and give -")
    note_input(path)
    try:
        with path.open("rb") as file:
            head = file.read(16)
    except OSError as error:
        raise LogError(f"{path}: cannot be opened: {error.strerror}") from error
    if not head:
        raise LogError(f"{path}: is empty; record or copy it again")
    for magic, name in _MAGIC.items():
        if head.startswith(magic):
            return name
    for magic, what in _NO_LOGS.items():
        if head.startswith(magic):
            raise LogError(f"{path}: not a log but {what}")
    if path.suffix in (".parquet", ".pq", ".bag", ".db3", ".mcap"):
        raise LogError(f"{path}: does not start like a {path.suffix} file; copy it again, or rename it")
    return _pair_or(path, "csv")


def _pair_or(path: Path, otherwise: str) -> str:
    from tumble.logs import imu_tk

    return "imu_tk" if imu_tk.find_pair(path) else otherwise


def open_logged_imu(path: Path, imu: str | None, options: ReadOptions) -> LoggedImu:
    """Open a file, or a bag folder, with the reader it needs."""
    kind = find_format(path)
    if kind in _BAGS:
        from tumble.logs import ros

        return ros.open_logged_imu(path, kind, imu)
    if kind == "parquet":
        from tumble.logs import parquet

        return parquet.open_logged_imu(path, imu, options)
    if kind == "session":
        from tumble.logs import session

        return session.open_logged_imu(path, imu, options)
    if kind == "imu_tk":
        from tumble.logs import imu_tk

        pair = imu_tk.find_pair(path)
        assert pair is not None
        return imu_tk.open_logged_imu(pair, path, options)
    from tumble.logs import csv

    return csv.open_logged_imu(path, imu, options)


def list_imus(path: Path, options: ReadOptions) -> tuple[str, ...]:
    """Give the names of the IMUs in a file or bag folder; an IMU that needs no name has an empty one."""
    kind = find_format(path)
    if kind in _BAGS:
        from tumble.logs import ros

        return ros.list_imus(path, kind)
    if kind == "parquet":
        from tumble.logs import parquet

        return parquet.list_imus(path, options)
    if kind == "session":
        from tumble.logs import session

        return session.list_imus(path)
    if kind == "imu_tk":
        return ("",)
    from tumble.logs import csv

    return csv.list_imus(path, options)
