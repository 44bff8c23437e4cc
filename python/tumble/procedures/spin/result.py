"""Results of the spin procedure, as plain data that reports show and calibration files keep."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from tumble.foundation.log_reading import LogReading
from tumble.foundation.log_time import FROM_START, UNKNOWN_TIME, LogTime
from tumble.foundation.provenance import Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
    INTERVAL,
    AxisEstimates,
    Collection,
    Parameter,
    Rest,
    Row,
    Tabular,
    Trace,
    TriadName,
    Verdict,
    estimates_of,
)
from tumble.foundation.units import UNITS
from tumble.foundation.words import count_of, printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tumble.calibration.document import Calibration

SpinMethod = Literal["level-free", "published"]

FULL_TURN = 2.0 * math.pi
SMALLEST_DIRECTION = math.radians(10.0)
"""Smallest turn in a direction that shows the scale of the gyroscope in it."""


@dataclass(frozen=True, slots=True)
class BiasEstimate:
    """Bias of three accelerometers or three gyroscopes, case frame."""

    value: FloatArray
    """(3,) m/s^2 or rad/s; NaN on every axis where the data do not show it."""
    sigma: FloatArray
    """(3,) 1-sigma; infinite where the data do not show it."""
    observable: bool
    reason: str = ""
    """Why it could not be observed, or how far it can be trusted."""

    def with_gravity(self, up: FloatArray, sigma: float) -> BiasEstimate:
        """Add the share of an uncertain gravity, m/s^2, to the bias of accelerometers: it is along `up`."""
        return replace(self, sigma=np.hypot(self.sigma, sigma * np.abs(up)))  # uncertainty.md, eq. 10

    def parameters(self, triad: TriadName) -> Iterator[Parameter]:
        """Returns the bias of each axis."""
        for axis, value, sigma in zip("xyz", map(float, self.value), map(float, self.sigma), strict=True):
            name, half = f"{triad} bias {axis}", INTERVAL * sigma
            yield Parameter(
                name, UNITS[triad], value, sigma, value - half, value + half, self.observable, self.reason
            )


@dataclass(frozen=True, slots=True)
class SpinBlocks:
    """A spin at a glance: n successive means, for the pictures."""

    time: FloatArray
    """(n,) s of the recording's own clock."""
    resting: FloatArray
    """(n,) 1 where the robot stood still, 0 where it turned."""
    heading: FloatArray
    """(n,) rad since the first sample, counter-clockwise seen from above, never folded."""
    rate: FloatArray
    """(n,) rad/s about the turning axis, counter-clockwise positive."""
    across: FloatArray
    """(n, 2) rad/s across the turning axis: 0 for a robot that turns about one axis."""
    force: FloatArray
    """(n, 3) m/s^2, specific force less accelerometer bias, floor frame: forward, left, up."""
    fit: FloatArray
    """(n, 3) m/s^2, the same as the model has it."""


@dataclass(frozen=True, slots=True)
class Spin(Tabular):
    """One spin: rest, turning on the spot, rests between."""

    label: str
    """`spin 1`."""
    start: float
    end: float
    """Seconds of the recording's own clock."""
    rests: tuple[Rest, ...]
    turned_clockwise: float
    turned_counter_clockwise: float
    """rad, as the gyroscope has it, both positive."""
    heading_span: float
    """rad between the outermost headings."""
    rate: float
    """rad/s, root mean square while turning."""
    turning_time: float
    """s of turning, without the rests between."""
    method: SpinMethod
    """Method whose accelerometer bias is the result."""
    gyroscope_bias: BiasEstimate
    level_free: BiasEstimate
    """Accelerometer bias, whatever the tilt of the floor."""
    published: BiasEstimate
    """Accelerometer bias if the floor is level."""
    up: FloatArray
    """(3,) unit vector, case frame: the turning axis, upwards across the floor."""
    parameters: tuple[Parameter, ...]
    """Everything found: `gyroscope bias x`, `accelerometer bias x`, `mounting roll`, `mounting pitch`,
    `floor tilt`, `uphill bearing`, `lever arm x`, `gyroscope scale clockwise` ..."""
    slow_turn: Parameter
    """rad/s about the turning axis that the robot made while it seemed to stand still."""
    chi_square: float
    degrees_of_freedom: int
    widening: float
    """Factor by which the sigmas of specific force are widened; 1 where noise and model explain all."""
    covariance: FloatArray
    """(6, 6) of [accelerometer bias, gyroscope bias] by the method of choice; NaN where not observable."""
    by_earth: FloatArray
    """(3, 3) share of the Earth's rotation in the covariance of the gyroscope bias, (rad/s)^2, case frame."""
    noise: FloatArray
    """(4, 3) scatter of one sample: accelerometer at rest and turning, m/s^2, gyroscope likewise, rad/s."""
    blocks: SpinBlocks
    warnings: tuple[str, ...] = ()
    objections: tuple[str, ...] = ()
    """Those of the warnings by which the biases are not what they are taken for."""

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter."""
        return (parameter.row() for parameter in self.parameters)

    def estimates(self, name: str) -> AxisEstimates:
        """Returns values and sigmas of `gyroscope bias`, `accelerometer bias` or `lever arm`, (3,) each."""
        return estimates_of(self.parameters, name)

    @property
    def name(self) -> str:
        """`spin 1`."""
        return self.label

    @property
    def accelerometer_bias(self) -> BiasEstimate:
        """Accelerometer bias by the method of choice."""
        return self.level_free if self.method == "level-free" else self.published

    @property
    def turns(self) -> float:
        """Full turns, both directions counted."""
        return (self.turned_clockwise + self.turned_counter_clockwise) / FULL_TURN

    @property
    def turns_by_direction(self) -> dict[str, float]:
        """Full turns `clockwise` and `counter-clockwise`, of those in which the robot turned at all."""
        turned = {"clockwise": self.turned_clockwise, "counter-clockwise": self.turned_counter_clockwise}
        return {
            direction: angle / FULL_TURN for direction, angle in turned.items() if angle > SMALLEST_DIRECTION
        }

    @property
    def resting(self) -> float:
        """Length of all rests together, s."""
        return sum(rest.end - rest.start for rest in self.rests)

    def from_start(self, time: LogTime) -> Spin:
        """Returns the spin with times from the first sample of its recording."""
        return replace(
            self,
            start=time.since(self.start),
            end=time.since(self.end),
            rests=tuple(rest.from_start(time) for rest in self.rests),
            blocks=replace(self.blocks, time=self.blocks.time - time.zero),
        )

    @property
    def fits(self) -> bool:
        """Returns whether model and noise explain the data: sigmas are widened in part, or not at all."""
        is_partial = _is_partial(self.chi_square, self.degrees_of_freedom, self.widening)
        return not self.objections and (self.widening == 1.0 or is_partial)


def _is_partial(chi_square: float, freedom: int, widening: float) -> bool:
    """Returns whether sigmas are widened by less than all that chi-square has too much (spin.md, eq. 15)."""
    return widening**2 < 0.999 * (chi_square - (freedom - 1))


def misfit(chi_square: float, freedom: int, widening: float) -> str:
    """Reports the misfit of the model, and its consequence: the same on screen and page."""
    if _is_partial(chi_square, freedom, widening):
        return (
            f"chi-square of the specific force is {chi_square:.3g} for {freedom}: chance makes it once in a "
            f"hundred spins, slipping wheels more often; the sigmas of specific force are widened "
            f"{widening:.1f} times"
        )
    return (
        f"the specific force differs from the model by more than its noise (chi-square {chi_square:.3g} for "
        f"{freedom}), as with slipping wheels, an uneven floor or a swaying robot; the sigmas of specific "
        f"force are widened {widening:.1f} times"
    )


@dataclass(frozen=True, slots=True)
class SpinResult(Tabular, Collection[Spin]):
    """All spins of one recording, and the biases they agree on."""

    name: str
    source: str
    serial: str
    spins: tuple[Spin, ...]
    accelerometer_bias: BiasEstimate
    gyroscope_bias: BiasEstimate
    """Weighted means over the spins; those of the last spin where the spins contradict each other."""
    covariance: FloatArray
    """(6, 6) of [accelerometer bias, gyroscope bias]."""
    agreement: Parameter
    """`chi-square of the spins against their mean`, unit `1`; not observable with a single spin."""
    refused: tuple[tuple[float, float, str], ...]
    """Start and end, s, and why what lies between is no spin that can be used."""
    trace: Trace
    gravity: float
    """m/s^2."""
    gravity_source: str
    gravity_sigma: float | None = None
    """m/s^2; None where nobody states it, and the bias along the vertical is relative to gravity."""
    temperature: tuple[float, float, float] | None = None
    """Lowest, mean and highest, degC."""
    calibration_hash: str = ""
    """sha256 of the calibration applied first; empty if there was none."""
    options: dict[str, object] = field(default_factory=dict)
    """Method options as the calibration file keeps them."""
    warnings: tuple[str, ...] = ()
    software: str = ""
    axes: str = ""
    """Directions of the case axes in a vehicle, such as FRD; empty where the log does not define them."""
    reading: LogReading = field(default_factory=dict, repr=False)
    """Options that changed the readings of the log; empty where they are not known."""
    provenance: Provenance = field(default_factory=provenance_now, compare=False)
    """When and by whom it was found."""
    applied: Mapping[str, object] = field(default_factory=dict, repr=False)
    """Content of the calibration applied first; empty if there was none."""
    time: LogTime = UNKNOWN_TIME
    """Clock of the recording, which all times are of."""

    def from_start(self) -> SpinResult:
        """Returns the result with all times from the first sample of the recording, as people read them."""
        return replace(
            self,
            spins=tuple(spin.from_start(self.time) for spin in self.spins),
            refused=tuple(
                (self.time.since(start), self.time.since(end), why) for start, end, why in self.refused
            ),
            trace=self.trace.from_start(self.time),
            time=FROM_START,
        )

    def _items(self) -> Sequence[Spin]:
        return self.spins

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter of each spin, then those that hold for all spins together."""
        for spin in self.spins:
            for parameter in spin.parameters:
                yield {"spin": spin.label} | parameter.row()
        for parameter in (
            *self.accelerometer_bias.parameters("accelerometer"),
            *self.gyroscope_bias.parameters("gyroscope"),
        ):
            yield {"spin": "all"} | parameter.row()

    @property
    def calibration(self) -> Calibration:
        """Calibration file of the unit, on top of the one applied first: biases of the raw sensor."""
        from tumble.procedures.spin.calibration import calibration_of

        return calibration_of(self)

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.spin.report.page import SPIN_REPORT

        return SPIN_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble spin` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.calibration.unit_files import write_unit_files
        from tumble.procedures.spin.report.page import SPIN_REPORT

        ending: str = "live" if self.options.get("live") else "spin"
        return write_unit_files(self, SPIN_REPORT.write, folder, ending)

    @property
    def verdict(self) -> Verdict:
        """`calibrated` where both biases were found, `model not met` where a spin differs from its model."""
        found = [bias.observable for bias in (self.accelerometer_bias, self.gyroscope_bias)]
        if any(found) and not all(spin.fits for spin in self.spins):
            return "model not met"
        return "calibrated" if all(found) else "partly calibrated" if any(found) else "not calibrated"

    def __repr__(self) -> str:
        shown = [
            f"{spin.label} {each.name} = {each.value:.6g} +- {each.sigma:.2g} {each.unit}"
            for spin in self.spins
            for each in spin.parameters
            if each.observable
        ]
        return "\n  ".join([f"SpinResult({self.name}: {count_of('spin', len(self.spins))})", *shown])

    def _repr_html_(self) -> str:
        from tumble.procedures.spin.report.notebook import spin_html

        return printable(spin_html(self))
