"""Figures as a reader wants them: few digits, no exponent."""

from __future__ import annotations


def two_digits(value: float) -> str:
    """Returns two significant digits without an exponent."""
    return f"{float(f'{value:.2g}'):.10f}".rstrip("0").rstrip(".")


def three_digits(value: float) -> str:
    """Returns three significant digits without an exponent."""
    if value >= 100.0:
        return f"{value:.0f}"
    return f"{value:.1f}" if value >= 10.0 else f"{value:.2f}" if value >= 1.0 else f"{value:.3f}"
