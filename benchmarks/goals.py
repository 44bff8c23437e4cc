"""Goals of every benchmark, and whether it reaches them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain

from benchmarks import c_library
from benchmarks.accuracy import COVERAGE, LARGEST_RATIO
from benchmarks.bench_page import CLICK_GOAL, FRAMES_GOAL, GROWTH_GOAL, PAINT_GOAL, SHARE_GOAL
from benchmarks.bound import TRIADS
from benchmarks.compare import COVERAGE as COMPARE_COVERAGE
from benchmarks.compare import FOUND, LARGE
from benchmarks.constant_rates import COVERAGE as RATE_COVERAGE
from benchmarks.constant_rates import LARGEST_RATIO as LARGEST_RATE_RATIO
from benchmarks.digits import two_digits
from benchmarks.disturbed import LARGEST_RATIO as LARGEST_SIGMA_RATIO
from benchmarks.fleet_figures import LARGEST_GROWTH as LARGEST_FLEET_GROWTH
from benchmarks.fleet_figures import LARGEST_OVERHEAD, LEAST_GAIN
from benchmarks.fleet_kills import KILLS
from benchmarks.footprint import (
    FLASH_GOALS,
    FLASH_NAMES,
    INSTRUCTION_GOALS,
    INSTRUCTION_NAMES,
    LARGEST_GOAL,
    MEMORY_GOALS,
    MEMORY_NAMES,
    STACK_GOALS,
    STACK_NAMES,
    WHOLE_GOALS,
    WHOLE_NAMES,
    at_one_time,
    largest,
    whole_instructions,
)
from benchmarks.laboratories import COVERAGE as U_COVERAGE
from benchmarks.live import LARGEST_GROWTH as LARGEST_LIVE_GROWTH
from benchmarks.live import LARGEST_LATENCY, LARGEST_SHARE
from benchmarks.live_table import LARGEST_TIME, largest_ratio, largest_time
from benchmarks.magnetometer import AS_EVEN, LEAST_FOUND, LEAST_RECORDINGS
from benchmarks.magnetometer import COVERAGE as MAGNETOMETER_COVERAGE
from benchmarks.magnetometer import LARGEST_RATIO as LARGEST_MAGNETOMETER_RATIO
from benchmarks.magnetometer import MOST_ALARMS as MOST_MAGNET_ALARMS
from benchmarks.memory import LARGEST_GROWTH
from benchmarks.multipose import COVERAGE as MULTIPOSE_COVERAGE
from benchmarks.multipose import IMU_TK, LARGEST_SCATTER, MPU_9150
from benchmarks.multipose import LARGEST_RATIO as LARGEST_MULTIPOSE_RATIO
from benchmarks.multipose_speed import FASTER as FASTER_MULTIPOSE
from benchmarks.noise_disturbed import CLEAR_STEP, LARGEST_ERROR, MOST_ALARMS
from benchmarks.noise_disturbed import COVERAGE as DISTURBED_NOISE_COVERAGE
from benchmarks.noise_terms import COVERAGE as NOISE_COVERAGE
from benchmarks.noise_terms import FASTER, LARGEST_NOISE_GROWTH, PROMISED
from benchmarks.production import LARGEST_GROWTH as LARGEST_BATCH_GROWTH
from benchmarks.production import SECONDS
from benchmarks.readers import LARGEST_RATIO as LARGEST_READING
from benchmarks.redundancy_adoptions import FAILURES
from benchmarks.redundancy_figures import IN_HEALTH, LONG, SOON
from benchmarks.results import Content
from benchmarks.speed import GOALS
from benchmarks.spin import COVERAGE as SPIN_COVERAGE
from benchmarks.spin import DESIGN as DESIGN_OF_TILTS
from benchmarks.spin import LARGEST_DIFFERENCE
from benchmarks.spin import LARGEST_RATIO as LARGEST_SPIN_RATIO
from benchmarks.spin_disturbed import COVERAGE as DISTURBED_SPIN_COVERAGE
from benchmarks.spin_disturbed import NOT_SHOWN
from benchmarks.spin_live import COVERAGE as LIVE_COVERAGE
from benchmarks.spin_live import LARGEST_REDUCED, WAYS
from benchmarks.stamps import HELD, LARGEST_Z
from benchmarks.thermal import COVERAGE as THERMAL_COVERAGE
from benchmarks.thermal import LARGEST_RATIO as LARGEST_THERMAL_RATIO
from benchmarks.thermal import RIGHT
from benchmarks.thermal_loops import COVERAGE as LOOP_COVERAGE
from benchmarks.thermal_loops import MOST_FALSE_LAGS
from benchmarks.tremor import COVERAGE as TREMOR_COVERAGE
from benchmarks.truths import BIASES, DESIGN_MRAD
from benchmarks.turntable_magnetometer import COVERAGE as TABLE_COVERAGE
from benchmarks.turntable_magnetometer import LARGEST_RATIO as LARGEST_TABLE_RATIO
from benchmarks.turntable_magnetometer import LEAST_FOUND as LEAST_NAMED
from benchmarks.turntable_magnetometer import MOST_ALARMS as MOST_TABLE_ALARMS
from benchmarks.view import OPEN_GOAL, ZOOM_GOAL

WAYS_OF_MAGNETOMETERS = {"rests": "at rests", "turned": "turned without a rest"}
"""Motion of a magnetometer, by its key among the figures."""

SPEED_NAMES = {
    "acquisition": "rests and turns of a recording in memory",
    "correction": "correction of a recording in memory",
    "csv": "reading CSV, checked and in SI units",
    "start_up": "`tumble inspect` of a CSV of 2000 rows, from start to end",
    "help": "`tumble --help`, from start to end",
}


@dataclass(frozen=True, slots=True)
class Goal:
    """One figure and what it is to reach."""

    what: str
    wanted: str
    reached: str
    is_met: bool


def all_goals(results: Mapping[str, Content]) -> list[Goal]:
    """Returns the goals of all benchmarks that were run."""
    measured = ((goals, results[name]) for name, goals in GOALS_OF.items() if name in results)
    return list(chain.from_iterable(goals(content) for goals, content in measured))


def _accuracy(content: Content) -> Iterator[Goal]:
    ratios = [cell["largest_without_luck"] for cell in content["cells"]]
    yield Goal(
        "turntable: error of any parameter in any cell over the Cramér-Rao bound, corrected for "
        "sampling error",
        f"{LARGEST_RATIO:g}",
        f"{max(ratios):.3f}",
        max(ratios) <= LARGEST_RATIO,
    )
    covered = [each for cell in content["cells"] for of in cell["coverage"].values() for each in of.values()]
    yield _coverage("turntable: share of 95 % intervals that hold the truth, in any cell", covered, COVERAGE)


def _disturbed(content: Content) -> Iterator[Goal]:
    covered = [case[triad]["coverage"] for case in content["missing"] for triad in TRIADS]
    what = "turntable: share of 95 % intervals that hold the truth where samples are missing"
    yield _coverage(what, covered, COVERAGE)
    ratios = [
        ratio for case in content["shaking"] for ratio in case["accelerometer"]["sigma_over_error"].values()
    ]
    yield Goal(
        "turntable: sigmas of the accelerometer over its errors where the table shakes",
        f"{1 / LARGEST_SIGMA_RATIO:.2f} to {LARGEST_SIGMA_RATIO:g}",
        f"{min(ratios):.2f} to {max(ratios):.2f}",
        min(ratios) >= 1 / LARGEST_SIGMA_RATIO and max(ratios) <= LARGEST_SIGMA_RATIO,
    )


def _bumped(content: Content) -> Iterator[Goal]:
    covered = [case[triad]["coverage"] for case in content["bumping"] for triad in TRIADS]
    what = "turntable: share of 95 % intervals that hold the truth where it is bumped and biases drift"
    yield _coverage(what, covered, COVERAGE)


def _stamps(content: Content) -> Iterator[Goal]:
    late = content["stamps"]
    z = max(case["after"]["z"] for case in late)
    what = "stamps that come late: errors of the gyroscope over their sigma, rms, worst lateness"
    yield Goal(what, f"{LARGEST_Z:g}", f"{z:.2f}", z <= LARGEST_Z)
    leaps = sum(case["leaps"] for case in content["loads"])
    yield _none("a busy computer: leaps of a live clock", leaps)
    held = min(case["held"] for case in content["loads"])
    what = "a busy computer: share of times within two sigma, worst load"
    yield Goal(what, _percent(HELD), _percent(held), held >= HELD)


def _tremor(content: Content) -> Iterator[Goal]:
    rows = content["tremors"]
    used, of = sum(row["used"] for row in rows), sum(row["of"] for row in rows)
    yield Goal("multi-pose in hands that tremble: poses used", f"{of}", f"{used}", used == of)
    covered = [row[triad]["coverage"] for row in rows for triad in TRIADS]
    what = "multi-pose in hands that tremble: share of 95 % intervals that hold the truth"
    yield _coverage(what, covered, TREMOR_COVERAGE)


def _magnetometer(content: Content) -> Iterator[Goal]:
    for way in ("rests", "turned"):
        ratio = max(content[way]["ratio"].values())
        what = f"magnetometer, {WAYS_OF_MAGNETOMETERS[way]}: error over the bound, worst group"
        limit = LARGEST_MAGNETOMETER_RATIO
        yield Goal(what, f"{limit:g}", f"{ratio:.3f}", ratio <= limit)
        what = f"magnetometer, {WAYS_OF_MAGNETOMETERS[way]}: share of 95 % intervals that hold the truth"
        yield _coverage(what, list(content[way]["coverage"].values()), MAGNETOMETER_COVERAGE)
    found, alarms = content["magnets_found"], content["rests"]["alarms"]
    what = "magnetometer: magnets near a rest that are found"
    yield Goal(what, _percent(LEAST_FOUND), _percent(found), found >= LEAST_FOUND)
    what = "magnetometer: undisturbed sessions of which a rest is called disturbed"
    yield Goal(what, _percent(MOST_MAGNET_ALARMS), _percent(alarms), alarms <= MOST_MAGNET_ALARMS)
    recordings = [each for each in content["recordings"] if "found" in each]
    better = sum(each["found"] <= AS_EVEN * each["published"] for each in recordings)
    what = "magnetometer: recordings of others whose field is as even as by what they published"
    wanted = max(len(recordings), LEAST_RECORDINGS)
    yield Goal(what, f"{wanted}", f"{better}", better >= wanted)


def _turntable_magnetometer(content: Content) -> Iterator[Goal]:
    even, magnet = content["even"], content["magnet"]
    ratio = max(even["ratio"].values())
    what = "magnetometer, on a turntable: error over the bound, worst group"
    yield Goal(what, f"{LARGEST_TABLE_RATIO:g}", f"{ratio:.3f}", ratio <= LARGEST_TABLE_RATIO)
    what = "magnetometer, on a turntable: share of 95 % intervals that hold the truth"
    yield _coverage(what, list(even["coverage"].values()), TABLE_COVERAGE)
    found, alarms = magnet["named_right"], max(1.0 - even["named_right"], even["differences"])
    what = "magnetometer, on a turntable: magnets near a rest that are named alone"
    yield Goal(what, _percent(LEAST_NAMED), _percent(found), found >= LEAST_NAMED)
    what = "magnetometer, on a turntable: undisturbed sessions with a rest, or a difference, named"
    yield Goal(what, _percent(MOST_TABLE_ALARMS), _percent(alarms), alarms <= MOST_TABLE_ALARMS)


def _noise_disturbed(content: Content) -> Iterator[Goal]:
    rows = [row for row in content["density"] if row["case"] != "hum"]
    error = max(row["error"] for row in rows)
    what = "noise with a disturbance: error of N, rms, worst of all but a hum"
    yield Goal(what, _percent(LARGEST_ERROR), _percent(error), error <= LARGEST_ERROR)
    what = "noise with a disturbance: share of 95 % intervals of N that hold the truth"
    yield _coverage(what, [row["coverage"] for row in rows], DISTURBED_NOISE_COVERAGE)
    alarms, channels = (sum(row[key] for row in content["clean"]) for key in ("alarms", "channels"))
    what = "noise of clean hours: channels with a step, ramp or knock that is none"
    yield _at_most_so_many(what, MOST_ALARMS, alarms, channels)
    found = min(row["found"] for row in content["steps"] if row["size"] >= CLEAR_STEP)
    what = f"noise: steps of {CLEAR_STEP:g} mm/s² and more that are found at their time"
    yield Goal(what, _percent(1.0), _percent(found), found == 1.0)


def _thermal_loops(content: Content) -> Iterator[Goal]:
    loops = content["loops"]
    what = "thermal: share of 95 % intervals that hold the largest and the mean difference of a loop"
    yield _coverage(
        what, [row[key]["coverage"] for row in loops for key in ("largest", "mean")], LOOP_COVERAGE
    )
    missed = sum(row["sessions"] - row["found"] for row in loops if row["loop"] != "none")
    yield _none("thermal: loops that are not found", missed)
    without_lag = [*loops, *content.get("wandering", ())]
    false, sessions = (sum(row[key] for row in without_lag) for key in ("lags", "sessions"))
    yield _at_most_so_many("thermal: lags where there is none", MOST_FALSE_LAGS, false, sessions)
    covered = [row["coverage"] for row in content["lags"] if row["found"]]
    yield _coverage("thermal: share of 95 % intervals that hold a lag of 60 s", covered, LOOP_COVERAGE)


def _spin_disturbed(content: Content) -> Iterator[Goal]:
    covered = [
        of["coverage"]
        for row in content["rows"]
        for group, of in row["groups"].items()
        if of["coverage"] is not None and (row["name"], group) not in NOT_SHOWN
    ]
    what = (
        "spin that slips, turns fast or has a coarse gyroscope: share of 95 % intervals that hold the truth"
    )
    yield _coverage(what, covered, DISTURBED_SPIN_COVERAGE)


def _constant_rates(content: Content) -> Iterator[Goal]:
    plans = content["plans"]
    ratio = max(plan["ratio"] for plan in plans)
    yield Goal(
        "turntable at constant rates: error of the gyroscope over the Cramér-Rao bound, in any plan",
        f"{LARGEST_RATE_RATIO:g}",
        f"{ratio:.3f}",
        ratio <= LARGEST_RATE_RATIO,
    )
    what = "turntable at constant rates: share of 95 % intervals that hold the truth, in any plan"
    yield _coverage(what, [plan["coverage"] for plan in plans], RATE_COVERAGE)
    error = max(plan["predicted"] / plan["plain"] for plan in plans)
    yield Goal(
        "turntable at constant rates: error at a rate that was held out, over that of plain least squares",
        "1",
        f"{error:.2f}",
        error <= 1.0,
    )


def _laboratories(content: Content) -> Iterator[Goal]:
    what = "turntable with a certificate: share of parameters within U, in any laboratory and triad"
    yield _coverage(
        what, [case[triad]["coverage"] for case in content["certified"] for triad in TRIADS], U_COVERAGE
    )


def _truths(content: Content) -> Iterator[Goal]:
    tables = {"0": "repeats", "0.05": "errs 0.05 deg a pose"}
    for (column, table), design in zip(tables.items(), DESIGN_MRAD["reference"], strict=True):
        error = 1e3 * content["columns"][column]["reference"]["non_orthogonality"]["rms"]
        what = f"turntable: error of the non-orthogonality where the table {table}"
        yield _at_most(what, design, error, "mrad")
    stated = BIASES["reference"][1]
    assert stated is not None
    error = 1e3 * content["columns"]["0.2"]["reference"]["bias"]["rms"]
    what = "turntable: error of the accelerometer bias where the table errs 0.2 deg a pose"
    yield _at_most(what, 1e3 * stated, error, "mm/s²")


def _spin(content: Content) -> Iterator[Goal]:
    for tilt, (_, design) in DESIGN_OF_TILTS.items():
        error = 1e3 * content["tilts"][f"{tilt:g}"]["level_free"]
        what = f"spin: error of the accelerometer bias on a floor that tilts by {tilt:g} deg"
        yield _at_most(what, 1e3 * design, error, "mm/s²")
    single = [of for cell in content["cells"] for of in cell["figures"].values()]
    ratio = max(of["ratio"] for of in single)
    yield Goal(
        "spin: error of any parameter in any cell over the Cramér-Rao bound",
        f"{LARGEST_SPIN_RATIO:g}",
        f"{ratio:.3f}",
        ratio <= LARGEST_SPIN_RATIO,
    )
    covered = [of["coverage"] for of in single]
    yield _coverage("spin: share of 95 % intervals that hold the truth, in any cell", covered, SPIN_COVERAGE)
    for rate, of in content["precision"].items():
        group = max(of, key=lambda name: float(of[name]))
        yield Goal(
            f"spin: largest difference of single from double precision at {rate} Hz, in sigmas",
            f"{100 * LARGEST_DIFFERENCE:g} %",
            f"{100 * of[group]:.2f} % ({group})",
            of[group] <= LARGEST_DIFFERENCE,
        )


def _multipose(content: Content) -> Iterator[Goal]:
    ratio = max(of["ratio"] for of in content["accelerometer"].values())
    yield Goal(
        "multi-pose: error of the accelerometer's parameters over the Cramér-Rao bound",
        f"{LARGEST_MULTIPOSE_RATIO:g}",
        f"{ratio:.3f}",
        ratio <= LARGEST_MULTIPOSE_RATIO,
    )
    unstable = content.get("with bias instability")
    for noise, found in (("white noise", content), ("bias instability too", unstable)):
        if found is not None:
            triads = (found[triad].values() for triad in ("accelerometer", "gyroscope"))
            covered = [of["coverage"] for triad in triads for of in triad]
            what = f"multi-pose, {noise}: share of 95 % intervals that hold the truth"
            yield _coverage(what, covered, MULTIPOSE_COVERAGE)
    speed = content.get("speed")
    if speed is not None:
        yield Goal(
            "multi-pose of ten minutes at 100 Hz: times faster than `least_squares` of SciPy",
            f"{FASTER_MULTIPOSE:g}",
            f"{speed['ratio']:.1f}",
            speed["ratio"] >= FASTER_MULTIPOSE,
        )
    recorded = content.get("recorded")
    if recorded is None:
        return
    xsens = recorded["xsens, g-sensitivity"]
    what = "multi-pose, the recording of imu_tk:"
    halves = content.get("halves")
    if halves is not None:
        yield Goal(
            f"{what} difference of its halves in sigmas, root mean square of nine",
            f"{LARGEST_SCATTER:g}",
            f"{halves['rms']:.2f}",
            halves["rms"] <= LARGEST_SCATTER,
        )
    yield _at_most(f"{what} angle of gravity after a turn", IMU_TK["angle"], xsens["angle"][1], "deg")
    yield _at_most(
        f"{what} the same without g-sensitivity", IMU_TK["angle"], recorded["xsens"]["angle"][1], "deg"
    )
    unseen = "residual at orientations held out of the fit, against the published in-sample one"
    yield _at_most(f"{what} {unseen}", 1e3 * IMU_TK["norm"], 1e3 * xsens["norm"][2], "mm/s²")
    for unit, (scale, bias) in MPU_9150.items():
        found = recorded[f"mpu9150 {unit}"]
        apart = max(abs(100 * (k - 1) - stated) for k, stated in zip(found["scale"], scale, strict=True))
        yield _at_most(f"multi-pose, mpu9150 {unit}: scale from the published", 0.02, apart, "%")
        apart = max(abs(b - stated) for b, stated in zip(found["bias"], bias, strict=True))
        yield _at_most(f"multi-pose, mpu9150 {unit}: bias from the published", 3.0, 1e3 * apart, "mm/s²")


def _spin_live(content: Content) -> Iterator[Goal]:
    for way in WAYS:
        off = abs(content[way]["reduced_chi_square"] - 1.0)
        what = f"spin, {way}: distance from one of the mean of chi-square over its degrees of freedom"
        yield Goal(what, f"{LARGEST_REDUCED:g}", f"{off:.3f}", off <= LARGEST_REDUCED)
        covered = list(content[way]["coverage"].values())
        yield _coverage(f"spin, {way}: share of 95 % intervals that hold the truth", covered, LIVE_COVERAGE)


def _live(content: Content) -> Iterator[Goal]:
    for way in content["ways"]:
        over, lost, share = way["over"], int(way["lost"]), float(way["processor"])
        yield Goal(f"live, {over}: samples lost", "0", str(lost), lost == 0)
        most = LARGEST_SHARE
        yield Goal(f"live, {over}: cores busy", f"{most:g}", f"{share:.2f}", share <= most)
        for name, longest in LARGEST_LATENCY.items():
            late = float(way["latency"][name])
            what = f"live, {over}: time from a sample to its output, {name}"
            yield Goal(what, f"{1e3 * longest:g} ms", f"{1e3 * late:.2f} ms", late <= longest)
        yield _growth(f"live, {over}: memory at the end over that at the start", way["memory_growth"])
    long = content["flood"]
    what = f"live: memory after {long['hours']:g} h of samples over that at the start"
    yield _growth(what, long["memory_growth"])


def _growth(what: str, growth: float) -> Goal:
    most = LARGEST_LIVE_GROWTH
    return Goal(what, f"{most:g}", f"{growth:.3f}", growth <= most)


def _live_table(content: Content) -> Iterator[Goal]:
    for figures, way in (("figures", "without sockets"), ("figures_over_sockets", "over sockets")):
        ratio = largest_ratio(content[figures])
        what = (
            f"turntable, live {way}: error of any group of parameters over the Cramér-Rao bound, corrected "
            "for sampling error"
        )
        yield Goal(what, f"{LARGEST_RATIO:g}", f"{ratio:.3f}", ratio <= LARGEST_RATIO)
    for what, name in (("motion", "motion of the table"), ("all", "motion and rests")):
        took = largest_time(content["times"], what)
        title = f"turntable, live: time of {name} over the shortest"
        yield Goal(title, f"{LARGEST_TIME:g}", f"{took:.2f}", took <= LARGEST_TIME)


def _redundancy(content: Content) -> Iterator[Goal]:
    for distance, fit_models in content["fit_models"].items():
        for fit_model, of in fit_models.items():
            apart = f"{100 * float(distance):g} cm between the units"
            what = f"redundancy: error left by a fit of `{fit_model}`, {apart}"
            if of["error"] is None:
                yield Goal(what, f"{of['design']:g} m/s²", "refused", False)
            else:
                yield _at_most(what, of["design"], of["error"], "m/s²")


def _adoptions(content: Content) -> Iterator[Goal]:
    counts = content["counts"]
    for name in FAILURES:
        found = counts.get(name, 0)
        yield _none(f"redundancy, {content['missions']} missions: {name}", found)


@dataclass(frozen=True, slots=True)
class Wanted:
    """Goals of missions with faults: least shares, and most s until the right unit is named."""

    shares: Mapping[str, float]
    seconds: Mapping[str, float] = field(default_factory=dict)


SHARES = {
    "right": "right unit named",
    "right_within": f"right unit named within {LONG:g} s",
    "seen": "seen",
    "seen_within": f"seen within {SOON:g} s",
}
PERCENTILES = {"median": "median", "high": "95 %"}
JUDGED: dict[str, dict[str, Wanted]] = {
    "N >= 3": {
        "jump, scale": Wanted({"right": 0.98}, {"median": 0.2, "high": 2.5}),
        "ramp": Wanted({"right": 0.97}, {"median": 15.0, "high": 40.0}),
        "broken signals": Wanted({"right": 0.98}, {"median": 1.0}),
        "lost samples": Wanted({"right": 1.0}, {"high": 0.15}),
    },
    "N = 2": {
        "jump, scale": Wanted({"seen_within": 0.97, "right": 0.88}, {"median": 4.0}),
        "ramp": Wanted({"seen": 0.92, "right_within": 0.8}),
        "broken signals": Wanted({"right": 0.97}, {"median": 3.0}),
        "lost samples": Wanted({"right": 1.0}, {"high": 0.15}),
    },
}
"""By number of units and group of kinds."""
AIDED = {"N >= 3": Wanted({"right": 0.97}, {"high": 10.0}), "N = 2": Wanted({"right": 0.95})}
"""Goals for ramps, beside an aiding measurement."""
RECORDED = {"N >= 3": Wanted({"right": 0.95}, {"median": 1.0}), "N = 2": Wanted({"seen": 0.95})}
MOST_WRONG = {"N >= 3": 0.005, "N = 2": 0.01}
MOST_WRONG_RECORDED = 0.02
GATHERED = {
    "N >= 3": {"velocity": (0.1, "m/s"), "angle": (0.4, "deg")},
    "N = 2": {"velocity": (3.0, "m/s"), "angle": (1.0, "deg")},
}
"""Largest error of the output that a jump of the primary may cause."""
MOST_IN_HEALTH = {
    "N >= 3": {"units named": 0.1, "disagree": 0.5},
    "N = 2": {"units named": 0.0, "disagree": 0.5},
}
"""An hour."""
MOST_REFUSED = 0.02


def _campaign(content: Content) -> Iterator[Goal]:
    for title, of in content["sets"].items():
        where = f"redundancy, {title}"
        for group, wanted in JUDGED[title].items():
            yield from _judged(f"{where}: {group}", wanted, of["groups"][group])
        yield _named_first(where, title, of)
        misled = sum(each["misled"] for each in of["kinds"].values())
        yield _none(f"{where}: secondaries that followed a wrong primary", misled)
        for name, (most, unit) in GATHERED[title].items():
            what = f"{where}: {name} that a jump of the primary adds to the output, median"
            yield _reached_at_most(what, most, of["kinds"]["jump"][name], "median", unit)
        yield from _in_health(where, MOST_IN_HEALTH[title], of["health"])


def _aided(content: Content) -> Iterator[Goal]:
    for title, of in content["sets"].items():
        where = f"redundancy with an aiding measurement, {title}"
        yield from _judged(f"{where}: ramp", AIDED[title], of["groups"]["ramp"])
        yield _named_first(where, title, of)
        yield from _in_health(where, MOST_IN_HEALTH[title], of["health"])


def _judged(what: str, wanted: Wanted, of: Content) -> Iterator[Goal]:
    counts = {**of, "right": of["outcomes"]["right"], "seen": of["seen"]["number"]}
    for name, least in wanted.shares.items():
        share = counts[name] / max(of["missions"], 1)
        yield Goal(f"{what}: {SHARES[name]}", _percent(least), _percent(share), share >= least)
    for name, most in wanted.seconds.items():
        what_then = f"{what}: time to the right unit being named, {PERCENTILES[name]}"
        yield _reached_at_most(what_then, most, of["isolated"], name, "s")


def _in_health(where: str, most: Mapping[str, float], health: Content) -> Iterator[Goal]:
    for name, limit in most.items():
        an_hour = health[IN_HEALTH[name]] / max(health["hours"], 1e-9)
        what = f"{where}: {name} in health"
        yield Goal(what, f"{limit:g} an hour", f"{an_hour:.2f} an hour", an_hour <= limit)
    yield _none(f"{where}: wrong adoptions", health["wrongly adopted"])
    refused, adopted = health["refused that were right"], health["adopted"]
    yield _at_most_so_many(
        f"{where}: adoptions refused that were right", MOST_REFUSED, refused, refused + adopted
    )


def _precision(content: Content) -> Iterator[Goal]:
    what = f"redundancy, {content['missions']} missions: decided by single precision otherwise than by double"
    yield _none(what, len(content["different"]))


def _recorded(content: Content) -> Iterator[Goal]:
    for title, of in content["sets"].items():
        where = f"redundancy, eight recorded units, {title}"
        for span in ("before", "settled"):
            yield _none(f"{where}: units named in health ({span})", of["health"][span]["faulty"])
        faults = of["groups"]["all"]
        yield from _judged(f"{where}: faults", RECORDED[title], faults)
        what = f"{where}: a sound unit named first"
        yield _at_most_so_many(what, MOST_WRONG_RECORDED, *_wrong_of(faults))


def _named_first(where: str, title: str, of: Content) -> Goal:
    """Compares the share of sound units named first with its goal, over all kinds."""
    wrong, faults = (sum(each) for each in zip(*map(_wrong_of, of["kinds"].values()), strict=True))
    return _at_most_so_many(f"{where}: a sound unit named first", MOST_WRONG[title], wrong, faults)


def _wrong_of(of: Content) -> tuple[int, int]:
    return of["outcomes"]["wrong"], of["missions"]


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _none(what: str, found: int) -> Goal:
    return Goal(what, "none", f"{found}", found == 0)


def _at_most_so_many(what: str, share: float, found: int, of: int) -> Goal:
    return Goal(what, _percent(share), f"{found} of {of}", found <= share * of)


def _reached_at_most(what: str, goal: float, of: Content, name: str, unit: str) -> Goal:
    """Compares a percentile with a goal; what was never reached is missed."""
    if of["number"]:
        return _at_most(what, goal, of[name], unit)
    return Goal(what, f"{goal:g} {unit}", "never", False)


def _speed(content: Content) -> Iterator[Goal]:
    for name, goal in GOALS.items():
        for other, ratio in content[name]["ratios"].items():
            what = f"speed: time of {SPEED_NAMES[name]} over that of `{other}`"
            yield Goal(what, f"{goal:g}", f"{ratio:.2f}", ratio <= goal)


def _production(content: Content) -> Iterator[Goal]:
    for pages, goal in SECONDS.items():
        what = f"production line: {content['targets']} logs of half a minute, pages of {pages}"
        yield _at_most(what, goal, content["batches"][pages]["seconds"], "s")
    growth = content["memory"]["growth"]
    yield Goal(
        "production line: growth of memory where a batch is twenty times as large",
        f"{100 * (LARGEST_BATCH_GROWTH - 1.0):.0f} %",
        f"{100 * (growth - 1.0):.0f} %",
        growth <= LARGEST_BATCH_GROWTH,
    )


def _noise(content: Content) -> Iterator[Goal]:
    covered = [row["coverage"][term] for row in content["intervals"] for term in PROMISED]
    records = content["intervals"][0]["records"]
    what = f"noise: share of 95 % intervals of N, B and K that hold the truth, of {records} records"
    yield _coverage(what, covered, NOISE_COVERAGE)
    timed = content["speed"]
    yield Goal(
        f"noise: {timed['hours']:g} h of six axes at 400 Hz with fits, beside `oadev` of {timed['peer']}",
        f"{FASTER:g} times",
        f"{timed['times_faster']:.1f} times",
        timed["times_faster"] >= FASTER,
    )
    growth = content["memory"]["growth"]
    yield Goal(
        "noise: growth of memory where a record is ten times as long",
        f"{100 * (LARGEST_NOISE_GROWTH - 1.0):.0f} %",
        f"{100 * (growth - 1.0):.0f} %",
        growth <= LARGEST_NOISE_GROWTH,
    )


def _thermal(content: Content) -> Iterator[Goal]:
    drifts = content["drifts"]
    sessions = sum(row["sessions"] for row in drifts)
    ratio = max(row["ratio"] for row in drifts)
    yield Goal(
        f"thermal: error of the coefficients over the Cramér-Rao bound, worst order, {sessions} sessions",
        f"{LARGEST_THERMAL_RATIO:g}",
        f"{ratio:.3f}",
        ratio <= LARGEST_THERMAL_RATIO,
    )
    covered = [row["coverage"] for row in drifts]
    yield _coverage(
        "thermal: share of 95 % intervals that hold the truth, by order", covered, THERMAL_COVERAGE
    )
    right = min(row["right"] for row in drifts)
    yield Goal(
        "thermal: share of sessions whose order is found, worst order",
        f"{100 * RIGHT:g} %",
        f"{100 * right:.1f} %",
        right >= RIGHT,
    )


def _compare(content: Content) -> Iterator[Goal]:
    yield _coverage(
        f"compare: share of {content['pairs']} pairs of one unit that are said to be the same",
        [content["same"]],
        COMPARE_COVERAGE,
    )
    share = content["found"][f"{LARGE:g}"]["share"]
    yield Goal(
        f"compare: share of changes of {LARGE:g} sigmas that are found",
        f"{100 * FOUND:g} %",
        f"{100 * share:.1f} %",
        share >= FOUND,
    )


def _memory(content: Content) -> Iterator[Goal]:
    for name, of in content["formats"].items():
        yield Goal(
            f"memory: growth where a recording ({name}) is ten times as long",
            f"{100 * (LARGEST_GROWTH - 1.0):.0f} %",
            f"{100 * (of['growth'] - 1.0):.0f} %",
            of["growth"] <= LARGEST_GROWTH,
        )


def _readers(content: Content) -> Iterator[Goal]:
    for name, of in content["formats"].items():
        for other, ratio in of["ratios"].items():
            what = f"reading {name}: time over that of `{other}`"
            yield Goal(what, f"{LARGEST_READING:g}", f"{ratio:.2f}", ratio <= LARGEST_READING)
        yield Goal(
            f"reading {name}: growth of memory where a recording is ten times as long",
            f"{100 * (LARGEST_GROWTH - 1.0):.0f} %",
            f"{100 * (of['growth'] - 1.0):.0f} %",
            of["growth"] <= LARGEST_GROWTH,
        )


def _c_library(content: Content) -> Iterator[Goal]:
    for name, allowed in c_library.FLASH_GOALS.items():
        taken = content["flash_bytes"][name]
        what = f"library for C: flash: {name}"
        yield Goal(what, f"{allowed // 1024} KiB", f"{taken / 1024:.1f} KiB", taken <= allowed)
    for units, allowed in c_library.STATE_GOALS.items():
        taken = content["state_bytes"]["watch"][units]
        what = f"library for C: state of a set of {units} that watches"
        yield Goal(what, f"{allowed:,} bytes", f"{taken:,} bytes", taken <= allowed)
    most = max(content["stack_bound_bytes"].values())
    what, allowed = "library for C: stack: most of any call", c_library.STACK_GOAL
    yield Goal(what, f"{allowed:,} bytes", f"{most:,} bytes", most <= allowed)


def _footprint(content: Content) -> Iterator[Goal]:
    for part, allowed in FLASH_GOALS.items():
        flash = content["flash_bytes"][part]
        what = f"Cortex-M4F: flash: {FLASH_NAMES[part]}"
        yield Goal(what, f"{allowed // 1024} KiB", f"{flash / 1024:.1f} KiB", flash <= allowed)
    instructions = content["instructions"]
    for what, allowed, reached, unit in (
        *(
            (f"state: {MEMORY_NAMES[name]}", most, at_one_time(content["bytes"], name), " bytes")
            for name, most in MEMORY_GOALS.items()
        ),
        *(
            (f"stack: {STACK_NAMES[name]}", most, content["stack_bytes"][name], " bytes")
            for name, most in STACK_GOALS.items()
        ),
        *(
            (f"instructions of {INSTRUCTION_NAMES[name]}, mean", most, instructions[name]["mean"], "")
            for name, most in INSTRUCTION_GOALS.items()
        ),
        *(
            (f"instructions of {WHOLE_NAMES[name]}", most, whole_instructions(instructions, name), "")
            for name, most in WHOLE_GOALS.items()
        ),
        ("most instructions of any one sample", LARGEST_GOAL, largest(instructions), ""),
    ):
        yield Goal(f"Cortex-M4F: {what}", f"{allowed:,}{unit}", f"{reached:,.0f}{unit}", reached <= allowed)


def _at_most(what: str, goal: float, reached: float, unit: str) -> Goal:
    """Compares a figure with a goal, at the two digits that a goal is stated with."""
    is_met = float(two_digits(reached)) <= float(two_digits(goal))
    return Goal(what, f"{goal:g} {unit}", f"{reached:.3g} {unit}", is_met)


def _coverage(what: str, covered: list[float], wanted: tuple[float, float]) -> Goal:
    low, high = wanted
    outside = sum(not low <= share <= high for share in covered)
    reached = f"{100 * min(covered):.1f} to {100 * max(covered):.1f} %, {outside} of {len(covered)} outside"
    return Goal(what, f"{100 * low:g} to {100 * high:g} %", reached, outside == 0)


def _view(content: Content) -> Iterator[Goal]:
    browser = content["browser"]
    size = f"{content['samples']:.0e} samples by {content['channels']} channels".replace("e+0", "e")
    for what, wanted, reached in (
        (f"`tumble view` of {size}: time to open", OPEN_GOAL, browser["open"]),
        (f"`tumble view` of {size}: time to another range, p95", ZOOM_GOAL, browser["zoom"]["p95"]),
    ):
        yield Goal(what, f"{wanted:g} s", f"{two_digits(reached)} s", reached <= wanted)


def _bench_page(content: Content) -> Iterator[Goal]:
    bench, memory = content["bench"], content["memory"]
    beyond = bench["processor"] - content["record"]["processor"]
    growth = max(memory["server_growth"], memory["tab_growth"])
    units = f"{content['units']} units at {content['rate']:g} Hz"
    for what, wanted, reached, shown, holds in (
        ("`tumble bench`: first paint", f"{PAINT_GOAL:g} s", bench["first_paint"], "s", None),
        ("`tumble bench`: click to effect, p95", f"{CLICK_GOAL:g} s", bench["click"]["p95"], "s", None),
        (f"`tumble bench`, {units}: cores beyond `record`", f"{SHARE_GOAL:g}", beyond, "", None),
        (f"`tumble bench`, {units}: samples lost", "0", float(bench["lost"]), "", bench["lost"] == 0),
        (
            f"`tumble bench`, {units}: frames a second",
            f"{FRAMES_GOAL:g}",
            bench["frames"],
            "",
            bench["frames"] >= FRAMES_GOAL,
        ),
        (
            f"`tumble bench`: growth of memory in {memory['hours']:g} h of stream time",
            f"{GROWTH_GOAL:g}",
            growth,
            "",
            None,
        ),
    ):
        met = reached <= float(wanted.split()[0]) if holds is None else holds
        yield Goal(what, wanted, f"{two_digits(reached)} {shown}".strip(), met)


def _fleet(content: Content) -> Iterator[Goal]:
    one, two = content["one_worker"], content["two_workers"]
    overhead, gain = one / content["loop"], one / two
    what = "fleet: time of a job with one worker over that of a plain loop"
    yield Goal(what, f"{LARGEST_OVERHEAD:g}", f"{overhead:.3f}", overhead <= LARGEST_OVERHEAD)
    what = "fleet: speed of two workers on two cores over that of one"
    yield Goal(what, f"{LEAST_GAIN:g}", f"{gain:.2f}", gain >= LEAST_GAIN)
    (fewest, small), (most, large) = content["memory"].items()
    what = f"fleet: memory of the driver of {int(most):,} inputs over that of {int(fewest):,}"
    growth = large / small
    yield Goal(what, f"{LARGEST_FLEET_GROWTH:g}", f"{growth:.2f}", growth <= LARGEST_FLEET_GROWTH)


def _fleet_sessions(content: Content) -> Iterator[Goal]:
    what = f"fleet: {content['sessions']:,} sessions, a node killed in mid-run: lost, doubled or failed"
    yield _none(what, content["failed"])


def _fleet_kills(content: Content) -> Iterator[Goal]:
    kills = content["kills"]
    what = "fleet: kills of workers, nodes and drivers that lost, doubled or changed nothing"
    yield Goal(what, f"{KILLS}", f"{kills}", kills >= KILLS)


GOALS_OF: dict[str, Callable[[Content], Iterator[Goal]]] = {
    "view": _view,
    "bench_page": _bench_page,
    "accuracy": _accuracy,
    "disturbed": lambda content: chain(_disturbed(content), _bumped(content)),
    "stamps": _stamps,
    "constant_rates": _constant_rates,
    "laboratories": _laboratories,
    "truths": _truths,
    "spin": _spin,
    "spin_disturbed": _spin_disturbed,
    "spin_live": _spin_live,
    "live": _live,
    "live_table": _live_table,
    "multipose": _multipose,
    "magnetometer": _magnetometer,
    "turntable_magnetometer": _turntable_magnetometer,
    "tremor": _tremor,
    "noise_terms": _noise,
    "noise_disturbed": _noise_disturbed,
    "thermal": _thermal,
    "thermal_loops": _thermal_loops,
    "compare": _compare,
    "redundancy": _redundancy,
    "redundancy_adoptions": _adoptions,
    "redundancy_campaign": _campaign,
    "redundancy_precision": _precision,
    "redundancy_campaign_aiding": _aided,
    "redundancy_recorded": _recorded,
    "speed": _speed,
    "production": _production,
    "memory": _memory,
    "readers": _readers,
    "footprint": _footprint,
    "fleet": _fleet,
    "fleet_sessions": _fleet_sessions,
    "fleet_kills": _fleet_kills,
    "c_library": _c_library,
}
