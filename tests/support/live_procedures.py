"""Commands that listen to units, each with a simulated bench for it and what its results are held against."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import yaml

import tumble
from killed_commands import filled
from live_benches import QUICK_BENCH, simulated_bench
from tumble.calibration.document import Calibration
from tumble.foundation import clock
from tumble.foundation.results import LARGEST_WIDENING
from tumble.logs import open_recording
from tumble.logs.session import Session
from typed_commands import typed

TOLERATED = 6.0
"""Largest error of any parameter, in sigmas: of all draws together, four come by chance."""
TRIADS = ("accelerometer", "gyroscope")
CLOCKS = ("clock-jump", "time-backwards", "restart")
"""Faults after which the clocks of units have to be compared anew."""
APART = {"clock_offset_seconds": 5.0, "clock_skew_ppm": 50.0}


@dataclass(frozen=True)
class Ended:
    """A command that has ended: what it printed, the truth of its units, its faults, its folder."""

    done: object
    truth: Mapping
    faults: Mapping
    folder: Path


def nothing(*_):
    """Prepares or judges nothing."""


@dataclass(frozen=True)
class LiveProcedure:
    """A command, on a bench of its own."""

    bench: Mapping
    """Settings of its simulated bench."""
    names: tuple[str, ...]
    """Units of the bench."""
    lasts: float
    """s from its start in which faults begin."""
    words: Callable[[Path], tuple]
    """Command in a folder, with what `killed_commands.filled` fills in."""
    judge: Callable[[Ended], None]
    """Compares results with the truth."""
    session: str = "session"
    """Recording within the folder."""
    longest: float = 5.0
    """s that a fault may last."""
    prepare: Callable = nothing
    """Writes to a folder what the command is given, by the truth of the units."""
    resumes: bool = False
    """Indicates that `--resume` goes on with the recording."""
    stopped_after: float | None = None
    """s after which it is stopped, where it does not end by itself."""
    apart: Mapping = field(default_factory=dict)
    """Difference of the clocks of units where a fault is one of the clock."""

    def run(self, folder, seed, *options, faults=None, kind="", **changes) -> Ended:
        """Runs the command on a bench until it ends."""
        apart = self.apart if kind in CLOCKS else {}
        settings = {**self.bench, **apart, "seed": seed, "faults": faults or {}, "folder": folder, **changes}
        with simulated_bench(**settings) as bench:
            self.prepare(bench.truth, folder)
            words = [*filled(self.words(folder), bench), *options]
            stopper = self.stopped_after and bench.clock.interrupt_later(self.stopped_after, signal.SIGTERM)
            done = typed(*words)
            if stopper:
                clock.wait(stopper)
            return Ended(done, bench.truth, faults or {}, folder)


def samples_in(session):
    """(n, 4) time and specific force of each recorded unit, in order of time, all that can be read."""
    found = {}
    for unit in Session.load(session).units:
        if unit.samples == 0:
            continue
        chunks = list(open_recording(f"{session}:{unit.name}", keep_faults=True).chunks())
        found[unit.name] = np.concatenate(
            [np.column_stack([each.time, each.accelerometer]) for each in chunks]
        )
        assert np.isfinite(found[unit.name][:, 0]).all()
        assert (np.diff(found[unit.name][:, 0]) > 0.0).all()
        if unit.samples is not None:
            assert len(found[unit.name]) == unit.samples
    return found


def judge_record(ended):
    """All units were recorded, the sound ones as long as each other."""
    assert ended.done.code in (0, 3), ended.done.err
    found = samples_in(ended.folder / "session")
    assert set(found) == set(BENCH)
    sound = [len(found[name]) for name in set(BENCH) - set(ended.faults)]
    assert min(sound) > 0.8 * max(sound) > 0.0


def judge_spin(ended):
    """Biases within their sigmas, where it was calibrated."""
    if ended.done.code == 0:
        (path,) = (ended.folder / "out").glob("*.live.yaml")
        found = Calibration.load(path)
        for triad in TRIADS:
            section = getattr(found, triad)
            off = np.abs(section.b - ended.truth[f"{triad}_bias"]) / section.sigma.bias
            assert np.nanmax(off) < TOLERATED, f"{triad}: {off} sigmas: {ended.faults}"


def judge_apply(ended):
    """It rests: a corrupted number here and there looks like any other."""
    if (out := ended.folder / "out.csv").exists():
        chunks = list(open_recording(out).chunks())
        time = np.concatenate([each.time for each in chunks])
        force = np.concatenate([np.linalg.norm(each.accelerometer, axis=1) for each in chunks])
        assert (np.diff(time) > 0.0).all()
        assert abs(np.median(force) - 9.8) < 0.1


def judge_turntable(ended):
    """Bias and scale of each target within their sigmas, unless the model is reported as not met."""
    for file in sorted((ended.folder / "out").glob("target_*.yaml")):
        found = yaml.safe_load(file.read_text())["accelerometer"]
        if found["chi_square"] > LARGEST_WIDENING**2 * found["degrees_of_freedom"]:
            continue
        true = ended.truth["units"][file.stem]["accelerometer"]
        bias = (found["b"] - (np.array(true["b"]) + true.get("drift", 0.0))) / found["sigma"]["bias"]
        scale = (np.diag(found["K"]) - np.linalg.norm(true["M"], axis=1)) / found["sigma"]["scale"]
        assert np.abs([bias, scale]).max() < TOLERATED, (file.stem, bias, scale)


def judge_multipose(ended):
    """Bias and scale of each triad within their sigmas, unless the model is reported as not met."""
    calibrations = list((ended.folder / "out").glob("*.multipose.yaml"))
    assert bool(calibrations) == (ended.done.code != 2), ended.done.err
    if not calibrations:
        return
    found = tumble.multipose(ended.folder / "out/session", g_sensitivity=True)
    for triad in (each for each in found.triads if each.widening <= LARGEST_WIDENING):
        own = np.linalg.norm(np.array(ended.truth["own_axes"][triad.triad]), axis=1)
        true = {f"scale {axis}": own[k] for k, axis in enumerate("xyz")}
        true |= {f"bias {axis}": ended.truth[triad.triad]["b"][k] for k, axis in enumerate("xyz")}
        off = {
            each.name: (each.value - true[each.name]) / each.sigma
            for each in triad.parameters
            if each.name in true
        }
        assert max(map(abs, off.values())) < TOLERATED, (triad.triad, off)


def write_bias(truth, folder):
    """Writes the true biases of a robot's unit."""
    triads = {triad: {"M": np.eye(3), "b": truth[f"{triad}_bias"]} for triad in TRIADS}
    Calibration.model_validate({"name": "imu", **triads}).save(folder / "imu.yaml")


def true_calibration(truth, name):
    """Errors of a unit at the end of a flight."""
    unit = truth["units"][name]
    triads = {
        triad: {
            "M": unit[triad]["M"],
            "b": [a + b for a, b in zip(unit[triad]["b"], unit[triad]["drift"], strict=True)],
        }
        for triad in TRIADS
    }
    return Calibration.model_validate({"name": name, **triads})


def write_mounting(truth, folder):
    """Writes how secondaries are mounted, and the errors of the primary."""
    units = {
        name: {"sensor_from_primary": unit["nominal_mounting"], "lever_arm": unit["lever_arm"]}
        for name, unit in truth["units"].items()
        if name != "primary"
    }
    settings = {"schema": "tumble-redundancy/1", "units": units}
    (folder / "units.yaml").write_text(yaml.safe_dump(settings))
    true_calibration(truth, "primary").save(folder / "primary.yaml")


WARMING = {"accelerometer": 0.05, "gyroscope": 0.01}
"""m/s^2 and rad/s by which biases drift while they warm up, beside what sigmas cover."""
FLIGHT = ("--set", "collect=15", "--set", "evaluate_every=3", "--set", "late=2")


def watched_set(folder, *units):
    """Command that watches a set, or its recording."""
    return (
        *("redundancy", *units, "--settings", folder / "units.yaml", *FLIGHT, "--store", folder / "store"),
        *("--calibration", folder / "primary.yaml"),
    )


def judge_redundancy(ended):
    """Stored errors of secondaries are right within their sigmas, and the recording is replayed."""
    assert ended.done.code in (0, 3), ended.done.err
    for error in json.loads(ended.done.out.splitlines()[-1])["errors"]:
        unit, primary = (
            getattr(true_calibration(ended.truth, name), error["sensor"])
            for name in (error["unit"], "primary")
        )
        matrix = unit.M @ np.linalg.inv(primary.M)
        bias = unit.b - matrix @ primary.b
        shown = [np.array(error[name], dtype=float) for name in ("matrix_sigma", "bias_sigma")]
        matrix_sigma, bias_sigma = (np.where(np.isnan(sigma), np.inf, sigma) for sigma in shown)
        assert (np.abs(error["matrix"] - matrix) < TOLERATED * matrix_sigma + 0.002).all(), error
        allowed = TOLERATED * bias_sigma + WARMING[error["sensor"]]
        assert (np.abs(error["bias"] - bias) < allowed).all(), error
    again = typed(*watched_set(ended.folder, ended.folder / "session"), "-o", ended.folder / "again")
    assert again.code in (0, 3), again.err
    assert "rejected" not in again.out


BENCH = ("reference", "target_1", "target_2")
SET = ("primary", "secondary_1", "secondary_2")
ROBOT = {"motion": "spin", "grades": ("tactical",), "rate_hz": 100.0, "rest_seconds": 12.0}
FLYING = {"motion": "flight", "grades": ("industrial", "consumer", "consumer"), "rate_hz": 100.0}
HAND = {"motion": "hand", "grades": ("tactical",), "rest_seconds": 4.0}
LIVE = {
    "record": LiveProcedure(
        {"motion": "six-faces", "rate_hz": 100.0},
        BENCH,
        20.0,
        lambda folder: ("record", "{units}", "-o", folder / "session", "--duration", "24s"),
        judge_record,
    ),
    "spin": LiveProcedure(
        ROBOT,
        ("imu",),
        30.0,
        lambda folder: (
            *("spin", "--live", "{unit}", "--turns", "2"),
            *("--record", folder / "session", "-o", folder / "out"),
        ),
        judge_spin,
    ),
    "apply": LiveProcedure(
        {**ROBOT, "rest_seconds": 60.0},
        ("imu",),
        20.0,
        lambda folder: ("apply", "--live", folder / "imu.yaml", "{unit}", "--to", folder / "out.csv"),
        judge_apply,
        session="",
        prepare=write_bias,
        stopped_after=32.0,
    ),
    "turntable": LiveProcedure(
        {"motion": "six-faces", "rest_seconds": 6.0},
        BENCH,
        70.0,
        lambda folder: (
            *("turntable", "--live", "{units}", "--pose-seconds", "3s", "--no-turns", "-o", folder / "out"),
        ),
        judge_turntable,
        session="out/session",
        longest=25.0,
        resumes=True,
        apart=APART,
    ),
    "turntable that turns its table": LiveProcedure(
        QUICK_BENCH,
        BENCH,
        60.0,
        lambda folder: (
            *("turntable", "--live", "{units}", "--table", "{table}", "--armed", "--poses", "six-faces"),
            *("--no-turns", "--pose-seconds", "3s", "-o", folder / "out"),
        ),
        judge_turntable,
        session="out/session",
        longest=25.0,
        resumes=True,
        apart=APART,
    ),
    "multipose": LiveProcedure(
        HAND,
        ("imu",),
        110.0,
        lambda folder: (
            *("multipose", "--live", "{unit}", "--orientations", "16", "--pose-seconds", "3s"),
            *("--g-sensitivity", "-o", folder / "out"),
        ),
        judge_multipose,
        session="out/session",
        longest=20.0,
        resumes=True,
        apart=APART,
    ),
    "redundancy": LiveProcedure(
        FLYING,
        SET,
        70.0,
        lambda folder: (
            *watched_set(folder, "--live", "{units}"),
            *("--record", folder / "session", "-o", folder / "out", "--duration", "48s", "--json"),
        ),
        judge_redundancy,
        prepare=write_mounting,
    ),
}
"""Every command that listens to units, by name."""
