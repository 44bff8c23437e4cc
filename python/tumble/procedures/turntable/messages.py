"""Messages on errors that the core reports, each with a remedy."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TypeAlias

from tumble import _core
from tumble.foundation.results import Figures
from tumble.foundation.words import count_of

PoseNames: TypeAlias = Mapping[int, str]

_MIRRORS = (
    "mirrors that of the reference: in one of the two logs two axes, or the files of two poses, are "
    "exchanged, or one or all three signs are wrong; correct that log with --columns, --axes x,y,-z or "
    "--accelerometer-sign -1, for it only with --for NAME:OPTION=VALUE"
)


def explain(error: _core.CoreError, pose_names: PoseNames) -> str:
    """One line: what is wrong and what to do."""
    kind, figures = error.args
    return MESSAGES[kind](figures, pose_names)


def drift_words(drift: _core.BiasDrift) -> str:
    """Describes the change of a bias over a session, m/s^2, and its course."""
    change, sigma, constant = drift
    each = zip("xyz", 1e3 * change, 1e3 * sigma, strict=True)
    axes = ", ".join(f"{axis} {value:+.2g} ± {spread:.1g}" for axis, value, spread in each)
    course = "on a straight line" if math.isinf(constant) else f"settling within {constant:.2g} s"
    return f"by {axes} mm/s^2, {course}"


def _moved_during_rest(figures: Figures, pose_names: PoseNames) -> str:
    rest = int(figures["rest"])
    pose = f" ({pose_names[rest]})" if rest in pose_names else ""
    return (
        f"turned by {figures['angle']:.2f} deg in itself at {figures['time']:.1f} s, during rest "
        f"{rest + 1}{pose}, while the reference stood still; fasten it and record again"
    )


MESSAGES: dict[str, Callable[[Figures, PoseNames], str]] = {
    "too few rests": lambda figures, _: (
        f"{count_of('rest', round(figures['found']))} found that can be used, "
        f"{figures['needed']:.0f} in different directions are needed; hold each pose still for 5 s or longer"
    ),
    "directions too alike": lambda _, __: (
        "the rests point in too few directions to separate scale from bias; add poses that show each "
        "axis up and down"
    ),
    "no common time": lambda _, __: (
        "shares no turn or rest with the reference; check that both were recorded together, and try --clock "
        "apart"
    ),
    "moved during rest": _moved_during_rest,
    "reference moved": lambda figures, _: (
        f"stood still while the reference turned by {figures['angle']:.2f} deg in itself at "
        f"{figures['time']:.1f} s; fasten the reference and record again"
    ),
    "one in files": lambda _, __: (
        "was recorded in one file per pose where the reference was not, or the other way round; record both "
        "alike, or join the files"
    ),
    "no common file": lambda _, __: (
        "has no file of the same name as one of the reference's; name the files of a pose alike in the "
        "folders of all units"
    ),
    "few meet": lambda figures, _: (
        f"only {figures['met']:.0f} of its {figures['rests']:.0f} rests meet one of the reference; "
        "check that both were recorded together, and try --clock apart"
    ),
    "clocks apart": lambda figures, _: (
        f"its turns lie {figures['offset']:.3f} s from those of the reference although the clock is "
        "stated to be shared; use --clock apart"
    ),
    "needs poses": lambda _, __: "this truth needs the mounting angle, and that needs poses; give --poses",
    "no constant rates": lambda _, __: (
        "truth 'table' needs turns at constant rates of 2 s or longer in one recording, and it has none; "
        "use --truth reference"
    ),
    "rate not commanded": lambda figures, _: (
        f"turned at {figures['rate']:.4g} deg/s from {figures['time']:.1f} s on, which is within 5 % of no "
        "commanded rate; correct --rates, or rates of the pose list, or use --truth reference"
    ),
    "axis not vertical": lambda figures, _: (
        f"turned from {figures['time']:.1f} s on about an axis {figures['angle']:.0f} deg off the vertical, "
        "along which the Earth's rotation is not known; turn about a vertical axis, or use --truth reference"
    ),
    "left-handed": lambda _, __: f"its accelerometer {_MIRRORS}",
    "axes coincide": lambda _, __: "two axes of the accelerometer read the same; check the columns",
    "left-handed gyroscope": lambda _, __: f"its gyroscope {_MIRRORS}",
    "gyroscope axes coincide": lambda _, __: "two axes of the gyroscope read the same; check the columns",
    "unsolvable": lambda _, __: "no solution: the rests hold values that are not numbers, or no noise at all",
}
"""Messages by the word for the reason why there is no calibration."""
