"""Print the tables of docs/benchmarks and the figures of the README from `benchmarks/results`.

`python -m benchmarks.report [--root FOLDER] [--check]`
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from math import degrees
from pathlib import Path

from benchmarks.accuracy import LARGEST_RATIO
from benchmarks.bound import GROUPS, TRIADS
from benchmarks.c_library import rows as c_library_rows
from benchmarks.digits import three_digits, two_digits
from benchmarks.fleet_figures import LARGEST_GROWTH as LARGEST_FLEET_GROWTH
from benchmarks.fleet_figures import LARGEST_OVERHEAD, LEAST_GAIN
from benchmarks.flights.compared import cells as compared_cells
from benchmarks.flights.compared import header as compared_header
from benchmarks.flights.recorded import TIMED
from benchmarks.footprint import rows as footprint_rows
from benchmarks.goals import SPEED_NAMES, all_goals
from benchmarks.honesty.table import honesty
from benchmarks.integrity import integrity
from benchmarks.multipose import IMU_TK
from benchmarks.redundancy_figures import IN_HEALTH, flown
from benchmarks.redundancy_judgement import OUTCOMES
from benchmarks.results import Content, measured
from benchmarks.speed import GOALS
from benchmarks.spin import DESIGN as DESIGN_OF_TILTS
from benchmarks.spin import LARGEST_RATIO as LARGEST_SPIN_RATIO
from benchmarks.spin_live import WAYS as SPIN_WAYS
from benchmarks.subjects import SUBJECTS
from benchmarks.truths import BIASES, DESIGN_MRAD, TRUTHS

ROOT = Path(__file__).parent.parent
NOISES = ("white", "bias instability")

UNITS: dict[tuple[str, str], tuple[float, str]] = {
    ("accelerometer", "bias"): (1e3, "mm/s²"),
    ("gyroscope", "bias"): (degrees(3600.0), "deg/h"),
}
"""Factor from SI and name; scale in parts per million and angles in millidegrees are the same for both."""


def accuracy(content: Content) -> Iterator[str]:
    """Error against the bound and coverage, all cells of a kind of noise together."""
    yield (
        "| | | white noise: RMSE | against the bound | 95 % hold | with bias instability: RMSE "
        "| against the bound | 95 % hold |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for triad in TRIADS:
        for group in GROUPS:
            cells = [triad, group]
            for noise in NOISES:
                cells += _accuracy_cells(content["pooled"][noise][triad]["groups"][group], triad, group)
            yield _row(cells)
    yield ""
    yield _accuracy_words(content)


def _accuracy_cells(figures: Content, triad: str, group: str) -> list[str]:
    factor, unit = UNITS.get((triad, group), (1e6, "ppm") if group == "scale" else (degrees(1e3), "mdeg"))
    return [
        f"{three_digits(factor * figures['rmse'])} {unit}",
        f"{figures['ratio']:.3f} ± {figures['ratio_error']:.3f}",
        f"{100 * figures['coverage']:.1f} %",
    ]


def _accuracy_words(content: Content) -> str:
    cells = content["cells"]
    largest = max(cell["largest_without_luck"] for cell in cells)
    drawn = max((cell["largest"] for cell in cells), key=lambda of: float(of["ratio"]))
    above = sum(cell["above"] for cell in cells)
    parameters = sum(cell["parameters"] for cell in cells)
    covered = [each for cell in cells for of in cell["coverage"].values() for each in of.values()]
    return (
        f"{len(cells)} cells of {content['sessions']} simulated sessions: mounting 0, 1 and "
        "3 deg, table error 0, 0.05 and 0.2 deg, clocks shared and apart. In single cells the ratio of any "
        f"parameter is at most {largest:.3f}, corrected for sampling error; without that, {above} of "
        f"{parameters} are above {LARGEST_RATIO:g}, the largest {drawn['ratio']:.3f} ± "
        f"{drawn['ratio_error']:.3f}. Intervals of a group hold {100 * min(covered):.1f} to "
        f"{100 * max(covered):.1f} %."
    )


def disturbed(content: Content) -> Iterator[str]:
    """Sigmas where the table shakes, and where logs lack samples."""
    yield (
        "| shaking, rms of each axis | rate | sigma over error: bias | scale | non-orthogonality | mounting "
        "| 95 % hold |"
    )
    yield "|---|---|---|---|---|---|---|"
    for case in content["shaking"]:
        figures = case["accelerometer"]
        name = case["what"] + (f", {case['size']:g} m/s²" if case["size"] else "")
        ratios = [f"{figures['sigma_over_error'][group]:.2f}" for group in GROUPS]
        yield _row([name, f"{case['rate']:g} Hz", *ratios, f"{100 * figures['coverage']:.1f} %"])
    yield ""
    yield (
        "| gyroscopes: rocking, rms about each axis | rate | sigma over error: bias | scale "
        "| non-orthogonality | mounting | 95 % hold |"
    )
    yield "|---|---|---|---|---|---|---|"
    for case in content["rocking"]:
        figures = case["gyroscope"]
        name = case["what"] + (f", {case['size']:g} rad/s" if case["size"] else "")
        ratios = [f"{figures['sigma_over_error'][group]:.2f}" for group in GROUPS]
        yield _row([name, f"{case['rate']:g} Hz", *ratios, f"{100 * figures['coverage']:.1f} %"])
    yield ""
    yield "| samples missing | in | accelerometer: 95 % hold | gyroscope: 95 % hold | largest error, sigmas |"
    yield "|---|---|---|---|---|"
    for case in content["missing"]:
        triads = [case[triad] for triad in TRIADS]
        covered = [f"{100 * figures['coverage']:.1f} %" for figures in triads]
        largest = max(figures["largest"] for figures in triads)
        yield _row([f"{100 * case['share']:g} %", case["where"], *covered, f"{largest:.1f}"])
    yield ""
    yield "| bump in a rest | drift of biases, 1-sigma | accelerometer: 95 % hold | gyroscope: 95 % hold |"
    yield "|---|---|---|---|"
    for case in content["bumping"]:
        drift = f"{case['drift']:g} mm/s², {0.1 * case['drift']:g} mrad/s" if case["drift"] else "none"
        covered = [f"{100 * case[triad]['coverage']:.1f} %" for triad in TRIADS]
        bump = f"by {case['angle']:g}°" if case["angle"] else "none"
        bump += f" ({case['sessions']} sessions)" if "sessions" in case else ""
        yield _row([bump, drift, *covered])
    yield ""
    yield (
        f"{content['sessions']} simulated sessions a case, six faces of 10 s, turns of 90° in four "
        "seconds. The structure shakes reference and target alike; samples are lost one by one, by each unit "
        "its own. All parameters of a triad together."
    )


def cases(results: Mapping[str, Content]) -> Iterator[str]:
    """Figures that once went wrong, before and now: of given cases, and of other benchmarks."""
    yield "| case | figure | before | now |"
    yield "|---|---|---|---|"
    for row in results.get("cases", {}).get("rows", ()):
        yield _row([row[key] for key in ("case", "figure", "before", "now")])
    rocking = results.get("disturbed", {}).get("rocking", ())
    if rocking:
        ratios = [ratio for row in rocking for ratio in row["gyroscope"]["sigma_over_error"].values()]
        figure = "sigmas of the gyroscope over its errors"
        now = f"{min(ratios):.2f} to {max(ratios):.2f}"
        yield _row(["the structure rocks", figure, "3 to 15.9", now])
    for row in results.get("spin_disturbed", {}).get("rows", ()):
        if row["name"].startswith("slips along the floor"):
            largest = max(of["largest"] for of in row["groups"].values() if of["largest"] is not None)
            reported = f"{100 * row['said']:.0f} % reported as not met" if row["said"] > 0.5 else "held"
            case = f"a robot {row['name']}, 10 cm/s"
            yield _row([case, "largest error", "8 sigma", f"{largest:.1f} sigma, {reported}"])


def others(results: Mapping[str, Content]) -> Iterator[str]:
    """Answers to recordings of others: how many are right, and what is missing of the others."""
    rows = results.get("cases", {}).get("world", ())
    if not rows:
        yield "Not measured yet."
        return
    missing = [row for row in rows if row["missing"]]
    yield f"{len(rows) - len(missing)} of {len(rows)} answers are right."
    if missing:
        yield ""
        yield "| recording: command | missing |"
        yield "|---|---|"
    for row in missing:
        missing_here = row["missing"].replace("|", "\\|")
        yield _row([row["case"], f"`{missing_here}`"])


def stamps(content: Content) -> Iterator[str]:
    """Errors of a gyroscope whose stamps come late, before and after a fit; live clocks under load."""
    yield (
        "| stamps late by | matrix, largest error, stamps as they are | fitted "
        "| errors over sigma, rms, stamps as they are | fitted |"
    )
    yield "|---|---|---|---|---|"
    for case in content["stamps"]:
        before, after = case["before"], case["after"]
        ppm = [f"{each['ppm']:.0f} ppm" for each in (before, after)]
        yield _row([case["lateness"], *ppm, *(f"{each['z']:.2f}" for each in (before, after))])
    yield ""
    yield (
        "| load of the computer | largest jump of a live clock after 10 s | leaps | errors within two sigma |"
    )
    yield "|---|---|---|---|"
    for case in content["loads"]:
        jump, held = f"{1e6 * case['jump']:.0f} µs", f"{100 * case['held']:.0f} %"
        yield _row([case["load"], jump, str(case["leaps"]), held])
    yield ""
    yield (
        f"{content['stamps'][0]['sessions']} simulated sessions a case at 100 Hz, six faces, turns at "
        "120 deg/s, both units late by themselves; M and b of the gyroscope. Load: 60 s of samples with a "
        "delay of their own each."
    )


def laboratories(content: Content) -> Iterator[str]:
    """U and intervals where the reference errs as it states, and the choice of fitting g-sensitivity."""
    yield (
        "| laboratory | accelerometer: U holds | share of type B | gyroscope: U holds | share of type B "
        "| all, goal 94 to 96.5 % |"
    )
    yield "|---|---|---|---|---|---|"
    for case in content["certified"]:
        shares = [case[triad][kind] for triad in TRIADS for kind in ("coverage", "share_of_b")]
        whole = sum(case[triad]["coverage"] for triad in TRIADS) / len(TRIADS)
        yield _row([case["laboratory"], *(f"{100 * share:.1f} %" for share in (*shares, whole))])
    yield ""
    yield (
        f"{content['certified'][0]['sessions']} simulated laboratories each: certificate (calibration, half "
        "a year of drift, 2 K), gravity and temperature err within what is stated. `as noise` states as much "
        "as the noise of a session leaves, `sharp` a tenth, `vague` ten times that; `warm` warms up by 2 K."
    )
    yield ""
    yield (
        "| stated of each element of the reference's M | accelerometer: 95 % hold | without the reference "
        "| gyroscope: 95 % hold | without the reference |"
    )
    yield "|---|---|---|---|---|"
    for case in content["references"]:
        shares = [case[triad][kind] for triad in TRIADS for kind in ("coverage", "without")]
        yield _row([f"{case['stated']:.0e}", *(f"{100 * share:.1f} %" for share in shares)])
    yield ""
    yield (
        "| G, rad/s per m/s², each element | fitted in | 95 % hold | always fitted: 95 % hold "
        "| never fitted: 95 % hold |"
    )
    yield "|---|---|---|---|---|"
    for case in content["responses"]:
        shares = [case[kind] for kind in ("chosen", "chosen_coverage", "always_coverage", "never_coverage")]
        yield _row([f"{case['size']:g}", *(f"{100 * share:.1f} %" for share in shares)])
    yield ""
    yield (
        f"{content['sessions']} simulated sessions a case, six faces of 5 s. The calibration of the "
        "reference errs as it states; `without the reference` counts the covariance of the fit alone."
    )


def truths(content: Content) -> Iterator[str]:
    """Four truths, and where the bias comes from, beside the figures of the design."""
    yield "| truth used for the target | table repeatable | design | table errs 0.05 deg a pose | design |"
    yield "|---|---|---|---|---|"
    for truth in TRUTHS:
        cells = [f"`{truth}`"]
        for column, design in zip(("0", "0.05"), DESIGN_MRAD[truth], strict=True):
            found = content["columns"][column][truth]["non_orthogonality"]
            cells += [f"{three_digits(1e3 * found['rms'])} mrad", f"{design:g}"]
        yield _row(cells)
    yield ""
    yield "| bias of the target from | table errs 0.2 deg a pose | design |"
    yield "|---|---|---|"
    for source, (words, stated) in BIASES.items():
        found = content["columns"]["0.2"][source]["bias"]
        design_figure = "" if stated is None else f"{1e3 * stated:g}"
        yield _row([words, f"{three_digits(1e3 * found['rms'])} mm/s²", design_figure])
    yield ""
    yield (
        f"Root mean square over {content['sessions']} simulated sessions of the norm of the error; "
        "mounting 1 deg, non-orthogonality 0.5 deg, bias 0.3 m/s²."
    )


def speed(content: Content) -> Iterator[str]:
    """Ratios of times, and the batch."""
    yield "| | samples a second | against | takes longer by a factor of | goal |"
    yield "|---|---|---|---|---|"
    for name, words in SPEED_NAMES.items():
        figures = content[name]
        rate = figures.get("samples_a_second") or figures.get("rows_a_second")
        a_second = f"{rate / 1e6:.1f} million" if rate else ""
        for other, ratio in figures["ratios"].items():
            yield _row([words, a_second, f"`{other}`", f"{ratio:.2f}", f"{GOALS[name]:g}"])
    batch = content["batch"]
    yield ""
    yield (
        f"{batch['targets']} targets of {batch['minutes']:.0f} minutes at 200 Hz: "
        f"{batch['targets_a_second']:.0f} targets a second, with {100 * batch['share_of_cores']:.0f} % of "
        f"{batch['cores']} cores in use."
    )


def production(content: Content) -> Iterator[str]:
    """Time and memory of a batch of files."""
    yield "| pages | s | of processor | against `pyarrow.csv.read_csv` of the logs | peak memory |"
    yield "|---|---|---|---|---|"
    for pages, of in content["batches"].items():
        times = [f"{of[name]:.0f}" for name in ("seconds", "processor_seconds", "ratio")]
        yield _row([pages, *times, f"{of['peak_bytes'] / 2**20:.0f} MiB"])
    counts, peaks = content["memory"]["targets"], content["memory"]["peak_bytes"]
    sizes = " and ".join(f"{peak / 2**20:.0f} MiB for {n}" for n, peak in zip(counts, peaks, strict=True))
    yield ""
    yield (
        f"{content['targets']} logs of half a minute at 200 Hz, from CSV to calibration files, summary and "
        f"report; against pyarrow in processor time. {content['machine']['cores']} cores, with "
        f"{content['load']:.0f} other processes running. Peak memory without pages: {sizes} targets."
    )


def memory(content: Content) -> Iterator[str]:
    """Peak memory of a recording and of one ten times as long."""
    few, many = content["samples"]
    yield f"| format | peak memory, {few} samples | {many} samples | growth |"
    yield "|---|---|---|---|"
    for name, figures in content["formats"].items():
        sizes = [f"{size / 2**20:.0f} MiB" for size in figures["peak_bytes"]]
        yield _row([name, *sizes, f"{100 * (figures['growth'] - 1.0):.0f} %"])
    yield ""
    yield (
        "Peak resident memory of a process that reads the recording and finds its rests, interpreter and "
        "libraries included."
    )


def readers(content: Content) -> Iterator[str]:
    """Each format against its library, and its memory over length."""
    yield "| format | MB/s | against | takes longer by a factor of | peak memory | of ten times as much |"
    yield "|---|---|---|---|---|---|"
    for name, of in content["formats"].items():
        for other, ratio in of["ratios"].items():
            peaks = [f"{peak / 2**20:.0f} MiB" for peak in of["peak_bytes"]]
            yield _row([name, f"{of['megabytes_a_second']:.0f}", f"`{other}`", f"{ratio:.2f}", *peaks])
    yield ""
    yield (
        "From file to samples checked and in SI units, against bare reading of the same file into columns. "
        "The bytes of a packed file are those packed."
    )


def view(content: Content) -> Iterator[str]:
    """Time to open a long log in a browser and to zoom, and the same by other means."""
    browser, memory_used = content["browser"], content["browser"]["memory"]
    yield "| | time |"
    yield "|---|---|"
    yield _row(["from opening the address to the first picture", f"{browser['first_picture']:.2f} s"])
    yield _row(["to the picture of the whole log", f"{browser['open']:.2f} s"])
    yield _row(["to rests, turns and inspection", f"{browser['inspected']:.2f} s"])
    zoom = browser["zoom"]
    yield _row(["from a key to the picture of another range, p50", f"{1e3 * zoom['p50']:.0f} ms"])
    yield _row(["the same, p95", f"{1e3 * zoom['p95']:.0f} ms"])
    yield ""
    yield "| by | reading | picture of the whole log | bins whose highest value is hidden |"
    yield "|---|---|---|---|"
    for row in content["peers"]:
        lost = "none" if not row["lost"] else f"{100 * row['lost']:.0f} %"
        yield _row([row["way"], f"{row['read']:.2f} s", f"{1e3 * row['window']:.0f} ms", lost])
    yield ""
    yield (
        f"{content['samples']} samples by {content['channels']} channels in {content['megabytes']:.0f} MB of "
        f"Parquet, {zoom['count']} zooms in Chromium, 1400 px wide. The server holds "
        f"{memory_used['own']:.0f} MiB, and maps {memory_used['mapped']:.0f} MiB of files."
    )


def bench_page(content: Content) -> Iterator[str]:
    """Paint, clicks, frames and load of the bench page, beside `tumble record`, and its memory."""
    bench, peer, memory_used = content["bench"], content["record"], content["memory"]
    yield "| | `tumble bench` | `tumble record` |"
    yield "|---|---|---|"
    shares = (f"{two_digits(each['processor'])} of a core" for each in (bench, peer))
    yield _row([f"processor, {content['units']} units at {content['rate']:g} Hz", *shares])
    yield _row(["samples lost", *(f"{each['lost']} of {each['sent']}" for each in (bench, peer))])
    yield _row(["frames a second", f"{bench['frames']:.0f}", ""])
    yield _row(["from the address to the first paint", f"{bench['first_paint']:.2f} s", ""])
    yield _row(["until it takes clicks", f"{bench['ready']:.2f} s", ""])
    for name in ("p50", "p95"):
        yield _row([f"from a click to its effect, {name}", f"{1e3 * bench['click'][name]:.0f} ms", ""])
    yield ""
    yield (
        f"Over {memory_used['hours']:g} h of stream time, at {memory_used['times_real_time']:g} times, the "
        f"memory of the server grew to {memory_used['server_growth']:.3f} of its size, "
        f"{memory_used['server']:.0f} MiB, that of the tab to {memory_used['tab_growth']:.3f}, "
        f"{memory_used['tab']:.0f} MiB."
    )


TEN_GIGABIT = 1250.0
"""MB/s."""


def fleet(content: Content) -> Iterator[str]:
    """Cost of a fleet beside a plain loop, and what a million logs take."""
    small, large = content["memory"].values()
    one, two = content["one_worker"], content["two_workers"]
    yield "| | reached | goal |"
    yield "|---|---|---|"
    overhead = f"time of a job with one worker over that of a plain loop, {content['logs']} logs"
    yield _row([overhead, f"{one / content['loop']:.3f}", f"{LARGEST_OVERHEAD:g}"])
    yield _row(["speed of two workers over that of one, two cores", f"{one / two:.2f}", f"{LEAST_GAIN:g}"])
    inputs = " over that of ".join(f"{int(count):,}" for count in reversed(content["memory"]))
    growth = f"{large / small:.2f} ({large:.0f} over {small:.0f} MiB)"
    yield _row([f"memory of the driver of {inputs} inputs", growth, f"{LARGEST_FLEET_GROWTH:g}"])
    yield ""
    yield "| a million logs of ten minutes | TB | core hours | one decoding | fit | cores fed by 10 Gbit/s |"
    yield "|---|---|---|---|---|---|"
    for log_format, cost in content["cost"].items():
        hours = [f"{cost[name]:.0f}" for name in ("core_hours", "decode", "fit")]
        fed = TEN_GIGABIT / cost["megabytes_a_second_and_core"]
        yield _row([log_format, f"{cost['terabytes']:.2g}", *hours, f"{fed:.0f}"])
    yield ""
    passes = max(cost["passes"] for cost in content["cost"].values())
    yield (
        "`tumble spin` of simulated logs at 100 Hz, processor time of one log times a million. The "
        f"procedure decodes a log {passes} times."
    )


def fleet_sessions(content: Content) -> Iterator[str]:
    """Simulated sessions on two nodes, one of which is killed."""
    covered = " and ".join(f"{100.0 * each:.1f} %" for each in content["coverage"].values())
    yield "| | |"
    yield "|---|---|"
    yield _row(["sessions simulated, calibrated and held against their truth", f"{content['sessions']:,}"])
    yield _row(["lost, doubled, failed", f"{content['failed']}"])
    yield _row(["node killed after", f"{content['killed_at']:,} sessions"])
    yield _row(["tasks lost with it and given again", f"{content['tasks_lost']}"])
    yield _row(["rows that were written twice and count once", f"{content['rows_written_twice']}"])
    yield _row(["equal to a plain loop, bit for bit", f"{content['compared']:,} of {content['compared']:,}"])
    yield _row(["time", f"{content['seconds'] / 60.0:.1f} min, {content['a_second']:.0f} sessions a second"])
    yield _row(["memory of the driver", f"{content['driver_mib']:.0f} MiB"])
    yield _row(["95 % intervals that hold the truth, accelerometer and gyroscope", covered])


def fleet_kills(content: Content) -> Iterator[str]:
    """Random kills beside a store that fails."""
    killed = ", ".join(f"{count} of a {kind}" for kind, count in content["killed"].items())
    calls, failed = content["store_calls"], content["store_failed"]
    yield (
        f"{content['kills']} kills at random moments ({killed}) in {content['jobs']} jobs of "
        f"{content['sessions'] // content['jobs']:,} sessions. Their store failed {failed:,} of {calls:,} "
        f"calls ({100.0 * failed / calls:.1f} %). Nothing was lost, doubled or other than in a plain loop."
    )
    yield ""
    yield (
        f"{content['rows_written_twice']:,} rows were written twice and count once. The store ended "
        f"{content['drivers_ended_by_store']} drivers, which were started again."
    )


SPIN_UNITS: dict[str, tuple[float, str]] = {
    "accelerometer bias": (1e3, "mm/s²"),
    "gyroscope bias": (1e6, "µrad/s"),
    "roll and pitch": (degrees(1e3), "mdeg"),
    "floor tilt": (degrees(1e3), "mdeg"),
    "lever arm": (1e3, "mm"),
    "scale": (1e6, "ppm"),
}


def spin(content: Content) -> Iterator[str]:
    """Tilt of the floor beside the design, error against the bound and coverage, single precision, bytes."""
    yield "| floor tilt | published | design | level-free | design |"
    yield "|---|---|---|---|---|"
    for tilt, design in DESIGN_OF_TILTS.items():
        found = content["tilts"][f"{tilt:g}"]
        cells = [f"{tilt:g} deg"]
        for name, stated in zip(("published", "level_free"), design, strict=True):
            cells += [f"{three_digits(1e3 * found[name])} mm/s²", f"{1e3 * stated:g}"]
        yield _row(cells)
    yield ""
    yield (
        f"Root mean square over {content['sessions']} simulated sessions of the norm of the error of the "
        "accelerometer bias. Each has 5 s of rest at 100 Hz, 3 turns each way at 1 rad/s, noise 0.02 m/s² "
        "and 0.002 rad/s a sample, a lever arm of 12 cm, and a gyroscope scale error of 1 %."
    )
    yield ""
    yield "| | RMSE | against the bound | in single cells | 95 % hold | in single cells |"
    yield "|---|---|---|---|---|---|"
    for group, figures in content["pooled"].items():
        yield _row(_spin_cells(content, group, figures))
    yield ""
    yield _spin_words(content)
    yield ""
    yield (
        "| f32 less f64, largest of any session, sigmas | "
        + " | ".join(f"{rate} Hz" for rate in content["precision"])
        + " |"
    )
    yield "|" + "---|" * (1 + len(content["precision"]))
    for group in SPIN_UNITS:
        yield _row([group, *(f"{100 * of[group]:.2f} %" for of in content["precision"].values())])
    yield ""
    size = content["bytes"]
    yield (
        f"{content['precision_sessions']} sessions a rate, floor 1 deg; at 9.8 m/s² f32 has steps of "
        "1e-6 m/s². "
        f"The state machine takes {size['f32']} bytes in f32, {size['f64']} in f64."
    )


def multipose(content: Content) -> Iterator[str]:
    """Error against the bound and coverage of sessions by hand, then every recording: a result or why not."""
    unstable = content.get("with bias instability", {})
    titles = "95 % hold | the same with bias instability"
    yield f"| | RMSE over the bound | RMSE over the stated sigma | {titles} |"
    yield "|---|---|---|---|---|"
    for triad, figure in (("accelerometer", "ratio"), ("gyroscope", "error_over_sigma")):
        for group, of in content[triad].items():
            both = (of, unstable[triad][group] if unstable else None)
            held = ["" if each is None else f"{100 * each['coverage']:.1f} %" for each in both]
            errors = [f"{of[figure]:.3f}", ""]
            yield _row([f"{triad} {group}", *(errors if figure == "ratio" else errors[::-1]), *held])
    yield ""
    yield (
        f"{content['sessions']} simulated sessions, 18 orientations of 4 s at 100 Hz, consumer grade with "
        "white noise alone, or with bias instability; the bound is that of |u| = g at the true rests and of "
        "white noise, in numpy."
    )
    speed = content.get("speed")
    if speed is not None:
        yield ""
        yield (
            f"{speed['minutes']:.1f} minutes at 100 Hz, {speed['rests']} rests: {speed['seconds']:.3g} s for "
            f"all of it, {speed['peer_seconds']:.3g} s for `scipy.optimize.least_squares` with analytic "
            f"Jacobian, which is given rests and turns: {speed['ratio']:.1f} times faster."
        )
    recorded = content.get("recorded", {})
    yield ""
    norm = "\\|f\\| minus g: raw, calibrated, held out of the fit, mm/s²"
    yield f"| recording | orientations | {norm} | after a turn, deg |"
    yield "|---|---|---|---|"
    for name, of in recorded.items():
        if "refused" in of:
            yield _row([name, "refused", of["refused"].partition(";")[0].replace("|", "\\|"), ""])
            continue
        norms = ", ".join("none" if each is None else three_digits(1e3 * each) for each in of["norm"])
        angles = (
            " → ".join(three_digits(each) for each in of["angle"]) if of["angle"] else of["gyroscope_reason"]
        )
        yield _row([name, str(of["directions"]), norms, angles])
    xsens = recorded.get("xsens, g-sensitivity")
    if xsens:
        yield ""
        yield "| the recording of imu_tk | imu_tk, published | Tumble |"
        yield "|---|---|---|"
        for what, key in (
            ("accelerometer scale, counts per m/s²", "scale"),
            ("accelerometer bias, counts", "bias"),
            ("gyroscope scale, counts per rad/s", "rate_scale"),
        ):
            cells = [", ".join(f"{each:.1f}" for each in figures) for figures in (IMU_TK[key], xsens[key])]
            yield _row([what, *cells])
        halves = content.get("halves")
        if halves is not None:
            what = "every second rest against the others, accelerometer, sigmas: rms, largest"
            yield _row([what, "", f"{halves['rms']:.2f}, {halves['largest']:.2f}"])
        yield _row(
            ["angle of gravity after a turn, deg", f"{IMU_TK['angle']:g}", three_digits(xsens["angle"][1])]
        )


def no_equipment(content: Content) -> Iterator[str]:
    """Every recording of others through every procedure without equipment: a result, or why not."""
    yield "| recording | `tumble multipose` | `tumble noise` | `tumble thermal` |"
    yield "|---|---|---|---|"
    for name, found in content["recordings"].items():
        yield _row([name, *(_without_equipment(procedure, of) for procedure, of in found.items())])
    yield ""
    yield (
        f"{len(content['recordings'])} recordings, {content['seconds']:.0f} s for all; no traceback, and no "
        "result that contradicts what is published of them. Refused is what does not show what is asked."
    )


def _without_equipment(procedure: str, found: Content) -> str:
    if "refused" in found:
        return f"refused: {found['refused']}".replace("|", "\\|")
    match procedure:
        case "multipose":
            gyroscope = found["gyroscope_reason"] or f"{two_digits(found['angle'])}° after a turn"
            figures = (
                f"{found['directions']} orientations; {two_digits(1e3 * found['held_out'])} mm/s² at those "
                f"held out of the fit; {gyroscope}"
            )
        case "noise":
            each = [density for triad in found["density"].values() for density in triad]
            shown = sum(density is not None for density in each)
            figures = f"{found['seconds_still']:.0f} s still; white noise of {shown} of {len(each)} channels"
        case _:
            figures = f"{found['range'][0]:.1f} to {found['range'][1]:.1f} °C"
    return f"{found['verdict']}: {figures}"


def _spin_cells(content: Content, group: str, figures: Content) -> list[str]:
    factor, unit = SPIN_UNITS[group]
    single = [cell["figures"][group] for cell in content["cells"] if group in cell["figures"]]
    ratios = [of["ratio"] for of in single]
    covered = [100 * of["coverage"] for of in single]
    return [
        group,
        f"{three_digits(factor * figures['rmse'])} {unit}",
        f"{figures['ratio']:.3f} ± {figures['ratio_error']:.3f}",
        f"{min(ratios):.3f} to {max(ratios):.3f}",
        f"{100 * figures['coverage']:.1f} %",
        f"{min(covered):.1f} to {max(covered):.1f} %",
    ]


def _spin_words(content: Content) -> str:
    single = [of["ratio"] for cell in content["cells"] for of in cell["figures"].values()]
    above = sum(ratio > LARGEST_SPIN_RATIO for ratio in single)
    return (
        f"{len(content['cells'])} cells of {content['sessions']} simulated sessions: floor 0, 1 and 3 deg, "
        "3 turns both ways and one way, even and uneven speed, 50 and 200 Hz. Mounting, uphill bearing, "
        f"biases and the gyroscope's scale error (1 %) are drawn anew. {above} of {len(single)} ratios are "
        f"above {LARGEST_SPIN_RATIO:g}. Scale is judged in sessions that show it, floor tilt where there is "
        "one."
    )


def noise_terms(content: Content) -> Iterator[str]:
    """Table of the coverage of intervals of noise terms, and of the speed of their estimation."""
    terms = list(content["intervals"][0]["coverage"])
    yield _row(["95 % intervals hold the truth, identifiable in", *terms])
    yield "|" + "---|" * (1 + len(terms))
    for row in content["intervals"]:
        shares = (
            f"{100 * row['coverage'][term]:.1f} %, {100 * row['identifiable'][term]:.0f} %" for term in terms
        )
        yield _row([row["name"], *shares])
    timed, (short, long) = content["speed"], content["memory"]["mebibytes"]
    yield ""
    yield (
        f"{content['intervals'][0]['records']} records of each. {timed['hours']:g} h of six axes at "
        f"400 Hz, {timed['averaging_times']} averaging times: {timed['seconds_with_fit']:.1f} s with fits "
        "and intervals, "
        f"`oadev` of {timed['peer']} {timed['peer_seconds']:.0f} s. Where Tumble does not start a "
        f"difference at every sample, they differ by {timed['largest_difference_sigmas']:.2f} sigma at most. "
        f"The process takes {short:.0f} MiB after a million samples, {long:.0f} MiB after ten."
    )


def tremor(content: Content) -> Iterator[str]:
    """Poses that multi-pose uses of hands that tremble, and whether their sigmas hold."""
    cells = (f"{triad}: {figure}" for triad in TRIADS for figure in ("errors over sigma, rms", "95 % hold"))
    yield _row(["rests that tremble", "poses used", *cells])
    yield "|---|---|---|---|---|---|"
    for of in content["tremors"]:
        name = f"{of['trembling']} of {content['poses']}"
        name += f", by {of['amplitude']:g}°" if of["trembling"] else ""
        used = f"{100 * of['used'] / of['of']:.1f} %"
        shares = [
            figure
            for triad in TRIADS
            for figure in (f"{of[triad]['z']:.2f}", f"{100 * of[triad]['coverage']:.1f} %")
        ]
        yield _row([name, used, *shares])
    low, high = content["frequencies"]
    yield ""
    yield (
        f"{content['tremors'][0]['sessions']} simulated sessions of each, white noise alone; the tremor "
        f"turns about all axes, with one frequency a session of {low:g} to {high:g} Hz."
    )


def magnetometer(content: Content) -> Iterator[str]:
    """Errors of magnetometers over the bound, and recordings of others."""
    figures = ("RMSE over the bound", "95 % hold")
    ways = ("at rests", "turned without a rest")
    yield _row(["", *(f"{way}: {figure}" for way in ways for figure in figures)])
    yield "|---|---|---|---|---|"
    for name, ratio in content["rests"]["ratio"].items():
        cells = [name, f"{ratio:.3f}", f"{100 * content['rests']['coverage'][name]:.1f} %"]
        if name in content["turned"]["ratio"]:
            cells += [f"{content['turned']['ratio'][name]:.3f}"]
            cells += [f"{100 * content['turned']['coverage'][name]:.1f} %"]
        yield _row([*cells, *[""] * (5 - len(cells))])
    yield ""
    yield (
        f"{content['sessions']} simulated sessions each: 18 rests of 4 s with 0.3 µT of noise a sample, and "
        f"60 s turned without a rest. {100 * content['magnets_found']:.1f} % of magnets of 9 µT near a rest "
        f"were found. In {100 * content['rests']['alarms']:.1f} % of sessions without one a rest was named."
    )
    yield ""
    yield "| recording of others | samples | raw | by its author | Tumble | biases apart over the field |"
    yield "|---|---|---|---|---|---|"
    for each in content["recordings"]:
        name = f"[{each['name']}](https://{each['source']})"
        before = [f"{100 * each[key]:.2f} %" for key in ("raw", "published")]
        before[1] += " (program)" if each["by_program"] else ""
        found = (
            [f"refused: {each['refusal']}", ""]
            if "refusal" in each
            else [f"{100 * each['found']:.2f} %", f"{100 * each['bias_share']:.1f} %"]
        )
        yield _row([name, str(each["samples"]), *before, *found])
    yield ""
    yield (
        "Scatter of the length of the field, a share of it, by quartiles. By its author: the correction that "
        "was published with the recording or, where marked, that of the program published with it."
    )


def turntable_magnetometer(content: Content) -> Iterator[str]:
    """Errors of magnetometers on a turntable over the bound, magnets and fields that differ."""
    even, magnet, differing = (content[name] for name in ("even", "magnet", "differing"))
    yield "|  | RMSE over the bound | 95 % hold | 95 % hold where the field differs at the target |"
    yield "|---|---|---|---|"
    for name, ratio in even["ratio"].items():
        held = (f"{100 * each['coverage'][name]:.1f} %" for each in (even, differing))
        yield _row([name, f"{ratio:.3f}", *held])
    yield ""
    yield (
        f"{even['sessions']} simulated sessions of twelve rests of {content['rest']:g} s, 0.3 µT of noise a "
        f"sample at 50 Hz. In {100 * (1 - even['named_right']):.1f} % of them a rest was named, and in "
        f"{100 * even['differences']:.1f} % a difference of the field. "
        "A magnet of 9 µT near one rest: named, and no other rest, in "
        f"{100 * magnet['named_right']:.1f} % of {magnet['sessions']}. A field that differs by "
        f"{content['difference']:g} µT at the target: found in {100 * differing['differences']:.1f} % of "
        f"{differing['sessions']}."
    )


def noise_disturbed(content: Content) -> Iterator[str]:
    """White noise of hours with a disturbance, false alarms of clean hours, and steps that are found."""
    yield "| disturbance | error of N, rms | half of its interval | 95 % hold | named right |"
    yield "|---|---|---|---|---|"
    for of in content["density"]:
        figures = (f"{100 * of[key]:.2f} %" for key in ("error", "half_width"))
        yield _row(
            [of["case"], *figures, f"{100 * of['coverage']:.0f} %", f"{100 * of['named']:.0f} %"],
        )
    yield ""
    yield "| clean hour | channels | steps, ramps and knocks that are named |"
    yield "|---|---|---|"
    for of in content["clean"]:
        yield _row([of["noise"], str(of["channels"]), str(of["alarms"])])
    yield ""
    yield "| step, where N is 1 mm/s²/√Hz | found, alone and at its time |"
    yield "|---|---|"
    for of in content["steps"]:
        yield _row([f"{of['size']:g} mm/s²", f"{100 * of['found']:.0f} %"])
    yield ""
    yield (
        f"{content['density'][0]['channels']} channels of each disturbance and step, six to a record of an "
        "hour at 100 Hz."
    )


def thermal_loops(content: Content) -> Iterator[str]:
    """Table of hysteresis loops and lags: detection, errors, and coverage of their intervals."""
    yield (
        "| loop of an axis | largest difference: truth, mean found | error, rms | 95 % hold "
        "| mean difference: truth, mean found | error, rms | 95 % hold | loop found | lag found, of none |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for of in content["loops"]:
        cells = [of["loop"]]
        for key in ("largest", "mean"):
            figures = of[key]
            cells.append(f"{1e3 * figures['truth']:g}, {1e3 * figures['mean']:.2f} mm/s²")
            cells += [f"{1e3 * figures['error']:.2f} mm/s²", f"{100 * figures['coverage']:.0f} %"]
        yield _row([*cells, *(f"{of[key]} of {of['sessions']}" for key in ("found", "lags"))])
    yield ""
    yield "| lag of 60 s, loop of an axis | lag found | mean | error, rms | stated sigma | 95 % hold |"
    yield "|---|---|---|---|---|---|"
    for of in content["lags"]:
        figures = [f"{of[key]:.1f} s" for key in ("mean", "error", "sigma")] if of["found"] else [""] * 3
        held = f"{100 * of['coverage']:.0f} %" if of["found"] else ""
        yield _row([of["loop"], f"{of['found']} of {of['sessions']}", *figures, held])
    if "wandering" in content:
        yield ""
        yield "| no lag, no loop, biases wander: B over N, 1/√s | lag found | the largest |"
        yield "|---|---|---|"
        for of in content["wandering"]:
            shown = f"{of['largest']:.0f} s" if of["lags"] else ""
            yield _row([f"{of['wander']:g}", f"{of['lags']} of {of['sessions']}", shown])
    yield ""
    yield (
        f"{content['loops'][0]['sessions']} sessions of each made by numpy alone: an hour from -10 to 60 °C "
        "and back, 5 mm/s² of noise a sample at 2 Hz."
    )


def thermal(content: Content) -> Iterator[str]:
    """Table of temperature drifts: ratio to the bound, coverage of intervals, chosen order."""
    yield _row(
        [
            "highest power",
            "order found",
            "coefficients, RMSE over the bound",
            "95 % hold",
            "curve, wrong orders too",
        ]
    )
    yield "|---|---|---|---|---|"
    for of in content["drifts"]:
        curve = "" if of["curve_ratio"] is None else f"{of['curve_ratio']:.3f}"
        share = f"{100 * of['right']:.1f} %"
        yield _row([str(of["order"]), share, f"{of['ratio']:.3f}", f"{100 * of['coverage']:.1f} %", curve])
    yield ""
    yield f"{sum(of['sessions'] for of in content['drifts'])} simulated sessions of an axis."


def constant_rates(content: Content) -> Iterator[str]:
    """Table of gyroscopes on a rate table: ratio to the bound, coverage, prediction of another rate."""
    yield _row(
        [
            "session",
            "RMSE over the bound",
            "95 % hold",
            "error at 60 deg/s",
            "plain least squares, same means",
        ]
    )
    yield "|---|---|---|---|---|"
    for of in content["plans"]:
        figures = f"{of['ratio']:.3f}", f"{100 * of['coverage']:.1f} %"
        yield _row(
            [of["plan"], *figures, f"{1e3 * of['predicted']:.2f} mdeg/s", f"{1e3 * of['plain']:.2f} mdeg/s"]
        )
    yield ""
    yield f"{sum(of['sessions'] for of in content['plans'])} sessions made by numpy alone, six faces each."


def spin_disturbed(content: Content) -> Iterator[str]:
    """Intervals of spins that slip, turn fast, or have a coarse gyroscope."""
    groups = list(content["rows"][0]["groups"])
    yield _row(["95 % hold, largest error over sigma", *groups, "sigmas widened"])
    yield "|" + "---|" * (2 + len(groups))
    for row in content["rows"]:
        held = (_held(of) for of in row["groups"].values())
        yield _row([row["name"], *held, f"{100 * row['said']:.0f} %"])
    yield ""
    yield (
        f"{content['sessions']} simulated sessions of each: 3 turns on a floor of 1 deg at 100 Hz; a slip of "
        "10 cm/s begins and ends with the turn. A robot that slips along itself turns one way about another "
        "point, which its lever arm is counted from; that of the table is from where it would turn."
    )


def _held(of: Content) -> str:
    if of["coverage"] is None:
        return "not known"
    return f"{100 * of['coverage']:.1f} %, {of['largest']:.3g}"


def spin_live(content: Content) -> Iterator[str]:
    """Table of chi-square and coverage of a live spin, beside those of the log."""
    groups = list(content["live"]["coverage"])
    yield _row(["", "chi-square over its degrees of freedom", *(f"95 % hold: {group}" for group in groups)])
    yield "|" + "---|" * (2 + len(groups))
    for way in SPIN_WAYS:
        figures = content[way]
        mean, error = figures["reduced_chi_square"], figures["reduced_chi_square_error"]
        yield _row(
            [
                way,
                f"{mean:.3f} ± {error:.3f}",
                *(f"{100 * figures['coverage'][group]:.1f} %" for group in groups),
            ]
        )
    yield ""
    yield (
        f"Mean over {content['sessions']} sessions of `tumble simulate spin --floor-tilt 2`, seeds 1 and "
        "following, with bias instability that the procedure is not given. Live, it is done after two turns."
    )


def live(content: Content) -> Iterator[str]:
    """Losses, load, latency and memory of several units read, corrected and sent on."""
    yield "| over | samples | lost | cores busy | p50 | p99 | p99.9 | longest | memory, end over start |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for way in content["ways"]:
        latency = [f"{1e3 * way['latency'][name]:.2f} ms" for name in ("p50", "p99", "p99.9")]
        yield _row(
            [
                way["over"],
                str(way["sent"]),
                str(way["lost"]),
                f"{way['processor']:.2f}",
                *latency,
                f"{1e3 * way['largest_latency']:.1f} ms",
                f"{way['memory_growth']:.3f}",
            ]
        )
    long = content["flood"]
    yield ""
    yield (
        f"{content['units']} units at {content['rate']:g} Hz for {content['seconds']:g} s, from a sample "
        f"sent to its corrected datagram. {long['hours']:g} h of samples of one unit, put through "
        f"{long['times_real_time']:.0f} times faster than life, leave {long['memory_growth']:.3f} times the "
        "memory."
    )


def live_table(content: Content) -> Iterator[str]:
    """Error against the bound and time of live sessions on a table that turns itself."""
    yield "| | | RMSE against the bound | corrected for sampling | over sockets, corrected |"
    yield "|---|---|---|---|---|"
    for triad in TRIADS:
        for group in GROUPS:
            quick, lived = (content[of][triad]["groups"][group] for of in ("figures", "figures_over_sockets"))
            yield _row(
                [
                    triad,
                    group,
                    f"{quick['ratio']:.3f} ± {quick['ratio_error']:.3f}",
                    f"{quick['ratio_without_luck']:.3f} ± {quick['ratio_without_luck_error']:.3f}",
                    f"{lived['ratio_without_luck']:.3f} ± {lived['ratio_without_luck_error']:.3f}",
                ]
            )
    times = content["times"]
    yield ""
    yield (
        f"{content['sessions']} sessions of {content['targets']} targets at {content['rate']:g} Hz with "
        f"white noise, six faces for {content['pose_seconds']:g} s each and turns, {content['stops']} stops, "
        f"on a clock of their own without sockets, and {content['over_sockets']} over UDP and TCP at the "
        f"pace of life. There the table moved for {max(times['motion']):.1f} s, the shortest being "
        f"{times['shortest_motion']:.1f} s, and all took {max(times['all']):.0f} s, the shortest being "
        f"{times['shortest']:.0f} s."
    )


FIT_MODELS = ("offset", "affine", "affine and lever arm")


def redundancy(content: Content) -> Iterator[str]:
    """Fit models beside the design, honesty of its sigmas, cost of a sample, bytes."""
    yield "| units apart | offset only | design | affine | design | affine and lever arm | design |"
    yield "|---|---|---|---|---|---|---|"
    for distance, fit_models in content["fit_models"].items():
        cells = ["same spot" if float(distance) == 0.0 else f"{100 * float(distance):g} cm"]
        for fit_model in FIT_MODELS:
            error = fit_models[fit_model]["error"]
            cells += [
                "refused" if error is None else f"{two_digits(error)} m/s²",
                f"{fit_models[fit_model]['design']:g}",
            ]
        yield _row(cells)
    yield ""
    yield (
        f"Root mean square over {content['runs']} runs of 60 s of motion at 200 Hz of the norm of the error "
        "of the compensated specific force; a secondary wrong by 0.3 m/s² and 1 % of each element of M."
    )
    yield ""
    yield "| affine and lever arm, 10 cm apart | RMSE over stated sigma | 95 % hold | f32 less f64, sigmas |"
    yield "|---|---|---|---|"
    for name, of in content["honesty"].items():
        yield _row(
            [
                name,
                f"{of['rmse_over_sigma']:.2f}",
                f"{100 * of['coverage']:.1f} %",
                f"{100 * of['single_precision_sigmas']:.2f} %",
            ]
        )
    yield ""
    yield _redundancy_cost(content)


def _redundancy_cost(content: Content) -> str:
    single = [of for of in content["push"] if of["precision"] == "f32"]
    size = content["bytes"]["f32"]
    state = f"The state takes {size[0]} bytes with one secondary, {size[-1]} with seven."
    if not single:
        return state
    first, last = single[0], single[-1]
    return (
        f"A sample costs {first['push']:.0f} ns in f32, {first['ratio']:.0f} times a copy of it in memory, "
        f"with one secondary; {last['push']:.0f} ns with {last['secondaries']}. {state}"
    )


def redundancy_adoptions(content: Content) -> Iterator[str]:
    """Table of wrong adoptions and triggers, and of the errors after adoptions."""
    counts = content["counts"]
    yield f"| {content['missions']} missions, {content['hours']:.0f} hours | count | of |"
    yield "|---|---|---|"
    for name, of in (
        ("wrongly adopted", "adopted"),
        ("misled", "adopted"),
        ("missed triggers", "evaluations"),
        ("false triggers", "triggered"),
    ):
        yield _row([name, str(counts[name]), f"{counts[of]} {of}"])
    yield ""
    yield "| error left by an adoption, as a share of before | median | 95 % | largest |"
    yield "|---|---|---|---|"
    for name, of in content["adoptions"].items():
        if of["share"]["number"]:
            yield _row([name, *(f"{100 * of['share'][key]:.1f} %" for key in ("median", "high", "max"))])
    yield ""
    yield (
        f"A mission is replayed {content['replay_rate']['median']:.0f} times as fast as it was flown "
        "(median). The meaning of wrong is defined in `benchmarks/redundancy_judge.py`."
    )


def redundancy_campaign(content: Content) -> Iterator[str]:
    """Table of named units in missions with faults, by kind, and of reports in health."""
    for title, of in content["sets"].items():
        yield from _judged_table(title, {**of["kinds"], "not calibrated": of["not calibrated"]})
        yield ""
    yield _row(["in health", "hours", *IN_HEALTH])
    yield f"|---|---|{'---|' * len(IN_HEALTH)}"
    for title, of in content["sets"].items():
        counts = (f"{of['health'][name]:g}" for name in IN_HEALTH.values())
        yield _row([title, f"{of['health']['hours']:.1f}", *counts])
    yield ""
    yield (
        f"{content['missions']} missions. Velocity and angle: what a fault of the primary adds to the output "
        "as long as the primary is the source, median. Definition of each column: "
        "[benchmarks/README.md](../benchmarks/README.md)."
    )


def redundancy_precision(content: Content) -> Iterator[str]:
    """Table of missions that single precision decides differently from double, by kind of fault."""
    yield "| fault | missions | decisions | missions decided differently |"
    yield "|---|---|---|---|"
    kinds = content["kinds"]
    for kind, of in flown(kinds).items():
        yield _row([kind, *(str(of[key]) for key in ("missions", "decisions", "different"))])
    yield _row(
        [
            "all",
            *(str(sum(of[key] for of in kinds.values())) for key in ("missions", "decisions", "different")),
        ]
    )
    for seed, words in content["different"].items():
        yield ""
        yield f"Seed {seed}: {words}."


def redundancy_recorded(content: Content) -> Iterator[str]:
    """Table of named units where faults were put into a real recording, and of reports without faults."""
    for title, of in content["sets"].items():
        yield from _judged_table(title, of["kinds"])
        yield ""
    yield "| in health | hours | units named | disagree | changes of the source | without a source |"
    yield "|---|---|---|---|---|---|"
    for title, of in content["sets"].items():
        for span, health in of["health"].items():
            counts = (str(health[name]) for name in ("faulty", "disagree", "changes"))
            without = f"{health['without_source']:.1f} s"
            yield _row([f"{title}, {span}", f"{health['hours']:.2f}", *counts, without])


def flight_campaign(content: Content) -> Iterator[str]:
    """Table of named units in missions of a separate simulator, and of reports in health."""
    for title, of in content["sets"].items():
        yield _row([f"fault; {title}", "missions", *OUTCOMES, *FLOWN_COLUMNS])
        yield f"|---|---|{'---|' * (len(OUTCOMES) + len(FLOWN_COLUMNS))}"
        rows = {**flown(of["kinds"]), "not calibrated": of["not calibrated"], "all": of["all"]}
        for kind, each in rows.items():
            counts = (str(each["outcomes"][name]) for name in OUTCOMES)
            delays = (_seconds(each["isolated"]), _seconds(each["seen"]))
            misled = (str(each["on a faulty unit"]), str(each["misled"]))
            yield _row([kind, str(each["missions"]), *counts, *delays, *misled])
        yield ""
    yield "| all missions | health | units named | in missions | reasons | output missing | calibrated anew |"
    yield "|---|---|---|---|---|---|---|"
    for title, of in content["sets"].items():
        health = of["health"]
        reasons = ", ".join(f"{name} {count}" for name, count in health["reasons"].items())
        missing = f"{health['missing']:.1f} s in {health['missing in missions']}"
        anew = f"{health['recalibrated']} of {health['owed']} owed"
        named = (str(health[name]) for name in ("named", "named in missions"))
        yield _row([title, f"{health['hours']:.2f} h", *named, reasons, missing, anew])
    yield ""
    yield (
        f"{content['missions']} missions, seeds from {content['seed']} on. Definition of each column: "
        "[benchmarks/README.md](../benchmarks/README.md)."
    )


def compared(content: Content) -> Iterator[str]:
    """Table of named units, today and by the model, in the same missions."""
    columns = compared_header()
    for title, of in content["sets"].items():
        yield _row([f"fault; {title}", "missions", *columns])
        yield f"|---|---|{'---|' * len(columns)}"
        for kind, each in of["kinds"].items():
            if kind != "none":
                yield _row([kind, str(each["missions"]), *compared_cells(each)])
        yield ""
    yield "| in health | monitor | hours | units named | in missions |"
    yield "|---|---|---|---|---|"
    for title, of in content["sets"].items():
        for name, health in of["health"].items():
            counts = (str(health[each]) for each in ("named", "in missions"))
            yield _row([title, name, f"{health['hours']:.1f}", *counts])
    yield ""
    yield f"{content['missions']} missions, seeds from {content['seed']} on; s to the name, median (95 %)."


def flight_recorded(content: Content) -> Iterator[str]:
    """Table of faults put into recorded flights, by half, monitor and number of units."""
    yield _row(
        ["flights", "monitor", "right", "wrong", "false exclusions", *(f"{each}, s" for each in TIMED)]
    )
    yield f"|---|---|---|---|---|{'---|' * len(TIMED)}"
    for half, sets in content["figures"].items():
        for name, of in sets.items():
            found, health = of["all"], of["health"]
            low, high = (100.0 * each for each in found["right interval"])
            timed = (of["classes"].get(each, {}) for each in TIMED)
            times = (
                f"{each['median']:.2g} ({each['high']:.2g})" if each.get("median") else "" for each in timed
            )
            right = f"{found['right']} of {found['runs']} ({low:.1f} to {high:.1f} %)"
            excluded = f"{health['false exclusions']} in {health['sets']} sets"
            yield _row([half, name, right, str(found["wrong"]), excluded, *times])
    yield ""
    health = content["figures"]["held out"]["core, N = 3"]["health"]
    yield (
        f"22 classes of fault, {content['draws']} draws of each in each flight and size; s to the name, "
        "median (95 %), of faults that were named. "
        f"Sets of three fly {health['hours']:.2f} h in health, held out."
    )


def faults_of_flights(results: Mapping[str, Content]) -> Iterator[str]:
    """Table of the present monitor on recorded flights with faults put in, both halves together."""
    yield "| recorded flights, present monitor | faults | named | wrong exclusion | false exclusions |"
    yield "|---|---|---|---|---|"
    halves = results["flight_recorded"]["figures"].values()
    shown = (f"today{stored}, N = {units}" for units in (3, 4) for stored in ("", ", stored"))
    for name in ("today, aided, N = 2", "today, stored, aided, N = 2", *shown):
        faults = [half[name]["all"] for half in halves]
        right, wrong, runs = (sum(each[of] for each in faults) for of in ("right", "wrong", "runs"))
        health = [half[name]["health"] for half in halves]
        excluded, sets = (sum(each[of] for each in health) for of in ("false exclusions", "sets"))
        shares = (f"{count}: {100.0 * count / runs:.1f} %" for count in (right, wrong))
        title = name.removeprefix("today, ").replace("stored,", "calibrations stored,")
        title = title.replace("aided", "beside a receiver's velocity")
        yield _row([title, str(runs), *shares, f"{excluded} in {sets} sets"])


def flight_clocks(content: Content) -> Iterator[str]:
    """Table of what was reported of a unit whose clock drifts."""
    outcomes = list(dict.fromkeys(name for of in content["spans"].values() for name in of["outcomes"]))
    yield _row(["pace of the clock", "missions", *outcomes])
    yield f"|---|---|{'---|' * len(outcomes)}"
    for name, of in content["spans"].items():
        yield _row([name, str(of["missions"]), *(str(of["outcomes"].get(each, 0)) for each in outcomes)])
    yield ""
    yield f"{content['missions']} missions of three to eight units, seeds from {content['seed']} on."


def flight_logs(content: Content) -> Iterator[str]:
    """Table of reports on recorded flights, beside the autopilot, and on faults put into them."""
    yield "| log | IMUs | Hz | s | verdicts | at rest | disagree | autopilot | what the verdicts come from |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for log in content["logs"]:
        reasons = ", ".join(f"{name} {count}" for name, count in log["reasons"].items())
        told = "; ".join(log["autopilot"][:AUTOPILOT_SAYS])
        more = len(log["autopilot"]) - AUTOPILOT_SAYS
        told += f"; {more} more" if more > 0 else ""
        figures = [f"{log['rate']:.0f}", f"{log['seconds']:.0f}", f"{log['verdicts']} {reasons}".strip()]
        at_rest = "judged" if log["judged at rest"] else ""
        then = [at_rest, str(log["disagree"]), told.replace("|", "\\|"), log["why"]]
        name = f"{log['file']} (simulated)" if log["simulated"] else log["file"]
        yield _row([name, str(log["units"]), *figures, *then])
    yield ""
    yield "| logs | number | hours | verdicts | an hour, 95 % |"
    yield "|---|---|---|---|---|"
    for name, of in content["groups"].items():
        rate = f"{of['verdicts'] / of['hours']:.1f} ({of['low']:.1f} to {of['high']:.1f})"
        yield _row([name, str(of["logs"]), f"{of['hours']:.2f}", str(of["verdicts"]), rate])
    yield ""
    yield _row(["fault", "runs", *OUTCOMES, "named after", "seen after"])
    yield f"|---|---|{'---|' * (len(OUTCOMES) + 2)}"
    faults = content["faults"]
    for kind, each in {**flown(faults["kinds"]), "all": faults["groups"]["all"]}.items():
        counts = (str(each["outcomes"][name]) for name in OUTCOMES)
        yield _row([kind, str(each["missions"]), *counts, _seconds(each["isolated"]), _seconds(each["seen"])])


AUTOPILOT_SAYS = 2
"""Reports of an autopilot that are shown."""
FLOWN_COLUMNS = ("named after", "seen after", "source faulty", "misled")


def _judged_table(title: str, kinds: Mapping[str, Content]) -> Iterator[str]:
    then = ("named after", "seen", "after", "m/s", "deg", "misled")
    yield _row([f"fault; {title}", "missions", *OUTCOMES, *then])
    yield f"|---|---|{'---|' * (len(OUTCOMES) + len(then))}"
    for kind, of in flown(kinds).items():
        counts = (str(of["outcomes"][name]) for name in OUTCOMES)
        told = (_seconds(of["isolated"]), str(of["seen"]["number"]), _seconds(of["seen"]))
        cost = (_median(of["velocity"]), _median(of["angle"]), str(of["misled"]))
        yield _row([kind, str(of["missions"]), *counts, *told, *cost])


def _median(of: Content) -> str:
    return two_digits(of["median"]) if of["number"] else ""


def _seconds(of: Content) -> str:
    """Returns the median, and 95 %."""
    return f"{_median(of)} ({two_digits(of['high'])}) s" if of["number"] else ""


def footprint(content: Content) -> Iterator[str]:
    """Flash, memory and instructions on a Cortex-M4F."""
    yield from _device_table(footprint_rows(content))
    yield ""
    yield (
        "Built for size, with link-time optimisation; flash minus that without Tumble. States are "
        "what a caller sets aside; the stack comes on top. Instructions are counted by QEMU over the "
        "conformance vectors: 40 samples a second of each of three units, of which every second completes a "
        "window, and the same flight with four samples more between two. The robot has 50 a second. "
        "Restoring and saving records include the emulated flash; a whole spin or fit all that the samples "
        "take with which it goes on."
    )


def c_library(content: Content) -> Iterator[str]:
    """Flash by parts, memory and stack of the library for C on a Cortex-M4F."""
    yield from _device_table(c_library_rows(content))
    yield ""
    yield (
        "A program in C that makes every call of these parts, minus one that makes those that any library "
        "has: readings corrected, models taken apart. It is built for size, with link-time optimisation. The "
        "storage of a set holds its units and settings too. The stack is painted in a flight, and bounded by "
        "the instructions of the image."
    )


def _device_table(rows: Iterable[tuple[str, str, str]]) -> Iterator[str]:
    yield "| on a Cortex-M4F, f32 | | goal |"
    yield "|---|---|---|"
    yield from map(_row, rows)


def five_figures(results: Mapping[str, Content]) -> Iterator[str]:
    """Returns five figures that matter, one of each procedure, and two of all of them."""
    truth = {
        name: 1e3 * results["truths"]["columns"]["0.05"][name]["non_orthogonality"]["rms"]
        for name in ("reference", "rotate-measurement")
    }
    tilted = results["spin"]["tilts"]["1"]
    ratios, covered = _against_the_bound(results)
    named = {title: _outcomes(of) for title, of in results["redundancy_campaign"]["sets"].items()}
    of_each = list(results["honesty"]["procedures"].values())
    silent, drawn = (sum(each[count] for each in of_each) for count in ("silent", "draws"))
    plain = [each["undisturbed"] for each in of_each]
    held = sum(each["held"] for each in plain) / sum(each["stated"] for each in plain)
    yield "| | Tumble | compared with |"
    yield "|---|---|---|"
    for cells in (
        (
            "Turntable that errs by 0.05° a pose: error of the non-orthogonality",
            f"**{three_digits(truth['reference'])} mrad**",
            f"{three_digits(truth['rotate-measurement'])} mrad by the published compensation",
        ),
        (
            "Robot on a floor that tilts by 1°: error of the accelerometer bias",
            f"**{three_digits(1e3 * tilted['level_free'])} mm/s²**",
            f"{three_digits(1e3 * tilted['published'])} mm/s² by the published method",
        ),
        (
            "Error of either procedure over the least possible (Cramér-Rao bound)",
            f"**{min(ratios):.2f} to {max(ratios):.2f}**",
            f"95 % intervals hold in {100 * min(covered):.0f} to {100 * max(covered):.0f} %",
        ),
        (
            "Redundant set, a unit fails in any way: it is named",
            f"**{_of_each(named, 'right')}**",
            f"a sound one: {_of_each(named, 'wrong')}",
        ),
        (
            "Session with a drawn imperfection: an error over 5 sigmas, yet exit code 0",
            f"**{silent} of {drawn}**",
            f"without one, 95 % intervals hold in {100 * held:.0f} %",
        ),
    ):
        yield _row(cells)


def _of_each(shares: Mapping[str, Mapping[str, str]], outcome: str) -> str:
    return ", ".join(f"{of[outcome]} ({title})" for title, of in shares.items())


def _outcomes(of: Content) -> dict[str, str]:
    """Returns the share of each outcome over all kinds of faults."""
    kinds = of["kinds"].values()
    missions = sum(each["missions"] for each in kinds)
    counts = {name: sum(each["outcomes"][name] for each in kinds) for name in OUTCOMES}
    return {name: f"{100 * count / max(missions, 1):.1f} %" for name, count in counts.items()}


def _against_the_bound(results: Mapping[str, Content]) -> tuple[list[float], list[float]]:
    """Error over the bound and coverage of each group of parameters, all cells together."""
    pooled = results["accuracy"]["pooled"].values()
    groups = [of for noise in pooled for triad in TRIADS for of in noise[triad]["groups"].values()]
    groups += results["spin"]["pooled"].values()
    return [of["ratio"] for of in groups], [of["coverage"] for of in groups]


def device(results: Mapping[str, Content]) -> Iterator[str]:
    """Table of the resources on a device for which there is a goal."""
    yield from _device_table(row for row in footprint_rows(results["footprint"]) if row[-1])


def missed(results: Mapping[str, Content]) -> Iterator[str]:
    """Returns the goals that are not reached, and how many there are in all."""
    goals = all_goals(results)
    yield "| figure | goal | reached |"
    yield "|---|---|---|"
    for goal in goals:
        if not goal.is_met:
            yield _row([goal.what, goal.wanted, goal.reached])
    yield ""
    yield f"All other goals, {sum(goal.is_met for goal in goals)} of {len(goals)}, are reached."


def subjects(results: Mapping[str, Content]) -> Iterator[str]:
    """Returns the pages, and how many goals are reached on each."""
    yield "| subject | measured | goals reached |"
    yield "|---|---|---|"
    for subject in SUBJECTS:
        goals = all_goals({name: results[name] for name in subject.tables if name in results})
        reached = f"{sum(goal.is_met for goal in goals)} of {len(goals)}" if goals else ""
        yield _row([f"[{subject.title}]({subject.page}.md)", subject.measured, reached])


def compare(content: Content) -> Iterator[str]:
    """Table of calibrations of one unit that are reported to differ, and of changes that are found."""
    yield "| change of one bias, sigmas of the difference | reported to differ | that bias is named |"
    yield "|---|---|---|"
    yield _row(["none", f"{100 * (1.0 - content['same']):.1f} %", ""])
    for change, of in content["found"].items():
        yield _row([change, f"{100 * of['share']:.1f} %", f"{100 * of['named']:.1f} %"])
    yield ""
    yield (
        f"{content['pairs']} pairs; mean of chi-square {content['statistic']:.1f} for "
        f"{content['degrees_of_freedom']} degrees of freedom."
    )


TABLES: dict[str, Callable[[Content], Iterator[str]]] = {
    "honesty": honesty,
    "honesty_pairs": honesty,
    "accuracy": accuracy,
    "disturbed": disturbed,
    "stamps": stamps,
    "laboratories": laboratories,
    "truths": truths,
    "constant_rates": constant_rates,
    "spin": spin,
    "spin_live": spin_live,
    "spin_disturbed": spin_disturbed,
    "live": live,
    "live_table": live_table,
    "multipose": multipose,
    "magnetometer": magnetometer,
    "turntable_magnetometer": turntable_magnetometer,
    "tremor": tremor,
    "noise_terms": noise_terms,
    "noise_disturbed": noise_disturbed,
    "no_equipment": no_equipment,
    "thermal": thermal,
    "thermal_loops": thermal_loops,
    "compare": compare,
    "redundancy": redundancy,
    "redundancy_adoptions": redundancy_adoptions,
    "redundancy_campaign": redundancy_campaign,
    "redundancy_precision": redundancy_precision,
    "redundancy_campaign_aiding": redundancy_campaign,
    "redundancy_recorded": redundancy_recorded,
    "flight_campaign": flight_campaign,
    "compared_sets": compared,
    "compared_flights": compared,
    "flight_recorded": flight_recorded,
    "flight_clocks": flight_clocks,
    "flight_logs": flight_logs,
    "speed": speed,
    "production": production,
    "memory": memory,
    "readers": readers,
    "view": view,
    "bench_page": bench_page,
    "footprint": footprint,
    "fleet": fleet,
    "fleet_sessions": fleet_sessions,
    "fleet_kills": fleet_kills,
    "c_library": c_library,
}


SUMMARIES: dict[str, Callable[[Mapping[str, Content]], Iterator[str]]] = {
    "figures": five_figures,
    "device": device,
    "subjects": subjects,
    "missed": missed,
    "cases": cases,
    "others": others,
    "integrity": integrity,
    "faults_of_flights": faults_of_flights,
}
"""Made from the figures of several benchmarks."""

PAGES = {
    "README.md": ("figures",),
    "docs/how-to/firmware.md": ("device",),
    "docs/how-to/fly-it.md": ("integrity", "faults_of_flights"),
    "docs/benchmarks/README.md": ("subjects", "figures"),
    "docs/benchmarks/missed.md": ("missed",),
    "docs/benchmarks/before-and-now.md": ("cases", "others"),
    **{f"docs/benchmarks/{subject.page}.md": subject.tables for subject in SUBJECTS},
}
"""Tables on each page."""


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def placed(text: str, name: str, table: str) -> str:
    """Puts a table between its markers; raises `ValueError` where they are missing."""
    marked = re.compile(rf"(<!-- benchmark:{name} -->\n).*?(<!-- /benchmark:{name} -->)", re.DOTALL)
    replaced, count = marked.subn(lambda found: f"{found[1]}{table}{found[2]}", text)
    if count != 1:
        raise ValueError(f"the markers of benchmark:{name} stand {count} times in the text, not once")
    return replaced


def printed(text: str, names: Sequence[str]) -> str:
    """Returns the text with the tables of these names in their places."""
    results = measured([*TABLES, "cases"])
    for name in names:
        if name in SUMMARIES:
            lines = SUMMARIES[name](results)
        else:
            lines = TABLES[name](results[name]) if name in results else iter(["Not measured yet."])
        text = placed(text, name, "".join(f"{line}\n" for line in lines))
    return text


def main(arguments: Sequence[str] | None = None) -> int:
    """Rewrites the pages; with --check only see that they show the figures on disk."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", type=Path, default=ROOT, help="folder of the pages")
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if a page is out of date")
    options = parser.parse_args(arguments)
    out_of_date = 0
    for name, tables in PAGES.items():
        page = options.root / name
        before = page.read_text(encoding="utf-8")
        after = printed(before, tables)
        if after == before:
            continue
        if options.check:
            print(
                f"{name} does not show the figures of benchmarks/results: run `python -m benchmarks.report`"
            )
            out_of_date = 1
            continue
        unfinished = page.with_name(page.name + ".part")
        unfinished.write_text(after, encoding="utf-8")
        unfinished.replace(page)
    return out_of_date


if __name__ == "__main__":
    sys.exit(main())
