"""Given cases that once went wrong: the figure of each as it was, and as it is now.

`python -m benchmarks.cases`

Data: `../shared/data/cases` and `../shared/data/live_session_busy`, whose truth is known; then the answers to
the recordings of others in `../shared/data/world`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from rich.console import Console

import tumble
from benchmarks import world_cases
from benchmarks.results import Content, machine, save
from benchmarks.settings import design_scenario
from tumble.foundation.recording import FloatArray, Recording
from tumble.foundation.results import TriadResult
from tumble.live.address import parse_address
from tumble.live.readings import Readings
from tumble.live.reordering import ReorderBuffer
from tumble.live.text import TextLine
from tumble.logs.options import ReadOptions
from tumble.logs.track import RawSamples
from tumble.procedures.turntable.result import TargetResult, TurntableResult
from tumble.tools.simulate import LiveSimulation, simulate_turntable

DATA = Path(__file__).parents[2] / "shared" / "data"
CASES = DATA / "cases"
RADIANS = ReadOptions(gyroscope_unit="rad/s")
OWN_AXES = (0, 3, 4, 6, 7, 8, 9, 10, 11)
"""Free elements of [M row by row, b] of an accelerometer in its own axes."""
ALL = tuple(range(12))
WRONG_SCALE = 1.7e-3
"""By which the gyroscope of an uncalibrated reference is off."""
JITTER = 5e-3
"""s, by which datagrams are late at most."""
DATAGRAMS, JUNK_PER_SAMPLE = 2000, 200


def truth_of(case: str) -> Any:  # noqa: ANN401
    """The truth of a case."""
    return yaml.safe_load((CASES / case / "truth.yaml").read_text(encoding="utf-8"))


def sigmas_off(triad: TriadResult, known: Mapping[str, Any], free: Sequence[int] = ALL) -> FloatArray:
    """Errors of M and b in stated sigmas."""
    error = np.concatenate([(triad.M - known["matrix"]).ravel(), triad.b - known["bias"]])[list(free)]
    sigmas: FloatArray = error / np.sqrt(np.diag(triad.covariance)[list(free)])
    return sigmas


def gyroscope_of(target: TargetResult) -> TriadResult:
    """The gyroscope of a target; raises `RuntimeError` where it was not calibrated."""
    if target.gyroscope is None:
        raise RuntimeError(f"{target.name}: {target.failure or 'has no gyroscope'}")
    return target.gyroscope


def _turntable(case: str) -> tuple[TurntableResult, Any]:
    folder = CASES / case
    return tumble.turntable(folder / "ref.parquet", folder / "dut.parquet"), truth_of(case)["dut"]


def _largest(sigmas: FloatArray) -> str:
    return f"{np.abs(sigmas).max():.1f} sigma"


def rate_table_const20() -> str:
    """Largest error of the gyroscope."""
    result, truth = _turntable("rate_table_const20")
    return _largest(sigmas_off(gyroscope_of(result.targets[0]), truth["gyroscope"]))


def rate_table_stairs30() -> str:
    """Largest sigma of the gyroscope's scale."""
    result, _ = _turntable("rate_table_stairs30")
    scales = [p for p in gyroscope_of(result.targets[0]).parameters if p.name.startswith("scale")]
    return f"± {1e6 * max(scale.sigma for scale in scales):.0f} ppm"


def stamp_jitter4() -> str:
    """Largest error of the gyroscope."""
    result, truth = _turntable("stamp_jitter4")
    return _largest(sigmas_off(gyroscope_of(result.targets[0]), truth["gyroscope"]))


def live_session_busy() -> str:
    """Largest error of the matrices of the gyroscopes."""
    session = DATA / "live_session_busy"
    targets = [f"{session}:target_{number}" for number in (1, 2)]
    result = tumble.turntable(f"{session}:reference", targets, g_sensitivity=True)
    with LiveSimulation(
        seed=7, grades=("reference", "consumer", "industrial"), transport="tcp", rate_hz=100.0, port=0
    ) as bench:
        units = bench.truth["units"]
    off = [
        sigmas_off(
            gyroscope_of(target), {"matrix": units[target.name]["gyroscope"]["M"], "bias": 0.0}, range(9)
        )
        for target in result.targets
    ]
    return _largest(np.concatenate(off))


def uncalibrated_reference() -> str:
    """Error of the gyroscope's scale where the reference is off, beside a grade and without."""
    played = simulate_turntable(design_scenario())
    reference, target = played.units
    samples = reference.samples
    wrong = Recording.from_arrays(
        "reference",
        samples.time,
        samples.accelerometer,
        samples.gyroscope * (1.0 + WRONG_SCALE),
        clock="turntable",
    )
    off = []
    for grade in (None, "industrial"):
        result = tumble.turntable(wrong, [target.recording], reference_grade=grade)
        scales = gyroscope_of(result.targets[0]).parameters[3:6]
        errors = np.array([p.value for p in scales]) - np.diag(target.gyroscope.K)
        off.append(np.abs(errors / [p.sigma for p in scales]).max())
    return f"{off[1]:.1f} sigma by grade industrial; reported as relative without ({off[0]:.0f})"


def thermal_hysteresis() -> str:
    """Largest difference of warming and cooling of accelerometer z."""
    result = tumble.thermal(CASES / "thermal_hysteresis" / "oven.parquet", read=RADIANS)
    found = result["accelerometer z"].hysteresis
    return f"{1e3 * found.value:.1f} ± {1e3 * found.sigma:.1f} mm/s²"


def noise_step() -> str:
    """White noise of the accelerometer axis that steps, over its truth."""
    result = tumble.noise(CASES / "noise_step" / "still.parquet", read=RADIANS)
    found = result["accelerometer x"].term("white noise").value
    return f"{100 * (found / truth_of('noise_step')['accelerometer']['noise_density_m_s2_rtHz'] - 1):+.1f} %"


def _multipose(case: str) -> str:
    found, truth = tumble.multipose(CASES / case / "hand.parquet", read=RADIANS), truth_of(case)
    if found.gyroscope is None:
        return f"{len(found.poses)} poses, no gyroscope"
    off = [
        sigmas_off(found.accelerometer, truth["accelerometer"], OWN_AXES),
        sigmas_off(found.gyroscope, truth["gyroscope"]),
    ]
    return f"{len(found.poses)} poses, {len(found.turns)} turns, {_largest(np.concatenate(off))}"


def reordered_datagrams() -> str:
    """Share of samples lost where datagrams are late by up to 5 ms, at 200 Hz."""
    rng = np.random.default_rng(27)
    stamps = np.arange(DATAGRAMS) / 200.0
    arrivals = 100.0 + stamps + JITTER * rng.uniform(0.0, 2.0, DATAGRAMS)
    buffer, kept = ReorderBuffer(0.05), 0
    for k in np.argsort(arrivals, kind="stable"):
        values = np.full((1, 3), stamps[k])
        readings = Readings(
            RawSamples(stamps[k : k + 1], values, values, stamps[k : k + 1]), stamps[k : k + 1]
        )
        kept += len(buffer.push(readings, arrivals[k])[0])
    kept += len(buffer.due(arrivals.max() + 1.0)[0])
    return _lost(DATAGRAMS - kept, DATAGRAMS)


class _Backlog:
    """Datagrams that wait in a socket, each with its sender."""

    whole, joined_midway, reorder_window, unread, notices = True, False, 0.0, 0, ()

    def __init__(self) -> None:
        self.sender: tuple[str, int] | None = None
        self.waiting: list[tuple[tuple[str, int], bytes]] = []

    def receive(self) -> bytes:
        if not self.waiting:
            return b""
        self.sender, datagram = self.waiting.pop(0)
        return datagram


def junk() -> str:
    """Share of a device's samples lost among 20,000 messages of junk a second."""
    device, other = ("127.0.0.1", 5000), ("127.0.0.1", 6000)
    transport: Any = _Backlog()
    address = parse_address("udp://:9000")
    source = TextLine(address, RADIANS, transport, "udp").unit(address, RADIANS)
    source.line.units.append(source)
    sent, kept = 200, 0
    for number in range(sent):
        sample = b'{"t": %f, "acc": [0.1, 0.2, 9.8], "gyro": [0, 0.01, 0]}' % (number / 100.0)
        transport.waiting += [(other, b"junk " * 20)] * (JUNK_PER_SAMPLE if number >= 50 else 0)
        transport.waiting.append((device, sample))
    while transport.waiting:
        kept += len(source.read())
    kept += len(source.read())
    return _lost(sent - kept, sent)


def _lost(lost: int, of: int) -> str:
    return f"{100.0 * lost / of:.3g} % lost"


ROWS: tuple[tuple[str, str, str, Callable[[], str]], ...] = (
    ("rate table, 20 deg/s", "largest error of the gyroscope", "15 sigma", rate_table_const20),
    ("rate table, 30 deg/s", "gyroscope's scale, 1-sigma", "± 110 %", rate_table_stairs30),
    ("stamps 0 to 4 ms late", "largest error of the gyroscope", "7.1 sigma", stamp_jitter4),
    ("busy computer", "largest error of the gyroscopes", "8 sigma", live_session_busy),
    (
        "reference with an error of 0.17 %",
        "error of the gyroscope's scale",
        "57 sigma",
        uncalibrated_reference,
    ),
    ("hysteresis, truth 90 mm/s²", "largest difference", "25.4 ± 3.2 mm/s²", thermal_hysteresis),
    ("one step in an hour", "error of white noise", "+14 %", noise_step),
    (
        "multi-pose, 32 clipped samples",
        "poses, turns, largest error",
        "22 poses, no gyroscope",
        lambda: _multipose("multipose_clipped"),
    ),
    (
        "multi-pose, hands that tremble",
        "poses, turns, largest error",
        "6 poses, refused",
        lambda: _multipose("multipose_tremor"),
    ),
    ("datagrams 5 ms out of order", "samples", "19 % lost", reordered_datagrams),
    ("20,000 messages of junk a second", "samples", "87 % lost", junk),
)
"""Case, figure, its value before, and how it is found now."""


def rows() -> Iterator[Content]:
    """Measure every case."""
    for case, figure, before, now in ROWS:
        yield {"case": case, "figure": figure, "before": before, "now": now()}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-save", action="store_true", help="print only")
    options = parser.parse_args(arguments)
    console = Console()
    content: Content = {"machine": machine(), "rows": []}
    for row in rows():
        content["rows"].append(row)
        console.print(row)
    content["world"] = []
    for row in world_cases.rows():
        content["world"].append(row)
        console.print(f"{row['case']}: {row['missing'] or 'right'}")
    if not options.no_save:
        console.print(f"written to {save('cases', content)}")


if __name__ == "__main__":
    main()
