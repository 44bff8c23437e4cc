"""The formats of logs that are read, and of files that are often taken for logs.

One row a format: what it is called, how its files begin and end, and which module reads it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tumble.foundation.body_axes import FLU, FRD, in_words
from tumble.foundation.file_names import SESSION_FILE
from tumble.foundation.words import in_utf8


@dataclass(frozen=True, slots=True)
class LogFormat:
    """A format that is read."""

    name: str
    """Name, the same as in `tumble.foundation.recording.Metadata.format`."""
    what: str
    """Description in words."""
    module: str
    """Below `tumble.logs`: it has `open_logged_imu(path, imu, options)` and `list_imus(path, options)`, and
    `recognises(path, head)` where it looks inside."""
    example: str
    """Argument that a user types, for example."""
    endings: tuple[str, ...] = ()
    """Usual endings of the names of its files."""
    begins: tuple[bytes, ...] = ()
    """First bytes of its files."""
    pattern: bytes = b""
    """Regular expression found in the first bytes of its files, once unpacked; else nobody looks inside."""
    folder_with: str = ""
    """Name of a file or folder by which a folder is known to be of this format."""
    looks_inside: bool = False
    """Indicates whether its module inspects files and folders that neither name nor beginning identifies."""
    binary: bool = False
    """Indicates whether a file with such an ending but another beginning is reported as damaged, not read as
    a text table."""
    extra: str = ""
    """Extra to be installed, as in `pip install tumble-imu[EXTRA]`; empty if none is needed."""
    body: str = ""
    """Directions of its axes in a vehicle, as in `body_axes`, where its documentation defines them."""
    axes: str = ""
    """Directions of its axes, in words, where its documentation defines them; of its local frame too."""
    magnetometer: str = ""
    """Unit of a magnetometer, in words, where its reader takes one; empty where it takes none."""
    firmware: str = ""
    """Firmware whose parameters its logs hold, as after `--format`: its module has `parameters_in`."""


_FRD = f"{in_words(FRD)}, so that z reads -g when level; local frame NED"
_FLU_OF_ROS = f"{in_words(FLU)}, where the driver keeps to REP 103; local frame ENU"
_PHONE = "x to the right, y to the top, z out of the screen"

_BY_COLUMN = "by the name of the column, else µT"

LOG_FORMATS = (
    LogFormat(
        "parquet",
        "Parquet tables",
        "parquet",
        "tumble inspect log.parquet",
        (".parquet", ".pq"),
        (b"PAR1",),
        binary=True,
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "feather",
        "Feather tables, files of Arrow",
        "feather",
        "tumble inspect log.feather",
        (".feather", ".arrow", ".ipc"),
        (b"ARROW1", b"FEA1"),
        binary=True,
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "ros1",
        "ROS 1 bags",
        "rosbag1",
        "tumble inspect drive.bag:/imu/data",
        (".bag",),
        (b"#ROSBAG V2",),
        binary=True,
        body=FLU,
        axes=_FLU_OF_ROS,
        magnetometer="T",
    ),
    LogFormat(
        "ulog",
        "logs of PX4",
        "ulog",
        "tumble inspect flight.ulg:sensor_combined",
        (".ulg", ".ulog"),
        (b"ULog\x01\x12\x35",),
        binary=True,
        extra="formats",
        firmware="px4",
        body=FRD,
        axes=_FRD,
        magnetometer="G",
    ),
    LogFormat(
        "dataflash",
        "logs of ArduPilot: DataFlash .bin, or .log as text",
        "dataflash",
        "tumble inspect flight.bin:imu_0",
        (".bin",),
        (b"\xa3\x95\x80", b"FMT, 128,", b"FMT,128,"),
        rb"(?m)^FMT, ?128, ?89,",
        extra="formats",
        firmware="ardupilot",
        body=FRD,
        axes=_FRD,
        magnetometer="mG",
    ),
    LogFormat(
        "mcap",
        "MCAP files of ROS 1 and ROS 2, of JSON and protocol buffers",
        "mcap",
        "tumble inspect drive.mcap:/imu/data",
        (".mcap",),
        (b"\x89MCAP0\r\n",),
        binary=True,
        body=FLU,
        axes=_FLU_OF_ROS,
        magnetometer="T",
    ),
    LogFormat(
        "ros2",
        "ROS 2 bags: the folder, or a .db3 file",
        "rosbag2",
        "tumble inspect drive_bag:/imu/data",
        (".db3",),
        (b"SQLite format 3\x00",),
        binary=True,
        folder_with="metadata.yaml",
        body=FLU,
        axes=_FLU_OF_ROS,
        magnetometer="T",
    ),
    LogFormat(
        "session",
        "sessions of tumble record",
        "session",
        "tumble inspect session:target_1",
        folder_with=SESSION_FILE,
        magnetometer="µT",
    ),
    LogFormat(
        "npy",
        "arrays of NumPy, .npy and .npz",
        "npy",
        "tumble inspect log.npz:imu0",
        (".npy", ".npz"),
        (b"\x93NUMPY",),
        rb"\APK\x03\x04",
        looks_inside=True,
        binary=True,
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "hdf5",
        "HDF5 files, and those of MATLAB 7.3",
        "hdf5",
        "tumble inspect log.h5:imu0",
        (".h5", ".hdf5"),
        (b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3 MAT-file"),
        binary=True,
        extra="formats",
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "mat",
        "MATLAB files of version 4, and of 5 to 7.2",
        "mat",
        "tumble inspect log.mat:imu0",
        (".mat",),
        pattern=rb"\AMATLAB 5|\A(?s:..)\x00\x00|\A\x00\x00",
        looks_inside=True,
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "tlog",
        "telemetry logs of MAVLink",
        "tlog",
        "tumble inspect flight.tlog:SCALED_IMU2",
        (".tlog",),
        pattern=rb"\A(?s:.{8})[\xfd\xfe]",
        looks_inside=True,
        extra="formats",
        body=FRD,
        axes=_FRD,
        magnetometer="mG; G of `HIGHRES_IMU`",
    ),
    LogFormat(
        "euroc",
        "EuRoC (ASL) and TUM-VI: the folder, mav0, imu0, data.csv, or dso",
        "euroc",
        "tumble inspect MH_01_easy/mav0:imu0",
        pattern=rb"(?m)^#[ \t]*timestamp.*w_RS_S_x",
        looks_inside=True,
    ),
    LogFormat(
        "kitti",
        "KITTI: the oxts folder of a drive",
        "kitti",
        "tumble inspect 2011_09_26_drive_0001_extract/oxts",
        pattern=rb"(?!)",
        looks_inside=True,
        body=FLU,
        axes=f"{in_words(FLU)}; local frame ENU",
    ),
    LogFormat(
        "vectornav",
        "VectorNav sentences: $VNIMU, $VNYMR, $VNQMR, $VNMAR, $VNRRG",
        "vectornav",
        "tumble inspect vn100.txt --rate 200",
        pattern=rb"\$VN[A-Z]{3},",
        body=FRD,
        axes=f"{in_words(FRD)}, as marked on the case; local frame NED",
        magnetometer="G",
    ),
    LogFormat(
        "xsens",
        "Xsens text of MT Manager, and of DOT",
        "xsens",
        "tumble inspect MT_0120067F-000.txt",
        pattern=rb"(?m)^(?:PacketCounter|SampleTimeFine)[\t,; ]|^Counter\t(?:.*\t)?(?:Free)?Acc_X",
        axes="as marked on the case, z up when level; local frame ENU, unless the log names another",
        magnetometer="of its own: one at the place of calibration",
    ),
    LogFormat(
        "ros_echo",
        "topics that rostopic echo -p, or ros2 topic echo as CSV, printed",
        "ros_echo",
        "tumble inspect imu_data.csv",
        pattern=rb"\A%time,.*linear_acceleration\.x|(?m:^\d+,\d+,[^,\r\n]*(?:,[^,\r\n]*){37}\r?$)",
        body=FLU,
        axes=_FLU_OF_ROS,
    ),
    LogFormat(
        "sensorlog",
        "SensorLog of iOS",
        "programs",
        "tumble inspect sensorlog.csv",
        pattern=rb"accelerometerAccelerationX",
        axes=_PHONE,
        magnetometer="µT",
    ),
    LogFormat(
        "physics_toolbox",
        "Physics Toolbox",
        "programs",
        "tumble inspect toolbox.csv",
        pattern=rb"(?m)^[^\w\n]*time.{0,9}gFx",
        axes=_PHONE,
        magnetometer="µT",
    ),
    LogFormat(
        "betaflight",
        "what blackbox_decode makes of blackbox logs of Betaflight and INAV",
        "programs",
        "tumble inspect LOG00007.01.csv",
        pattern=rb"accSmooth\[0\]",
        magnetometer="counts",
    ),
    LogFormat(
        "picoquake",
        "PicoQuake of PLab",
        "programs",
        "tumble inspect car_vibration.csv",
        pattern=rb"\A# PLab PicoQuake Data",
    ),
    LogFormat(
        "metawear",
        "MetaBase of MetaWear: a file a sensor",
        "metawear",
        "tumble inspect bench_MetaWear_C42732BE255C_Accelerometer_100.000Hz_1.4.4.csv --interpolate",
        pattern=rb"\A(?:\xef\xbb\xbf)?epoch? \(ms\),[^\r\n]*[xyz]-axis \((?:g|deg/s|T)\)",
        looks_inside=True,
        magnetometer="T",
    ),
    LogFormat(
        "phone",
        "folders of Sensor Logger and phyphox: a file a sensor",
        "phone",
        "tumble inspect recording --interpolate",
        pattern=rb"\A.{0,60}(?i:time)[^\r\n]*(?i:x)",
        looks_inside=True,
        axes=_PHONE,
        magnetometer="µT",
    ),
    LogFormat(
        "imu_tk",
        "pairs of imu_tk, *_acc.* beside *_gyro.*",
        "imu_tk",
        "tumble inspect xsens_acc.mat",
        looks_inside=True,
    ),
    LogFormat(
        "json_lines",
        "lines of JSON, an object a sample",
        "json_lines",
        "tumble inspect log.jsonl",
        (".jsonl", ".ndjson"),
        pattern=rb"\{",
        looks_inside=True,
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "labelled",
        "lines with words before the numbers, as sketches for Arduino print them",
        "labelled",
        "tumble inspect monitor.txt --rate 100",
        looks_inside=True,
        magnetometer=_BY_COLUMN,
    ),
    LogFormat(
        "csv",
        "tables of text, with or without names",
        "csv",
        "tumble inspect log.csv --accelerometer-unit g",
        (".csv", ".tsv", ".txt", ".log", ".dat"),
        magnetometer=_BY_COLUMN,
    ),
)
"""Formats in the order in which they are tried: those with first bytes of their own, then those that look
inside; the last takes what no other does."""


@dataclass(frozen=True, slots=True)
class NoLog:
    """A kind of file that is often taken for a log."""

    what: str
    remedy: str = "give a log instead"
    """Remedy that the message names."""
    begins: tuple[bytes, ...] = ()
    """First bytes of such files."""
    pattern: bytes = b""
    """Regular expression found in the first bytes of such files; in the last ones of ZIP archives too."""


_AS_CSV = "save its sheet as CSV"
_AS_TEXT = "export it as text or CSV with the maker's program"

NO_LOGS = (
    NoLog(
        "a pointer of Git LFS, which stands for the log",
        "get the log with git lfs pull",
        (b"version https://git-lfs.github.com/spec/",),
    ),
    NoLog("a PNG picture", begins=(b"\x89PNG",)),
    NoLog("a JPEG picture", begins=(b"\xff\xd8\xff",)),
    NoLog("a GIF picture", begins=(b"GIF8",)),
    NoLog("a PDF document", begins=(b"%PDF",)),
    NoLog("an Excel workbook", _AS_CSV, pattern=rb"\APK\x03\x04(?s:.)*xl/"),
    NoLog("a Word document", pattern=rb"\APK\x03\x04(?s:.)*word/"),
    NoLog("an OpenDocument spreadsheet", _AS_CSV, pattern=rb"\APK\x03\x04(?s:.)*opendocument.spreadsheet"),
    NoLog(
        "a ZIP archive",
        "unpack it with unzip, and give the folder or the log in it",
        (b"PK\x03\x04", b"PK\x05\x06"),
    ),
    NoLog("an old Excel workbook or Word document", _AS_CSV, (b"\xd0\xcf\x11\xe0",)),
    NoLog("a 7z archive", "unpack it with 7z x, and give the log in it", (b"7z\xbc\xaf\x27\x1c",)),
    NoLog("a RAR archive", "unpack it with unrar x, and give the log in it", (b"Rar!",)),
    NoLog("a tar archive", "unpack it with tar -xf, and give the log in it", pattern=rb"\A(?s:.){257}ustar"),
    NoLog("an HDF4 file", "convert it to HDF5 with h4toh5", (b"\x0e\x03\x13\x01",)),
    NoLog("a u-blox log (UBX)", "write its ESF-MEAS or ESF-RAW messages as CSV with pyubx2", (b"\xb5\x62",)),
    NoLog(
        "a RINEX file of a satellite receiver, which holds no IMU", pattern=rb"\A.{60}RINEX VERSION / TYPE"
    ),
    NoLog(
        "NMEA sentences of a satellite receiver, which hold no IMU",
        pattern=rb"\A\$G[A-Z](GGA|RMC|GSV|GSA|GLL|VTG|ZDA|GNS),",
    ),
    NoLog(
        "a video",
        "where camera or drone put its IMU into it, write that as CSV with gpmf-extract or telemetry-parser",
        (b"\x1aE\xdf\xa3",),
        rb"\A(?s:.){4}ftyp|\ARIFF(?s:.){4}AVI ",
    ),
    NoLog("a sound file", begins=(b"ID3", b"fLaC", b"OggS"), pattern=rb"\ARIFF(?s:.){4}WAVE"),
    NoLog(
        "a DJI flight record",
        "convert it to CSV with DatCon",
        pattern=rb"\A(?s:.){16}BUILD|\A(?s:.){0,300}DJI_LOG_V",
    ),
    NoLog(
        "a Betaflight or INAV blackbox log",
        "convert it with blackbox_decode --unit-rotation deg/s --unit-acceleration g, and give its CSV",
        (b"H Product:Blackbox",),
    ),
    NoLog("a binary Xsens log", "export it as text with MT Manager", (b"\xfa\xff",)),
    NoLog(
        "a NovAtel binary log",
        "write its RAWIMU messages as CSV with NovAtel Convert",
        (b"\xaa\x44\x12", b"\xaa\x44\x13"),
    ),
    NoLog(
        "a NovAtel ASCII log",
        "write its RAWIMU or CORRIMU messages as CSV with NovAtel Convert, and name them with --columns",
        pattern=rb"\A[#%][A-Z][A-Z0-9]*A,[^\n]*;[^\n]*\*[0-9a-fA-F]{8}",
    ),
    NoLog(
        "a binary WitMotion log",
        "export it as text with WitMotion's program",
        pattern=rb"\A(?:\x55[\x50-\x5a](?s:.){9}){3}",
    ),
    NoLog("a TDMS file of LabVIEW", "write it as CSV with npTDMS", (b"TDSm",)),
    NoLog("an ASAM MDF file", "write it as CSV or Parquet with asammdf", (b"MDF     ",)),
    NoLog("a CAN log of Vector", "write it as CSV with asammdf or python-can", (b"LOGG",)),
    NoLog(
        "a capture of a network",
        _AS_TEXT,
        (b"\xd4\xc3\xb2\xa1", b"\xa1\xb2\xc3\xd4", b"\x0a\x0d\x0d\x0a"),
    ),
    NoLog("a ROS 1 bag of before 2010", "bring it up to date with rosbag fix", (b"#ROSBAG V1",)),
    NoLog("a point cloud", begins=(b"LASF", b"# .PCD")),
    NoLog(
        "a Python pickle, which may run any code when it is read",
        "save the arrays as .npz or Parquet",
        pattern=rb"\A\x80[\x02-\x05][\x95c}\](]",
    ),
    NoLog("a program", begins=(b"\x7fELF", b"MZ\x90")),
)
"""Kinds of files that are known not to be logs, the narrower kinds first."""

AXES_OF = {each.name: each.axes for each in LOG_FORMATS}
"""Directions of the axes of each format, in words; empty where it defines none."""
BODY_OF = {each.name: each.body for each in LOG_FORMATS}
"""Directions of the axes of each format in a vehicle; empty where it defines none."""

FIRMWARE_OF = {each.name: each.firmware for each in LOG_FORMATS if each.firmware}
"""Formats whose logs hold the parameters by which firmware corrected, and whose they are."""

LOG_SUFFIXES = frozenset(ending for each in LOG_FORMATS for ending in each.endings)
"""Endings of the names of logs, which distinguish them from other files of a folder."""


@dataclass(frozen=True, slots=True)
class Packing:
    """A way in which files are packed."""

    name: str
    """Name, as in `pyarrow.CompressedInputStream`, except for xz."""
    ending: str
    unpack: str
    """The program that unpacks it."""


PACKINGS: Mapping[bytes, Packing] = {
    b"\x1f\x8b": Packing("gzip", ".gz", "gunzip"),
    b"BZh": Packing("bz2", ".bz2", "bunzip2"),
    b"\x28\xb5\x2f\xfd": Packing("zstd", ".zst", "unzstd"),
    b"\xfd7zXZ\x00": Packing("xz", ".xz", "unxz"),
}
"""Packings by their first bytes."""


def packing_of(head: bytes) -> Packing | None:
    """Returns the packing of a file that begins like this; None where it is not packed."""
    return next((packing for magic, packing in PACKINGS.items() if head.startswith(magic)), None)


def stem_of(path: Path) -> str:
    """Returns the name of a file without its ending, nor that of its packing: `log` of `log.csv.gz`.

    Bytes that are no UTF-8 are escaped, as it names units in results.
    """
    return in_utf8(Path(_unpacked(path)).stem)


def has_log_ending(path: Path) -> bool:
    """Returns whether the name of a file in a folder is that of a log."""
    return Path(_unpacked(path)).suffix.lower() in LOG_SUFFIXES


def _unpacked(path: Path) -> str:
    packed = path.suffix.lower() in {packing.ending for packing in PACKINGS.values()}
    return path.stem if packed else path.name
