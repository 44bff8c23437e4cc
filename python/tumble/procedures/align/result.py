"""Alignment of units that move together, as plain data that reports show and files keep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from tumble.foundation.log_time import UNKNOWN_TIME, LogTime
from tumble.foundation.provenance import Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.results import (
    AxisEstimates,
    Collection,
    Parameter,
    Row,
    Tabular,
    Verdict,
    estimates_of,
)
from tumble.foundation.words import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class UnitAlignment(Tabular):
    """Alignment of a secondary to the primary. Values that are not observable are NaN, sigma infinite."""

    name: str
    source: str
    """Unambiguous name of the recording: path and IMU."""
    sensor_from_primary: FloatArray | None
    """(3, 3) rotation from the primary's case frame to the secondary's; `None` where it was not shown."""
    rotation_vector: FloatArray
    """(3,) the same as a rotation vector, rad."""
    rotation_covariance: FloatArray
    """(3, 3) of the rotation vector, rad^2."""
    rotation_unseen: FloatArray
    """(k, 3) unit vectors in the secondary's frame, about which the motion does not show the rotation."""
    rotation_from_accelerometers: bool
    """Indicates whether the units turned about one axis only, so that accelerometers show the rotation about
    it."""
    time_offset: float
    """s, to be added to the secondary's time at the instant `reference_time`; then both clocks agree."""
    time_offset_sigma: float
    skew: float
    """Growth of the offset with the primary's time; 0 where both units have one clock."""
    skew_sigma: float
    """0 where both units have one clock."""
    reference_time: float
    """s of the primary's clock."""
    lever_arm: FloatArray
    """(3,) m, from primary to secondary, in the primary's case frame."""
    lever_arm_covariance: FloatArray
    """(3, 3) m^2."""
    lever_arm_unseen: FloatArray
    """(k, 3) unit vectors in the primary's frame, along which the motion does not show the lever arm."""
    gyroscope_bias: FloatArray
    """(3,) rad/s: bias of the secondary minus that of the primary, in the secondary's frame."""
    gyroscope_bias_sigma: FloatArray
    accelerometer_bias: FloatArray
    """(3,) m/s^2: the same of the accelerometers."""
    accelerometer_bias_sigma: FloatArray
    accelerometer_angle: FloatArray
    """(3,) rad: rotation of the accelerometers beyond that of the gyroscopes, about the secondary's axes."""
    accelerometer_angle_sigma: FloatArray
    gyroscope_residual: float
    """rad/s, scatter of what remains between the two units, over a window."""
    accelerometer_residual: float
    """m/s^2, the same."""
    correlation: float
    """Correlation of the rates of both units: 1 where both feel one motion."""
    motion: float
    """rad/s, root mean square rate of the primary."""
    window: float
    """s, over which samples were averaged."""
    pairs: int
    """Windows in which both units could be used."""
    parameters: tuple[Parameter, ...]
    """Everything found: `rotation x` ..., `time offset`, `clock skew`, `lever arm x` ..., and the biases."""
    warnings: tuple[str, ...] = ()

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter."""
        return (parameter.row() for parameter in self.parameters)

    def estimates(self, name: str) -> AxisEstimates:
        """Returns values and sigmas of `rotation`, `lever arm` or another vector, (3,) each."""
        return estimates_of(self.parameters, name)

    def parameter(self, name: str) -> Parameter:
        """Finds a parameter by its name; raises `KeyError` where there is none."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(name)


@dataclass(frozen=True, slots=True)
class AlignResult(Tabular, Collection[UnitAlignment]):
    """A primary and the units that were aligned with it."""

    primary: str
    source: str
    """Log of the primary, without the folders it is in."""
    units: tuple[UnitAlignment, ...]
    options: dict[str, object] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    software: str = ""
    provenance: Provenance = field(default_factory=provenance_now, compare=False)
    """Time and author of the result."""
    serials: Mapping[str, str] = field(default_factory=dict)
    """Serial numbers of the units whose logs state them, by name."""
    time: LogTime = UNKNOWN_TIME
    """Clock of the primary."""

    def _items(self) -> Sequence[UnitAlignment]:
        return self.units

    def rows(self) -> Iterator[Row]:
        """Returns a line for each parameter of each unit."""
        for unit in self.units:
            for parameter in unit.parameters:
                yield {"secondary": unit.name} | parameter.row()

    def plot(self, figure: str | None = None) -> Figure:
        """Draws the figures of the page with matplotlib: all below one another, or the one of that name.

        Raises `TumbleError` where matplotlib is not installed, or the page has no such figure.
        """
        from tumble.procedures.align.report.page import ALIGN_REPORT

        return ALIGN_REPORT.plot(self, figure)

    def save(self, folder: Path | str) -> dict[str, Path]:
        """Writes what `tumble align` writes; returns the path of each file by what it is.

        Raises `OutputError` where a file cannot be written; what stood there before is untouched.
        """
        from tumble.procedures.align.command_files import save

        return save(self, folder)

    @property
    def verdict(self) -> Verdict:
        """`aligned` where rotation, lever arm and time offset of every unit were found."""
        needed = [
            parameter.observable
            for unit in self.units
            for parameter in unit.parameters
            if parameter.name.startswith(("rotation", "lever arm", "time offset"))
        ]
        return "aligned" if all(needed) else "partly aligned"

    def __repr__(self) -> str:
        shown = [
            f"{unit.name} {each.name} = {each.value:.6g} +- {each.sigma:.2g} {each.unit}"
            for unit in self.units
            for each in unit.parameters
            if each.observable
        ]
        return "\n  ".join([f"AlignResult(primary {self.primary})", *shown])

    def _repr_html_(self) -> str:
        from tumble.procedures.align.report.notebook import align_html

        return printable(align_html(self))
