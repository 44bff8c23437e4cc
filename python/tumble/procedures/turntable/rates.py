"""Response of a gyroscope at constant rates: scale, linearity and asymmetry, as results have them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from tumble import _core
from tumble.procedures.turntable.result import RateLevelResult, ResponseResult

PARTS_PER_MILLION = 1e6


def axis_responses(figures: Sequence[_core.ResponseFigures]) -> tuple[ResponseResult, ...]:
    """Returns the response of each axis that turned at constant rates, in deg/s and ppm."""
    return tuple(_response(each) for each in figures)


def _response(figures: _core.ResponseFigures) -> ResponseResult:
    asymmetry = figures["asymmetry"]
    scale, scale_sigma = figures["scale"]
    linearity, linearity_sigma = (PARTS_PER_MILLION * each for each in figures["linearity"])
    return ResponseResult(
        axis="xyz"[figures["axis"]],
        full_scale=math.degrees(figures["full_scale"]),
        scale=scale,
        scale_sigma=scale_sigma,
        linearity=linearity,
        linearity_sigma=linearity_sigma,
        asymmetry=None if asymmetry is None else PARTS_PER_MILLION * asymmetry[0],
        asymmetry_sigma=None if asymmetry is None else PARTS_PER_MILLION * asymmetry[1],
        levels=tuple(_levels(figures)),
    )


def _levels(figures: _core.ResponseFigures) -> Iterator[RateLevelResult]:
    for rate, turns, scale, scale_sigma, deviation, deviation_sigma in figures["levels"]:
        yield RateLevelResult(
            rate=math.degrees(rate),
            turns=turns,
            scale=scale,
            scale_sigma=scale_sigma,
            deviation=PARTS_PER_MILLION * deviation,
            deviation_sigma=PARTS_PER_MILLION * deviation_sigma,
        )
