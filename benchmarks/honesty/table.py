"""Tables of docs/benchmarks/honesty.md."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.digits import two_digits
from benchmarks.results import Content


def honesty(content: Content) -> Iterator[str]:
    """Counts of each procedure, then of each imperfection."""
    procedures = content["procedures"]
    yield "| | draws | silent wrong numbers | refused in vain | without imperfection: 95 % hold | refused |"
    yield "|---|---|---|---|---|---|"
    for name, found in procedures.items():
        low, high = (100.0 * end for end in found["silent_interval"])
        plain = found["undisturbed"]
        yield (
            f"| {name} | {found['draws']} | {found['silent']} ({low:.1f} to {high:.1f} %) "
            f"| {found['refused_in_vain']} | {100.0 * plain['held'] / max(plain['stated'], 1):.1f} % "
            f"of {plain['stated']} | {plain['refused']} of {plain['draws']} |"
        )
    yield ""
    yield (
        "A number is silently wrong where it errs by more than five of its sigmas and the exit code is 0. "
        "A refusal is in vain where the exit code is another and all that was stated holds. Sizes are "
        "drawn evenly in their logarithm, so that most draws of a row are harmless."
    )
    yield ""
    yield (
        "| imperfection | procedure | draws | silent wrong | worst, sigmas | named, of those that matter "
        "| smallest that errs | smallest that is named |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for name, found in procedures.items():
        for row in found["rows"]:
            worst = two_digits(row["worst"]) if row["silent"] else ""
            sizes = (_size(row[end], row["unit"]) for end in ("first_wrong", "first_named"))
            yield (
                f"| {row['name']} | {name} | {row['draws']} | {row['silent']} | {worst} "
                f"| {row['named']} of {row['matters']} | {' | '.join(sizes)} |"
            )


def _size(size: float | None, unit: str) -> str:
    return "" if size is None or not unit else f"{two_digits(size)} {unit}"
