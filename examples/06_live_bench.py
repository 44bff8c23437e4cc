"""A bench without hardware: a rate table that turns itself, units received live, and their calibration.

python examples/06_live_bench.py

Table and units are simulated, behind real sockets. Real ones differ in their addresses only. On a computer
too slow for so many simulated s in one of ours it ends with one line, and exit code 3.
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import tumble
from tumble.live import open_set, open_source
from tumble.poses.pose_list import SIX_FACES
from tumble.procedures.spin.live import LiveSpin, LiveSpinOptions
from tumble.procedures.turntable.live import LiveTurntable
from tumble.procedures.turntable.table_plan import turned_table
from tumble.tools.simulate import LiveSimulation

SPEED = 8.0
"""Simulated s in one of ours; leave it at 1 with a real table."""
REST = 4.0
"""s at each pose."""
TOO_LATE = 0.1
"""s by which a thread that sleeps wakes late on a computer too busy for this."""


class SleepWatch(threading.Thread):
    """Measures by how much a thread that sleeps wakes late."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.latest = 0.0
        """s."""

    def run(self) -> None:
        """Sleeps and looks, until the program ends."""
        while True:
            begun = time.monotonic()
            time.sleep(0.01)
            self.latest = max(self.latest, time.monotonic() - begun - 0.01)


def lead_through_a_session(bench: LiveSimulation, folder: Path) -> Path:
    """Turns the table to each pose, listens to all units, and records them; the recording is given."""
    assert bench.table_address is not None
    turned = turned_table(bench.table_address, "", REST, SIX_FACES, turns=True)
    print("\n".join(turned.lines()))
    words = [f"{name}={address}" for name, address in bench.addresses.items()]
    with turned.entered() as drive:
        live = LiveTurntable(
            open_set(words, keep_going=True),
            folder,
            sources=bench.addresses,
            poses=turned.poses,
            pose_seconds=REST,
            turns=False,  # Those of the plan do.
            driver=drive,
        )
        for step in live.steps():
            if step.kind not in ("progress", "listening"):
                print(step.kind, step.subject, step.text)
    return live.session


def calibrate_on_a_table(folder: Path) -> None:
    """Calibrates two units against a third, and compares with the truth."""
    bench = LiveSimulation(
        seed=7,
        grades=("reference", "consumer", "industrial"),
        transport="tcp",
        rate_hz=50.0,
        speed=SPEED,
        port=0,
        table_port=0,
    )
    with bench:
        session = lead_through_a_session(bench, folder)
    targets = [f"{session}:{name}" for name in bench.addresses if name != "reference"]
    result = tumble.turntable(f"{session}:reference", targets, g_sensitivity=True)
    print(result)
    for target in result.targets:
        show_errors(target, bench.truth["units"][target.name])


def show_errors(target: tumble.TargetResult, truth: dict[str, dict[str, Sequence[object]]]) -> None:
    """Prints how far the matrices are from the truth, and makes sure that sigmas cover it."""
    for name, found in (("accelerometer", target.accelerometer), ("gyroscope", target.gyroscope)):
        assert found is not None, target.failure
        error = np.abs(found.M - np.array(truth[name]["M"]))
        sigma = np.sqrt(np.diagonal(found.covariance)[:9]).reshape(3, 3)
        print(
            f"{target.name}: {name}: error of M at most {error.max():.1e}, {(error / sigma).max():.1f} sigma"
        )
        assert (error < 6.0 * sigma).all()


def calibrate_a_robot() -> None:
    """Finds the biases of a robot that turns on the spot, as it does."""
    with (
        LiveSimulation(
            seed=7, motion="spin", transport="tcp", rate_hz=100.0, speed=SPEED, rest_seconds=40.0, port=0
        ) as bench,
        open_source(bench.addresses["imu"]) as source,
    ):
        live = LiveSpin(source, LiveSpinOptions(still=5.0, turns=2.0))
        for step in live.steps():
            if step.kind != "progress":
                print(step.kind)
    error = live.result().spins[0].level_free.value - bench.truth["accelerometer_bias"]
    print(f"error of the accelerometer bias: {1e3 * np.linalg.norm(error[:2]):.1f} mm/s^2")
    assert np.linalg.norm(error[:2]) < 0.03


def main() -> None:
    """A table, then a robot."""
    watch = SleepWatch()
    watch.start()
    try:
        with tempfile.TemporaryDirectory() as folder:
            calibrate_on_a_table(Path(folder))
        calibrate_a_robot()
    except (AssertionError, tumble.TumbleError) as error:
        if watch.latest < TOO_LATE:
            raise
        print(
            f"this computer was too slow: it woke {watch.latest:.2f} s late, {SPEED * watch.latest:.1f} "
            f"s of the bench; end other programs or set SPEED to 1 ({type(error).__name__}: {error})",
            file=sys.stderr,
        )
        sys.exit(3)


if __name__ == "__main__":
    main()
