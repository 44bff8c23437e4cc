"""A bench without hardware: a rate table that turns itself, units that are heard live, and their calibration.

python examples/06_live_bench.py

Table and units are simulated, behind real sockets. Of real ones only the addresses differ.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence

import numpy as np

import tumble
from tumble.live import LiveChunk, open_source
from tumble.simulate import LiveSimulation
from tumble.spin.live import LiveSpin, LiveSpinOptions
from tumble.table import GuardedTable, open_table
from tumble.table.plan import PosePlan, plan_poses

SPEED = 20.0
"""Simulated s in one of ours; leave it at 1 with a real table."""
REST = 4.0
"""s at each pose."""
ON_ITS_WAY = 2.0
"""s of ours for which samples may be on their way on a busy computer."""


class Listener(threading.Thread):
    """Keeps the samples of a unit until it is told to end."""

    def __init__(self, name: str, address: str) -> None:
        super().__init__(name=name, daemon=True)
        self.ended = threading.Event()
        self._address = address
        self._chunks: list[LiveChunk] = []

    def run(self) -> None:
        """Listen."""
        with open_source(self._address) as source:
            for chunk in source:
                if len(chunk):
                    self._chunks.append(chunk)
                if self.ended.is_set():
                    return

    def recording(self) -> tumble.Recording:
        """Give what was heard."""
        times, forces, rates = (
            np.concatenate([getattr(chunk, name) for chunk in self._chunks])
            for name in ("time", "accelerometer", "gyroscope")
        )
        return tumble.Recording.from_arrays(self.name, times, forces, rates)


def turn(address: str, plan: PosePlan) -> None:
    """Take a table through a plan, resting at each stop."""
    with GuardedTable(open_table(address), armed=True) as table:
        for stop in plan.route:
            table.goto(stop)
            table.wait()
            time.sleep(REST / SPEED)


def listen_while_turning(bench: LiveSimulation, plan: PosePlan) -> list[tumble.Recording]:
    """Listen to all units while the table goes through a plan."""
    listeners = [Listener(name, address) for name, address in bench.addresses.items()]
    for listener in listeners:
        listener.start()
    assert bench.table_address is not None
    turn(bench.table_address, plan)
    time.sleep(ON_ITS_WAY)
    for listener in listeners:
        listener.ended.set()
        listener.join()
    return [listener.recording() for listener in listeners]


def calibrate_on_a_table() -> None:
    """Calibrate two units against a third, and compare with the truth."""
    bench = LiveSimulation(
        seed=7,
        grades=("reference", "consumer", "industrial"),
        transport="tcp",
        rate_hz=100.0,
        speed=SPEED,
        port=0,
        table_port=0,
    )
    with bench:
        assert bench.table is not None
        plan = plan_poses(bench.table.axes, REST)
        print(f"{len(plan.angles)} poses, {len(plan.turns)} turns, {plan.seconds:.0f} s of the table")
        reference, *targets = listen_while_turning(bench, plan)
    result = tumble.turntable(reference, targets, poses=plan.poses(), g_sensitivity=True)
    print(result)
    for target in result.targets:
        show_errors(target, bench.truth["units"][target.name])


def show_errors(target: tumble.TargetResult, truth: dict[str, dict[str, Sequence[object]]]) -> None:
    """Print how far the matrices are from the truth, and make sure that sigmas cover it."""
    for name, found in (("accelerometer", target.accelerometer), ("gyroscope", target.gyroscope)):
        assert found is not None, target.failure
        error = np.abs(found.M - np.array(truth[name]["M"]))
        sigma = np.sqrt(np.diagonal(found.covariance)[:9]).reshape(3, 3)
        print(
            f"{target.name}: {name}: error of M at most {error.max():.1e}, {(error / sigma).max():.1f} sigma"
        )
        assert (error < 6.0 * sigma).all()


def calibrate_a_robot() -> None:
    """Find the biases of a robot that turns on the spot, as it does."""
    with (
        LiveSimulation(
            seed=7, motion="spin", transport="tcp", rate_hz=100.0, speed=SPEED / 2, rest_seconds=40.0, port=0
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
    calibrate_on_a_table()
    calibrate_a_robot()


if __name__ == "__main__":
    main()
