"""Integrity of fault detection and isolation, with intervals, out of the campaigns of redundant sets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from scipy.stats import beta, chi2

from benchmarks.digits import two_digits
from benchmarks.results import Content

LEVEL = 0.95
"""Confidence level of the intervals."""


def share_interval(count: int, trials: int) -> tuple[float, float]:
    """Returns the interval of a probability that `count` of `trials` show (Clopper and Pearson, 1934)."""
    tail = (1.0 - LEVEL) / 2.0
    low = float(beta.ppf(tail, count, trials - count + 1)) if count else 0.0
    high = float(beta.ppf(1.0 - tail, count + 1, trials - count)) if count < trials else 1.0
    return low, high


def rate_interval(count: int, hours: float) -> tuple[float, float]:
    """Returns the interval of a rate in 1/h that `count` events in some hours show (Garwood, 1936)."""
    tail = (1.0 - LEVEL) / 2.0
    low = float(chi2.ppf(tail, 2 * count)) / 2.0 if count else 0.0
    return low / hours, float(chi2.ppf(1.0 - tail, 2 * count + 2)) / 2.0 / hours


def integrity(results: Mapping[str, Content]) -> Iterator[str]:
    """Tables of missed detections, isolation and time to alert, and of false exclusions in health."""
    if not {"redundancy_campaign", "flight_campaign", "flight_logs"} <= results.keys():
        yield "Not measured yet."
        return
    yield (
        "| units; fault | faults | missed detection | detected, not isolated | wrong exclusion "
        "| time to alert: median | 95 % | time to exclusion: median | 95 % |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for name, each in results["redundancy_campaign"]["sets"].items():
        for kind, figures in each["groups"].items():
            yield _faults(f"{name}; {kind}", figures)
    for name, each in results["flight_campaign"]["sets"].items():
        yield _faults(f"{name}; all, second simulator", each["all"])
    yield ""
    yield "| no fault: units; source | hours | false exclusions | an hour |"
    yield "|---|---|---|---|"
    for name, each in results["redundancy_campaign"]["sets"].items():
        yield _health(f"{name}; simulated", each["health"]["faulty_in_health"], each["health"]["hours"])
    for name, each in results["flight_campaign"]["sets"].items():
        yield _health(f"{name}; second simulator", each["health"]["named"], each["health"]["hours"])
    for name, each in results["flight_logs"]["groups"].items():
        yield _health(f"logs of flights; {name}", each["verdicts"], each["hours"])
    yield ""
    yield (
        "In brackets: 95 % intervals, of shares by Clopper and Pearson, of rates by Garwood. A verdict of a "
        "log is counted as a false exclusion, since nobody knows of a fault in it. "
        "Source: [redundant units](../benchmarks/redundancy.md)."
    )


def _faults(name: str, figures: Content) -> str:
    outcomes, trials = figures["outcomes"], figures["missions"]
    shares = [_share(outcomes[outcome], trials) for outcome in ("missed", "unknown", "wrong")]
    times = [_time(figures[of], at) for of in ("seen", "isolated") for at in ("median", "high")]
    return f"| {' | '.join([name, str(trials), *shares, *times])} |"


def _health(name: str, count: int, hours: float) -> str:
    if not hours:
        return f"| {name} | {hours:.2f} | {count} | none flown |"
    low, high = rate_interval(count, hours)
    rate = f"{two_digits(count / hours)} ({two_digits(low)} to {two_digits(high)})"
    return f"| {name} | {hours:.2f} | {count} | {rate} |"


def _share(count: int, trials: int) -> str:
    if not trials:
        return "none flown"
    low, high = share_interval(count, trials)
    return f"{count}: {100 * count / trials:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def _time(figures: Content, at: str) -> str:
    return f"{two_digits(figures[at])} s" if figures["number"] else ""
