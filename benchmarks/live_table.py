"""Five targets on a table that turns itself, calibrated live: error over the bound, and time of the table.

For statistics the loop (guidance, drive, recorder, fit) runs on a clock of its own, as fast as it goes,
without sockets; for times, and as a check of errors, over real sockets at the pace of life.

`python -m benchmarks.live_table [--sessions 12] [--over-sockets 2] [--no-save]`
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise, permutations
from multiprocessing import get_context
from pathlib import Path
from typing import TypeAlias

import numpy as np
from rich.console import Console

import tumble
from benchmarks.accuracy import CORES, LARGEST_RATIO, Sample, summary, table
from benchmarks.bound import TRIADS, NoiseCovariance
from benchmarks.results import Content, machine, save
from benchmarks.settings import BASE_SEED, reference_grade, target_grade
from benchmarks.trial import Intervals, Outcome, accelerometer_of, gyroscope_of, outcome_of
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import TriadResult
from tumble.live import LiveChunk, LiveSet, PolledSource, open_set
from tumble.live.conditioning import EMPTY
from tumble.logs import open_recording
from tumble.poses.pose_list import SIX_FACES, PoseList
from tumble.procedures.turntable.live import LiveTurntable
from tumble.procedures.turntable.table_drive import TableDrive
from tumble.procedures.turntable.table_plan import planned, turned_table
from tumble.tools.simulate import Grade, LiveSimulation
from tumble.tools.simulate.live.scenario import LiveScenario
from tumble.tools.simulate.live.table_units import TableUnit, units_on
from tumble.tools.table.guarded import GuardedTable
from tumble.tools.table.motion import travel_time
from tumble.tools.table.plan import PosePlan
from tumble.tools.table.profile import load_profile
from tumble.tools.table.simulated import SimulatedTable

Readings: TypeAlias = "tuple[tuple[FloatArray, FloatArray, FloatArray], ...]"
"""Readings of each unit: times on the bench's clock (n,), specific forces and angular rates (n, 3)."""

TARGETS, RATE_HZ, POSE_SECONDS = 5, 100.0, 10.0
SESSIONS, OVER_SOCKETS = 12, 2
LARGEST_TIME = 1.2
"""Largest duration of the table's motion, over the shortest that shows as much."""
STEP = 0.1
"""s of the bench's clock in which samples come, where that clock is not that of the computer."""
REPORTS = 20.0
"""Reports are as many times more frequent there."""
GRID = 1e-3
"""s to which the beginning and end of motions are known."""
SHORTEST_REST = 0.5
"""s; the table stands still for an instant where it turns back."""


def scenario(number: int) -> LiveScenario:
    """Units of a session: white noise, no steps, clocks that agree, all as `benchmarks.settings`."""
    grades = [_plain(grade) for grade in (reference_grade(), *[target_grade()] * TARGETS)]
    return LiveScenario(
        seed=BASE_SEED + number,
        grades=grades,
        rate_hz=RATE_HZ,
        port=0,
        table_port=0,
        clock_offset_seconds=0.0,
        clock_skew_ppm=0.0,
    )


def _plain(grade: Grade) -> Grade:
    plain = {"bias_instability": 0.0, "quantisation": 0.0}
    return replace(
        grade,
        accelerometer=replace(grade.accelerometer, **plain),
        gyroscope=replace(grade.gyroscope, **plain),
    )


@dataclass(frozen=True, slots=True)
class Bench:
    """Truth of a session while it runs."""

    table: SimulatedTable
    units: Mapping[str, TableUnit]
    uptime: float


@dataclass(frozen=True, slots=True)
class Session:
    """Outcome of one session."""

    outcomes: dict[str, list[Outcome]]
    moved: float
    took: float
    """s of the table's motion, and of all of it."""
    plan: PosePlan


class Clock:
    """A clock that goes on as samples are read."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class FeedSource(PolledSource):
    """Samples of a unit without a line; the first of all lets the clock go on."""

    remarks: tuple[str, ...] = ()
    gyroscope_unit_is_assumed = False
    clock = "bench"

    def __init__(self, name: str, unit: TableUnit, clock: Clock, uptime: float, *, leads: bool) -> None:
        self.name = name
        self._unit, self._clock, self._uptime, self._leads = unit, clock, uptime, leads

    def __enter__(self) -> FeedSource:
        return self

    def __exit__(self, *error: object) -> None: ...

    def fileno(self) -> None: ...

    def read(self) -> LiveChunk:
        if self._leads:
            self._clock.now += STEP
        taken = self._unit.until(self._clock.now)
        if not len(taken):
            return EMPTY
        stamps = taken.time + self._uptime
        return LiveChunk(stamps, taken.accelerometer, taken.gyroscope, arrival=time.monotonic())


def without_sockets(number: int) -> Session:
    """Runs the loop as fast as it goes."""
    made, clock = scenario(number), Clock()
    profile = load_profile(made.table_profile)
    axes = tuple(axis.axis(profile.units) for axis in profile.axes)
    simulated = SimulatedTable(axes, clock)
    _, units, noise = units_on(simulated, made, {})
    sources = {
        name: FeedSource(name, unit, clock, made.uptime, leads=number == 0)
        for number, (name, unit) in enumerate(units.items())
    }
    plan, poses, _ = planned(axes, POSE_SECONDS, SIX_FACES, turns=True)
    bench = Bench(simulated, units, made.uptime)
    with GuardedTable(simulated, armed=True) as guarded, tempfile.TemporaryDirectory() as folder:
        live = _live(
            LiveSet(sources, clock_rate=REPORTS), Path(folder), units, poses, TableDrive(guarded, plan)
        )
        session = judged(bench, live, plan, poses)
    noise.close()
    return session


def over_sockets(number: int) -> Session:
    """Runs the loop over UDP and TCP at the pace of life."""
    with LiveSimulation(scenario(number)) as simulation, tempfile.TemporaryDirectory() as folder:
        assert simulation.table is not None
        assert simulation.table_address is not None
        # The evaluation afterwards needs the whole motion.
        simulation.table.forget_before = lambda t: None  # type: ignore[method-assign]
        turned = turned_table(simulation.table_address, "", POSE_SECONDS, SIX_FACES, turns=True)
        words = [f"{name}={address}" for name, address in simulation.addresses.items()]
        with turned.entered() as drive:
            units = open_set(words, keep_going=True)
            live = _live(units, Path(folder), simulation.units_on_table, turned.poses, drive)
            bench = Bench(simulation.table, simulation.units_on_table, simulation.scenario.uptime)
            return judged(bench, live, turned.plan, turned.poses)


def _live(
    units: LiveSet, folder: Path, names: Iterable[str], poses: PoseList, drive: TableDrive
) -> LiveTurntable:
    return LiveTurntable(
        units,
        folder,
        sources=dict.fromkeys(names, "bench"),
        poses=poses,
        pose_seconds=POSE_SECONDS,
        turns=False,
        driver=drive,
    )


def judged(bench: Bench, live: LiveTurntable, plan: PosePlan, poses: PoseList) -> Session:
    """Runs a session to its end, calibrates its recording, and holds that against the truth."""
    for _ in live.steps():
        pass
    if not live.is_complete:
        raise RuntimeError("the session did not end by itself")
    reference, *targets = bench.units
    found = tumble.turntable(
        f"{live.session}:{reference}", [f"{live.session}:{name}" for name in targets], poses=poses
    )
    readings = {name: _readings(live.session, name, bench.uptime) for name in bench.units}
    begin, end = (readings[reference][0][index] for index in (0, -1))
    rests = rests_between(bench.table, begin, end)
    outcomes: dict[str, list[Outcome]] = {triad: [] for triad in TRIADS}
    for name, result in zip(targets, found, strict=True):
        if result.accelerometer is None or result.gyroscope is None:
            raise RuntimeError(f"{name}: {result.failure}")
        units = bench.units[reference], bench.units[name]
        both = readings[reference], readings[name]
        for triad, of in (("accelerometer", result.accelerometer), ("gyroscope", result.gyroscope)):
            outcomes[triad].append(_outcome(triad, of, units, both, rests))
    moved = end - begin - float(np.diff(rests, axis=1).sum())
    return Session(outcomes, moved, end - begin, plan)


def rests_between(table: SimulatedTable, begin: float, end: float) -> FloatArray:
    """Returns true rests (k, 2), s of the bench's clock."""
    times = np.arange(begin, end, GRID)
    still = (table.states(times)[1] == 0.0).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    spans: FloatArray = times[np.minimum(edges.reshape(-1, 2), len(times) - 1)]
    return spans[np.diff(spans, axis=1)[:, 0] > SHORTEST_REST]


def _readings(session: Path, name: str, uptime: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns times on the bench's clock (n,), specific forces and angular rates (n, 3)."""
    import pyarrow.parquet as pq  # type: ignore[import-untyped]

    recorded = pq.read_table(session / f"{name}.parquet", columns=["sensor_time"])
    chunks = list(open_recording(f"{session}:{name}").chunks())
    times = recorded["sensor_time"].to_numpy() - uptime
    return (
        times,
        np.vstack([chunk.accelerometer for chunk in chunks]),
        np.vstack([chunk.gyroscope for chunk in chunks]),
    )


def _outcome(
    triad: str, found: TriadResult, units: tuple[TableUnit, TableUnit], readings: Readings, rests: FloatArray
) -> Outcome:
    """Compares one triad of a target with truth and bound; the readings of the reference come first."""
    spans = (
        rests if triad == "accelerometer" else np.vstack([rests, np.stack([rests[:-1, 1], rests[1:, 0]], 1)])
    )
    covariances: list[FloatArray] = []
    counts: list[FloatArray] = []
    means: list[FloatArray] = []
    for unit, (times, *samples) in zip(units, readings, strict=True):
        first, last = np.searchsorted(times, spans).T
        intervals = Intervals(first, last, len(times), 1.0 / RATE_HZ)
        covariances.append(intervals.covariance(getattr(unit.unit.grade, triad), RATE_HZ, unstable=False))
        counts.append((last - first).astype(np.float64))
        means.append(intervals.means(samples[TRIADS.index(triad)]))
    forces, earth = units[0].felt(rests.mean(axis=1))
    seen, felt = (getattr(unit.unit, triad) for unit in units)
    covariance, (reference, target) = NoiseCovariance(*covariances), means
    if triad == "accelerometer":
        bound, noise = accelerometer_of(covariance, reference, target, forces, seen, felt)
    else:
        # Samples of the one may cover a sample more of a turn than those of the other.
        stretch = (counts[0] / counts[1])[len(rests) :]
        bound, noise = gyroscope_of(covariance, reference, target, forces, earth, stretch, seen, felt)
    return outcome_of(found, felt, bound, noise)


def shortest_motion(plan: PosePlan) -> float:
    """Least time of all motions, s, that shows the poses and the turns of a plan: in any order."""
    start, *_ = plan.start[np.newaxis]
    stops = [start, *plan.angles]
    between = [[_travel(plan, one, other) for other in stops] for one in stops]
    orders = permutations(range(1, len(stops)))
    tour = min(sum(between[one][other] for one, other in pairwise((0, *order))) for order in orders)
    limits = [axis.limits for axis in plan.axes]
    turns = (
        travel_time(turn.angle, limits[turn.axis].rate, limits[turn.axis].acceleration)
        for _, turn in plan.turns
    )
    return tour + 2.0 * sum(turns)


def _travel(plan: PosePlan, one: FloatArray, other: FloatArray) -> float:
    each = zip(plan.axes, (other - one).tolist(), strict=True)
    return max(travel_time(far, axis.limits.rate, axis.limits.acceleration) for axis, far in each)


def times_of(sessions: Sequence[Session]) -> Content:
    """Returns how long the table took, beside the shortest time."""
    plan = sessions[0].plan
    motion = shortest_motion(plan)
    rest = POSE_SECONDS * len(plan.route)
    return {
        "shortest_motion": motion,
        "motion": [session.moved for session in sessions],
        "shortest": motion + rest,
        "all": [session.took for session in sessions],
    }


def figures_of(sessions: Sequence[Session]) -> Content:
    """Returns errors over the bound by triad and group."""
    samples = {
        triad: Sample.of([each for session in sessions for each in session.outcomes[triad]])
        for triad in TRIADS
    }
    return summary(samples)


def largest_ratio(figures: Content) -> float:
    """Returns the largest ratio of error to bound of any group, corrected for the luck of the draw."""
    groups = (group for triad in TRIADS for group in figures[triad]["groups"].values())
    return max(float(group["ratio_without_luck"]) for group in groups)


def largest_time(times: Content, what: str) -> float:
    """Returns the longest time of a session over the shortest possible; `what` is `motion` or `all`."""
    shortest = times["shortest_motion" if what == "motion" else "shortest"]
    return max(float(took) / float(shortest) for took in times[what])


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the benchmark from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sessions", type=int, default=SESSIONS, help="without sockets, for statistics")
    parser.add_argument("--over-sockets", type=int, default=OVER_SOCKETS, help="at the pace of life")
    parser.add_argument("--no-save", action="store_true", help="show the figures only")
    asked = parser.parse_args(arguments)
    with ProcessPoolExecutor(CORES, get_context("spawn")) as pool:
        quick = list(pool.map(without_sockets, range(asked.sessions)))
    lived = [over_sockets(asked.sessions + number) for number in range(asked.over_sockets)]
    content: Content = {
        "sessions": asked.sessions,
        "over_sockets": asked.over_sockets,
        "targets": TARGETS,
        "rate": RATE_HZ,
        "pose_seconds": POSE_SECONDS,
        "stops": len(lived[0].plan.route),
        "figures": figures_of(quick),
        "figures_over_sockets": figures_of(lived),
        "times": times_of(lived),
        "machine": machine(),
    }
    console = Console()
    console.print(table(content["figures"], "without sockets"))
    console.print(table(content["figures_over_sockets"], "over sockets"))
    for what in ("motion", "all"):
        console.print(
            f"{what}: {largest_time(content['times'], what):.3f} of the shortest (wanted {LARGEST_TIME:g})"
        )
    console.print(f"largest ratio {largest_ratio(content['figures']):.3f} (wanted {LARGEST_RATIO:g})")
    if not asked.no_save:
        console.print(f"written to {save('live_table', content)}")


if __name__ == "__main__":
    main()
