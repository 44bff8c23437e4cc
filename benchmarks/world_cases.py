"""Recordings of others, and sessions of held-out simulators: the answer each needs, and the one it gets.

A row types a command on the files of a folder of `../shared/data/world`, whose `truth.yaml` has the source
and the right answer, and compares exit code and text. `python -m benchmarks.cases` prints them all.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.results import Content

WORLD = Path(__file__).parents[2] / "shared" / "data" / "world"


@dataclass(frozen=True, slots=True)
class WorldCase:
    """A command on the files of a folder, and what its answer needs to hold."""

    folder: str
    command: str
    """Words behind `tumble`, as a shell splits them."""
    code: int
    says: tuple[str, ...]
    """Patterns, each of which stands somewhere in what is printed, lines joined by blanks."""
    never: tuple[str, ...] = ()
    """Patterns none of which does."""

    @property
    def name(self) -> str:
        """Name in tables and of tests."""
        return f"{self.folder}: {self.command.split()[0]}"


_RAW = "gravity was removed from it; record the raw acceleration"
CASES = (
    WorldCase(
        "bag_first_stamps_zero",
        "inspect stamp_zero_first30.bag",
        0,
        (r"1152 samples over 46\.0", "left out 30 samples with the stamp 0"),
        ("gap of", "e[+]09"),
    ),
    WorldCase("bag_gravity_removed", "inspect gravity_removed.bag", 0, (_RAW,)),
    WorldCase("bag_gravity_removed", "spin gravity_removed.bag -o out", 2, (_RAW,)),
    WorldCase("bag_gyroscope_in_degrees", "inspect gyr_in_deg.bag", 2, ("--gyroscope-unit deg/s",)),
    WorldCase(
        "bag_one_triad_only",
        "inspect accelerometer_only.bag",
        0,
        ("gyroscope not recorded", "gyroscope holds no number, and is left out"),
    ),
    WorldCase(
        "bag_stamp_and_field_beside_embedded_imu",
        "inspect outer_header.bag",
        0,
        (r"jitter 0\.0", r"magnetometer .* in T .*47\.2"),
    ),
    WorldCase(
        "bag_two_imus_on_one_topic", "spin two_imus_one_topic.bag -o out", 2, ("left_imu", "right_imu")
    ),
    WorldCase("betaflight_raw_blackbox", "inspect LOG00003.BFL", 2, ("blackbox_decode",)),
    WorldCase(
        "clocks_30ppm_three_units",
        "redundancy --primary primary.csv.gz --secondary secondary_1.csv.gz --secondary secondary_2.csv.gz "
        "--settings units.yaml -o out",
        0,
        (),
        ("unhealthy", "clocks? of (its|their) own"),
    ),
    WorldCase("columns_of_pair", "inspect VID_1_gyro.csv", 0, ("700 samples over 1.398 s, 500 Hz",)),
    WorldCase(
        "columns_of_pair",
        "inspect VID_1_gyro.csv --columns gx=1,gy=2,gz=3,time=4",
        0,
        ("700 samples over 1.398 s, 500 Hz",),
    ),
    WorldCase("csv_one_hertz_read_as_ms", "inspect log.csv", 0, ("76 samples over 74.99",)),
    WorldCase("db3_left_in_wal", "inspect drive_0.db3", 0, ("400 samples over 15.96 s", "was not closed")),
    WorldCase(
        "faces_folder_up_down",
        "multipose poses --faces -o out",
        3,
        (r"bias x +0\.099", r"bias y +-0\.199", r"bias z +0\.2996"),
    ),
    WorldCase(
        "flexing_fixture",
        "turntable reference.csv.gz target.csv.gz -o out",
        0,
        ("residuals go with the face that is up",),
        ("warm",),
    ),
    WorldCase(
        "frozen_at_rest_two_units",
        "redundancy --primary primary.csv.gz --secondary secondary_1.csv.gz --settings units.yaml -o out",
        3,
        ("frozen",),
        ("secondary_1 .*isolated",),
    ),
    WorldCase("git_lfs_pointer", "inspect imu.csv", 2, ("git lfs pull",)),
    WorldCase(
        "gyro_noise_x20_four_units",
        "redundancy --primary primary.csv.gz --secondary secondary_1.csv.gz --secondary secondary_2.csv.gz "
        "--secondary secondary_3.csv.gz --settings units.yaml -o out",
        3,
        ("primary.*noisy",),
    ),
    WorldCase(
        "held_poses_in_planes",
        "multipose cal.csv --counts 2,250 -o out",
        2,
        ("leave open: response of axis y along x",),
    ),
    WorldCase(
        "large_bias_counts",
        "multipose poses --faces --counts 2,250 -o out",
        3,
        (r"bias x +-0\.49", r"bias y +-8\.82", r"bias z +-8\.1[34]"),
    ),
    WorldCase("mcap_cut_by_power_loss", "inspect cut.mcap", 0, ("853 samples", "the file breaks off")),
    WorldCase(
        "noise_gyroscope_in_degrees_unnamed",
        "noise rest.csv -o out",
        3,
        (r"gyroscope_noise_density: 1\.[12]\d*e-04",),
    ),
    WorldCase(
        "noise_rate_unit_assumed",
        "noise static.csv -o out",
        3,
        (r"gyroscope_noise_density: 8\.[678]\d*e-05",),
    ),
    WorldCase(
        "one_hertz_flight_taken_for_rest", "inspect sensor_0.csv", 0, ("0 rests",), ("damaged", "noise: yes")
    ),
    WorldCase("one_hertz_flight_taken_for_rest", "noise sensor_0.csv -o out", 2, ("never stands still",)),
    WorldCase(
        "poses_in_a_plane",
        "turntable reference.csv.gz target.csv.gz --poses none -o out",
        2,
        ("too few directions",),
    ),
    WorldCase("quantised_g", "turntable reference.csv.gz target.csv.gz -o out", 2, ("too few directions",)),
    WorldCase("quantised_log", "turntable reference.csv.gz target.csv.gz -o out", 0, ("resolution",)),
    WorldCase(
        "rate_table_three_faces",
        "turntable reference.csv.gz target.csv.gz --poses none -o out",
        0,
        ("Calibrated gyroscope", "too few directions: the accelerometer is not calibrated"),
    ),
    WorldCase(
        "raw_counts_near_1000_a_g",
        "multipose counts_1024.csv --raw -o out",
        0,
        ("14 rests in 14 orientations, 13 turns",),
    ),
    WorldCase("raw_quiet_gyroscope", "multipose counts_131.csv --raw -o out", 0, ("13 turns between",)),
    WorldCase(
        "redundancy_constant_bias_in_motion",
        "redundancy --primary imu_0.csv --secondary imu_1.csv --secondary imu_2.csv --secondary imu_3.csv "
        "-o out",
        3,
        ("imu_2.*(disagree|out of family|unhealthy|isolated)",),
    ),
    *(
        WorldCase(
            folder,
            "redundancy --primary imu_0.csv --secondary imu_1.csv --secondary imu_2.csv -o out",
            code,
            says,
            never,
        )
        for folder, code, says, never in (
            ("redundancy_lagging_gyroscope_blamed", 3, (), ("unhealthy", "out of family")),
            ("redundancy_logs_end_apart", 3, (), ("unhealthy", "took over")),
            ("redundancy_primary_starts_67ms_late", 3, (), ("took over", "unhealthy")),
            ("redundancy_primary_wrong_at_rest_kept", 3, ("imu_0",), ()),
            (
                "redundancy_secondary_follows_wrong_primary",
                3,
                ("imu_0.*(disagree|unhealthy)",),
                ("imu_1 adopted",),
            ),
        )
    ),
    WorldCase(
        "redundancy_third_unit_bias_jumps",
        "redundancy --primary imu_0.csv.gz --secondary imu_1.csv.gz --secondary imu_2.csv.gz -o out",
        3,
        ("imu_2.*(unhealthy|isolated)",),
        ("nobody knows",),
    ),
    WorldCase(
        "redundancy_third_unit_bias_jumps",
        "align --primary imu_0.csv.gz --secondary imu_1.csv.gz --secondary imu_2.csv.gz -o out",
        0,
        (r"imu_2: the accelerometers would be turned by 12.* all sigmas are widened", "24.94 Hz"),
    ),
    WorldCase(
        "reference_drifts",
        "turntable reference.csv.gz target.csv.gz -o out",
        0,
        ("Warning: reference: its accelerometer biases drifted", "settling within"),
        ("target: accelerometer biases drifted",),
    ),
    WorldCase("rests_of_few_samples", "multipose poses --rate 2 --faces -o out", 3, (r"bias z +-1\.5",)),
    WorldCase(
        "slipped_0.1deg",
        "turntable reference.csv.gz target.csv.gz -o out",
        0,
        (r"target: slipped by 0\.10\d ± 0\.005 deg", "rest 8"),
        ("flexes",),
    ),
    WorldCase("spin_gyroscope_bias_changes_after_turn", "spin spin.csv -o out", 2, ("bias z .*differs",)),
    WorldCase("thermal_rate_unit_assumed", "thermal warm.csv -o out", 0, (r"gyroscope x +3 +17\.3[78]",)),
    WorldCase("thermal_raw_temperature", "thermal warm_counts.csv -o out", 2, ("-15820 to 7980",)),
    WorldCase("thermal_raw_temperature", "thermal warm_kelvin.csv -o out", 0, ("-10.0 to 60.0", "read in K")),
    WorldCase("time_unit_slow_log", "inspect ms_10hz.csv", 0, ("over 149.9 s, 10 Hz",)),
    WorldCase("time_unit_slow_log", "noise ms_2hz.csv -o out", 2, ("--time-unit",)),
    WorldCase("time_unit_slow_log", "noise s_1hz.csv -o out", 2, ("--time-unit",)),
    WorldCase("trailing_tab", "inspect sketch.txt", 0, ("500 samples over 4.99 s, 100 Hz",)),
    WorldCase(
        "triad_of_zeros", "noise accelerometer_only.csv -o out", 3, (r"1\.9\d*e-03|2\.0\d*e-03", "left out")
    ),
    WorldCase(
        "triad_of_zeros", "inspect realsense.bag:/camera/gyro/sample", 0, ("accelerometer is 0 in all",)
    ),
    WorldCase(
        "unit_of_named_column", "noise wit_en.txt -o out", 3, (r"gyroscope_noise_density: 8\.[678]\d*e-05",)
    ),
    WorldCase(
        "unit_of_named_column",
        "noise wit_en.txt --columns gx=AsX(°/s),gy=AsY(°/s),gz=AsZ(°/s) -o out",
        3,
        (r"gyroscope_noise_density: 8\.[678]\d*e-05",),
    ),
    WorldCase("unit_of_named_column", "inspect wit_zh.txt", 0, ("700 samples", "deg/s")),
    WorldCase("unread_gyroscope_columns", "inspect rpm.csv", 0, ("gyroscope in rpm",)),
    WorldCase("xsens_dot_without_counter", "inspect DOT.csv", 0, ("120 Hz", "gyroscope in deg/s")),
    WorldCase("xyz_without_quantity", "inspect explorer.csv", 2, ("--columns ax=X,ay=Y,az=Z",)),
    WorldCase(
        "xyz_without_quantity",
        "multipose pose_means.txt --columns ax=1,ay=2,az=3 --rate 1 --accelerometer-unit g -o out",
        2,
        ("give --pose-means",),
    ),
    WorldCase(
        "xyz_without_quantity",
        "multipose pose_means.txt --columns ax=1,ay=2,az=3 --accelerometer-unit g --pose-means -o out",
        3,
        (r"bias x +0\.26478", r"scale y +103\.2000"),
    ),
)
"""Answers that are right; a folder may need several."""

OPEN = frozenset(
    {
        "frozen_at_rest_two_units: redundancy",
        "gyro_noise_x20_four_units: redundancy",
        "redundancy_constant_bias_in_motion: redundancy",
        "redundancy_lagging_gyroscope_blamed: redundancy",
        "redundancy_logs_end_apart: redundancy",
        "redundancy_third_unit_bias_jumps: redundancy",
    }
)
"""Cases whose answer is not right yet; the benchmark prints what is missing of each."""


def failing(case: WorldCase, code: int, printed: str) -> str:
    """Returns the first thing in which an answer is not the right one; empty where it is."""
    line = " ".join(printed.replace("\N{MINUS SIGN}", "-").split())
    if code != case.code:
        return f"exit {code}, not {case.code}"
    for pattern in case.says:
        if not re.search(pattern, line):
            return f"does not say {pattern!r}"
    return next((f"says {pattern!r}" for pattern in case.never if re.search(pattern, line)), "")


def answer(case: WorldCase, folder: Path) -> tuple[int, str]:
    """Returns exit code and text of a command typed in a folder with the files of its case."""
    shutil.copytree(WORLD / case.folder, folder, dirs_exist_ok=True)
    plain = {**os.environ, "COLUMNS": "200", "NO_COLOR": "1", "TUMBLE_LANG": "en"}
    command = [sys.executable, "-m", "tumble", *case.command.split()]
    done = subprocess.run(command, cwd=folder, env=plain, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


def rows() -> Iterator[Content]:
    """Types every command, and yields what is missing of its answer."""
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder:
            missing = failing(case, *answer(case, Path(folder)))
        yield {"case": case.name, "command": f"tumble {case.command}", "missing": missing}
