"""Every recording of others through the procedures that need no equipment: a result, or why there is none.

`python -m benchmarks.no_equipment`

Anything but a result or a refusal in one line ends it, and so does a result that contradicts what is known.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import tumble
from benchmarks.multipose import DATA, MPU_9150, recordings
from benchmarks.results import Content, machine, save
from tumble.foundation.plain import finite
from tumble.foundation.recording import RecordingSource
from tumble.logs import ReadOptions
from tumble.procedures.multipose.procedure import as_counts

PROCEDURES = ("multipose", "noise", "thermal")

GYROSCOPE_NOISE = {"mpu6050 static_449s": (0.0076, 0.0113)}
"""deg/s/sqrt(Hz), as who recorded it has it: smallest and largest of the three axes."""
WITHIN = 0.3
"""Share by which a noise density may differ from a published one, which has no uncertainty."""


def all_recordings() -> Iterator[tuple[str, RecordingSource, dict[str, Any]]]:
    """Returns every recording there is by name, with the options of `tumble.multipose` that it needs."""
    yield from recordings()
    counts = ReadOptions(
        rate=204.8,
        accelerometer_scale=2048,
        accelerometer_unit="g",
        gyroscope_scale=16.4,
        gyroscope_unit="deg/s",
    )
    yield "imucal annotated", DATA / "imucal" / "annotated_session.csv", {"read": counts}
    for case in sorted((DATA / "redundancy_cases").glob("*.parquet")):
        yield f"flight {case.stem}", case, {}


def multipose(source: RecordingSource, options: dict[str, Any]) -> Content:
    """Calibrates without equipment."""
    found = tumble.multipose(source, **options)
    return {
        "verdict": found.verdict,
        "rests": len(found.poses),
        "directions": found.directions,
        "held_out": finite(found.norm_held_out),
        "angle": finite(math.degrees(found.angle_after)),
        "gyroscope_reason": found.gyroscope_reason,
        "scale": np.diag(found.accelerometer.K).tolist(),
        "bias": found.accelerometer.b.tolist(),
    }


def noise(source: RecordingSource, options: dict[str, Any]) -> Content:
    """Measures noise."""
    found = tumble.noise(source, read=_reading(options))
    terms = {triad: finite(found.term(triad, "white noise")) for triad in found.triads}
    return {"verdict": found.verdict, "seconds_still": found.still.duration, "density": terms}


def thermal(source: RecordingSource, options: dict[str, Any]) -> Content:
    """Finds what temperature does."""
    found = tumble.thermal(source, read=_reading(options))
    return {"verdict": found.verdict, "range": list(found.range)}


RUN: dict[str, Callable[[RecordingSource, dict[str, Any]], Content]] = {
    "multipose": multipose,
    "noise": noise,
    "thermal": thermal,
}


def _reading(options: dict[str, Any]) -> ReadOptions | None:
    read: ReadOptions | None = options.get("read")
    return as_counts(read) if options.get("raw") else read


def outcome(procedure: str, source: RecordingSource, options: dict[str, Any]) -> Content:
    """Returns what a procedure makes of a recording: its figures, or its refusal."""
    try:
        return RUN[procedure](source, options)
    except tumble.TumbleError as error:
        why = error.why
    if "\n" in why:
        raise RuntimeError(f"{procedure} refuses in more than one line: {why}")
    return {"refused": why.replace(f"{DATA.resolve()}/", "").replace(f"{DATA}/", "")}


def contradictions(name: str, found: dict[str, Content]) -> Iterator[str]:
    """Describes results that are known to be wrong."""
    published = MPU_9150.get(name.removeprefix("mpu9150 "))
    calibrated = found["multipose"]
    if published and "refused" in calibrated:
        yield f"{name}: others calibrated it; {calibrated['refused']}"
    elif published:
        scale, bias = published
        if not np.allclose(100.0 * (np.array(calibrated["scale"]) - 1.0), scale, atol=0.03):
            yield f"{name}: scale {calibrated['scale']}, published {scale} %"
        if not np.allclose(calibrated["bias"], bias, atol=0.005):
            yield f"{name}: bias {calibrated['bias']}, published {bias}"
    if name in GYROSCOPE_NOISE:
        low, high = GYROSCOPE_NOISE[name]
        density = np.degrees(found["noise"]["density"]["gyroscope"])
        if not (np.all(density > low * (1.0 - WITHIN)) and np.all(density < high * (1.0 + WITHIN))):
            yield f"{name}: gyroscope noise {density}, published {low} to {high} deg/s/sqrt(Hz)"


def main() -> int:
    """Runs, prints and saves; 1 where a result contradicts what is known."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-save", action="store_true")
    arguments = parser.parse_args()
    if not DATA.is_dir():
        print("the recordings in ../shared/data are not here")
        return 0
    begun = time.perf_counter()
    content: Content = {"recordings": {}, "machine": machine()}
    wrong: list[str] = []
    for name, source, options in all_recordings():
        found = {procedure: outcome(procedure, source, options) for procedure in PROCEDURES}
        content["recordings"][name] = found
        wrong += contradictions(name, found)
        for procedure, of in found.items():
            print(f"{name}: {procedure}: {of}")
    content["seconds"] = time.perf_counter() - begun
    for line in wrong:
        print(line, file=sys.stderr)
    if not (wrong or arguments.no_save):
        save("no_equipment", content)
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
