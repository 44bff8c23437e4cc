"""Magnetometers by the Earth's field: error against the bound, coverage, disturbances, recordings of others.

`python -m benchmarks.magnetometer [--sessions 400] [--recordings FOLDER]`
"""

from __future__ import annotations

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("RAYON_NUM_THREADS", "1")

import numpy as np

import tumble
from benchmarks.magnetometer_bound import rest_bound, turned_bound
from benchmarks.results import Content, machine, save
from tumble.foundation.errors import TumbleError
from tumble.foundation.magnetic import MagneticTrack
from tumble.foundation.plain import finite
from tumble.foundation.recording import FloatArray
from tumble.tools.simulate import SimulatedMagnetometer, simulate_magnetometer

BASE_SEED = 340_000
CORES = 2
LARGEST_RATIO = 1.05
COVERAGE = (0.93, 0.97)
MOST_ALARMS = 0.01
"""Largest share of undisturbed sessions in which a rest is called disturbed."""
LEAST_FOUND = 0.99
"""Least share of magnets that are found."""
AS_EVEN = 1.02
"""Largest scatter of the length of the field, over that by what others published."""
LEAST_RECORDINGS = 5
GROUPS = ("bias", "scale", "non-orthogonality", "mounting")


@dataclass(frozen=True, slots=True)
class Published:
    """A recording of others and the correction they published for it, u = A (y - b)."""

    name: str
    file: str
    """Path in the folder that the user names: that of the repository, then its file."""
    commit: str
    A: tuple[tuple[float, ...], ...]
    b: tuple[float, float, float]
    by_program: bool = False
    """Indicates that the repository has the program, whose result on that file was taken."""


INVERSE_OF_LSM303 = tuple(
    map(
        tuple,
        np.linalg.inv(
            [[591.022, -13.095, -14.971], [-13.095, 596.181, 30.713], [-14.971, 30.713, 552.062]]
        ).tolist(),
    )
)
"""Its author published the inverse of A."""

PUBLISHED = (
    Published(
        "HMC5883L, least squares",
        "nliaudat+magnetometer_calibration/mag_out_sample.txt",
        "f15a68454052993721d3e8f4ae30058cff8dbc77",
        (
            (0.5823136909144911, 0.007124620314368133, -0.024442807568982334),
            (0.00712462031436818, 0.5906868599676302, 0.005356720947343228),
            (-0.024442807568982372, 0.005356720947343263, 0.7210550285247264),
        ),
        (41.45884154873271, -87.79628696573607, 569.4171225039286),
    ),
    Published(
        "MPU-9250 counts, calibrate3",
        "jremington+MPU-9250-AHRS/mag3_raw.csv",
        "226e2e608473b1912320518366d30cdd404c5796",
        (
            (0.25060005, 0.02941951, -0.02954944),
            (0.02941951, 0.31691521, 0.00788726),
            (-0.02954944, 0.00788726, 0.30592214),
        ),
        (9955.151669, -7948.26463057, 8511.80447932),
    ),
    Published(
        "FXOS8700, Magneto 1.2",
        "michaelwro+mag-cal-example/mag-readings.txt",
        "7d6cd72268aecf55db1f001acbfc3e50fcb6330a",
        ((0.989575, -0.022220, 0.005152), (-0.022220, 0.989327, 0.022216), (0.005152, 0.022216, 1.045404)),
        (28.557458, -39.981060, -27.428035),
    ),
    Published(
        "QMC5883L counts, least and largest",
        "italocjs+magnetometer_calibration/data.csv",
        "e7b8aa8636e6163534fe58c3f2fa14f884ebce75",
        ((1.020520, 0.0, 0.0), (0.0, 1.017735, 0.0), (0.0, 0.0, 0.963824)),
        (1096.0, 3388.0, 2594.0),
    ),
    Published(
        "LSM303, least squares",
        "andrewkruger+Magnetometer_calibration/3d_soft.txt",
        "82456d9b30d4d12d3061106b43dde6cb57472588",
        INVERSE_OF_LSM303,
        (108.989, -72.763, 83.499),
    ),
    Published(
        "counts, ellipsoid_fit",
        "aleksandrbazhin+ellipsoid_fit_python/mag_out.txt",
        "bfab4ce68244529640496f466a4374ef15748275",
        (
            (1.025634091755263, 0.005236852265899, -0.018434733729232),
            (0.005236852265899, 0.926266862658620, -0.003292808097691),
            (-0.018434733729232, -0.003292808097691, 1.052992311671225),
        ),
        (-68.10391030344871, 82.87299372506945, -133.42922613005737),
        by_program=True,
    ),
    Published(
        "MPU-9250, constrained ellipsoid",
        "karlasever+Magnetometer-Calibration/magnetometer_raw_data.csv",
        "694ad77a4c1128aff9315cf8e70e85f5d82e33f5",
        (
            (0.0228174, -0.00013501, 0.0002673),
            (-0.00013501, 0.02309857, -0.00056886),
            (0.0002673, -0.00056886, 0.02488908),
        ),
        (79.5417853, 19.15713245, -62.82583356),
        by_program=True,
    ),
)
"""Repositories of GitHub, with the commit that was read."""


def session(seed: int, *, turned: bool, disturbed: int = 0) -> SimulatedMagnetometer:
    """Plays one session with white noise, without steps, so that the bound is exact."""
    if turned:
        return simulate_magnetometer(seed=seed, orientations=40, still=0.0, rate=50.0, step=0.0)
    return simulate_magnetometer(seed=seed, disturbed=disturbed, step=0.0)


def trial(task: tuple[int, bool]) -> tuple[FloatArray, FloatArray, int]:
    """Errors over the bound and over sigma of all parameters, and the rests that were called disturbed."""
    seed, turned = task
    played = session(seed, turned=turned)
    found = tumble.magnetometer(played.recording, field=played.scenario.strength, turned=turned)
    truth, bound = turned_bound(played) if turned else rest_bound(played)
    shown = [each for each in (*found.magnetometer.parameters, found.dip) if each.observable]
    factor = np.array([np.radians(1.0) if each.unit == "deg" else 1.0 for each in shown])
    error = factor * [each.value for each in shown] - truth
    reach = factor * [0.5 * (each.high - each.low) for each in shown]
    return error / bound, error / reach, len(found.disturbed)


def groups(figures: FloatArray) -> list[tuple[str, slice]]:
    """Columns of each group of parameters: those of (n, 13) at rests, (n, 9) without one."""
    found = [(name, slice(3 * k, 3 * k + 3)) for k, name in enumerate(GROUPS)]
    return [*found, ("dip", slice(12, 13))] if figures.shape[1] == 13 else found[:3]


def magnet(seed: int) -> bool:
    """Plays a session with a magnet near one rest, and returns whether that one was named."""
    number = 1 + seed % 18
    played = session(seed, turned=False, disturbed=number)
    found = tumble.magnetometer(played.recording, field=played.scenario.strength)
    return [point.disturbed for point in found.points].index(True) == number - 1 if found.disturbed else False


def recorded(published: Published, folder: Path) -> Content | None:
    """Spread of |u| raw, by the published correction and by ours; None without the recording."""
    path = folder / published.file
    if not path.exists():
        return None
    readings = read_triples(path)
    raw, theirs = readings, (readings - np.array(published.b)) @ np.array(published.A).T
    track = MagneticTrack(np.arange(len(readings)) / 50.0, readings)
    recording = tumble.Recording.from_magnetic(published.name, track)
    origin: Content = {
        "name": published.name,
        "source": f"github.com/{published.file.split('/')[0].replace('+', '/')}",
        "commit": published.commit,
        "by_program": published.by_program,
        "samples": len(readings),
        "raw": spread(raw),
        "published": spread(theirs),
    }
    try:
        found = tumble.magnetometer(recording)
    except TumbleError as error:
        return {**origin, "refusal": getattr(error, "why", str(error))}
    triad = found.magnetometer
    ours = np.linalg.solve(triad.M, (readings - triad.b).T).T
    difference = (triad.b - np.array(published.b)) / np.sqrt(np.diag(triad.covariance)[9:])
    return {
        **origin,
        "coverage": found.coverage,
        "found": spread(ours),
        "bias_sigmas": [float(each) for each in difference],
        "bias_share": float(np.linalg.norm(triad.b - np.array(published.b)) / found.strength.value),
        "disturbed": len(found.disturbed),
    }


def read_triples(path: Path) -> FloatArray:
    """Reads rows of three numbers, however they are parted; rows of zeros and of words are none."""
    rows = []
    for line in path.read_text().splitlines():
        try:
            row = [float(cell) for cell in line.replace(",", " ").split()]
        except ValueError:
            continue
        if len(row) == 3 and any(row):
            rows.append(row)
    return np.array(rows)


def spread(vectors: FloatArray) -> float:
    """Scatter of the lengths over their median, by quartiles, so that outliers count little."""
    lengths = np.linalg.norm(vectors, axis=1)
    low, middle, high = np.quantile(lengths, [0.25, 0.5, 0.75])
    return float((high - low) / 1.349 / middle)


def measure(sessions: int, folder: Path) -> Content:
    """Measures all of it."""
    content: Content = {"machine": machine(), "sessions": sessions}
    context = get_context("spawn")
    with ProcessPoolExecutor(CORES, mp_context=context) as pool:
        for name, turned in (("rests", False), ("turned", True)):
            begun = time.perf_counter()
            tasks = [(BASE_SEED + k, turned) for k in range(sessions)]
            trials = list(pool.map(trial, tasks, chunksize=8))
            over_bound, over_reach = (np.array([each[k] for each in trials]) for k in (0, 1))
            content[name] = {
                "ratio": {
                    group: float(np.sqrt(np.mean(over_bound[:, rows] ** 2)))
                    for group, rows in groups(over_bound)
                },
                "coverage": {
                    group: float(np.mean(np.abs(over_reach[:, rows]) < 1.0))
                    for group, rows in groups(over_reach)
                },
                "alarms": float(np.mean([each[2] > 0 for each in trials])),
                "seconds": time.perf_counter() - begun,
            }
        seeds = [BASE_SEED + 100_000 + k for k in range(max(sessions // 4, 20))]
        content["magnets_found"] = float(np.mean(list(pool.map(magnet, seeds, chunksize=8))))
    content["recordings"] = [
        each for each in (recorded(one, folder) for one in PUBLISHED) if each is not None
    ]
    return {key: finite(value) for key, value in content.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=400)
    parser.add_argument("--recordings", type=Path, default=Path("magnetometers"))
    parser.add_argument("--no-save", action="store_true")
    options = parser.parse_args()
    content = measure(options.sessions, options.recordings)
    for name in ("rests", "turned"):
        print(name, content[name])
    print("magnets found", content["magnets_found"])
    for each in content["recordings"]:
        print(each)
    if not options.no_save:
        save("magnetometer", content)


if __name__ == "__main__":
    main()
