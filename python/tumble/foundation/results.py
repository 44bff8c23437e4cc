"""Results shared by several procedures, as plain data: reports show them and calibration files keep them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Generic, Literal, NamedTuple, Protocol, TypeAlias, TypeVar

import numpy as np

from tumble import _core
from tumble.foundation.errors import ProcedureError
from tumble.foundation.frames import dataset_of, frame_of, html_table
from tumble.foundation.log_time import LogTime
from tumble.foundation.provenance import LogFacts, Provenance, provenance_now
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import CalibratedTriad
from tumble.foundation.words import count_of, printable

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

TriadName = Literal["accelerometer", "gyroscope"]

Precision = Literal["f64", "f32"]
"""Floats to compute with: f32 as on a device."""

Verdict = Literal[
    "pass",
    "conditional pass",
    "conditional fail",
    "fail",
    "calibrated",
    "model not met",
    "partly calibrated",
    "not calibrated",
    "aligned",
    "partly aligned",
    "measured",
    "partly measured",
    "same",
    "differ",
    "cannot be told",
]
"""Verdict of a procedure on a unit, or on a set of units."""

Figures: TypeAlias = Mapping[str, float]
"""Figures of what the core objects to: SI units, times in s of the clock of the samples."""

INTERVAL = 1.959963984540054
"""Sigmas to either end of a 95 % interval."""

LARGEST_WIDENING = 10.0
"""Factor on sigmas beyond which the model is not met: noise is then less than a hundredth of what the
residuals hold, and nothing shows that the rest is as random (docs/theory/turntable.md, section 7)."""

SCALES_OF_SENSORS = (0.5, 2.0)
"""Scales between which any accelerometer or gyroscope is; beyond, its log is not what it is taken for."""

LARGEST_ANGLE_OF_SENSORS = 15.0
"""deg: non-orthogonality that no accelerometer or gyroscope has."""

GROUPS = ("bias", "scale", "non-orthogonality", "mounting")
"""Groups of the parameters of a triad, before the axis in their names."""

NOT_SHOWN = "the data do not show it"
"""Reason why a parameter is not observable, where no more is known."""


Row: TypeAlias = dict[str, object]
"""One line of a result as a table: what was found, by the name of its column."""


class Tabular:
    """A result that can be had as a table."""

    __slots__ = ()

    @abstractmethod
    def rows(self) -> Iterator[Row]:
        """Returns the result line by line, every line with the same columns."""

    def to_pandas(self) -> DataFrame:
        """Returns `rows()` as a data frame; raises `TumbleError` where pandas is not installed."""
        return frame_of(self.rows())

    def to_xarray(self) -> Dataset:
        """Returns `rows()` as a data set, with a dimension for each column that names a number.

        `result.to_xarray().value.sel(sensor="gyroscope", parameter="bias x")` is one of them. Tables without
        a column `value` have one dimension, `row`. Raises `TumbleError` where xarray is not installed.
        """
        return dataset_of(self.rows())

    def _repr_html_(self) -> str:
        return printable(html_table(self.rows()))


class Named(Protocol):
    """An item with a name of its own within a result."""

    @property
    def name(self) -> str:
        """Name as in tables and messages."""


Item = TypeVar("Item", bound=Named)


class Collection(Generic[Item]):
    """A result that holds one of a kind for each unit; they are found by name, or by position."""

    __slots__ = ()

    @abstractmethod
    def _items(self) -> Sequence[Item]:
        """All of them, in order."""

    def __len__(self) -> int:
        return len(self._items())

    def __iter__(self) -> Iterator[Item]:
        return iter(self._items())

    def __bool__(self) -> bool:
        return True

    def __contains__(self, wanted: object) -> bool:
        return any(wanted in (item.name,) or wanted is item for item in self._items())

    def __getitem__(self, wanted: str | int) -> Item:
        """Finds one; raises `KeyError` where none has that name, `IndexError` where there are not as many."""
        items = self._items()
        if isinstance(wanted, int):
            return items[wanted]
        for item in items:
            if item.name == wanted:
                return item
        raise KeyError(f"{wanted}: is none of {', '.join(item.name for item in items)}")


def only(units: Sequence[object]) -> int:
    """Returns the place of the only unit; raises `ProcedureError` where there is not exactly one."""
    if len(units) != 1:
        raise ProcedureError(
            f"there are calibrations of {count_of('unit', len(units))}; take them by name from calibrations"
        )
    return 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Addition:
    """Common fields of results that extend a calibration or begin one."""

    name: str
    sources: tuple[str, ...]
    serial: str
    logs: tuple[LogFacts, ...] = ()
    """Facts about each source."""
    provenance: Provenance = field(default_factory=provenance_now, compare=False)
    """Time and author of the result."""
    start_hash: str = ""
    """sha256 of the calibration that it is added to; empty if there was none."""
    start: Mapping[str, object] = field(default_factory=dict, repr=False)
    """Content of that calibration; empty if there was none."""
    options: dict[str, object] = field(default_factory=dict)
    """Method options as the calibration file keeps them."""
    warnings: tuple[str, ...] = ()
    software: str = ""

    @property
    def states_si_units(self) -> bool:
        """True if the unit of every sensor is stated or shown; values may be in another than one assumed."""
        return not any(log.has_assumed_unit for log in self.logs)

    @property
    def started(self) -> str:
        """Date at which the first log began; empty where its stamps are no dates."""
        return self.logs[0].time.date if self.logs else ""


@dataclass(frozen=True, slots=True)
class Parameter:
    """One estimated number with its uncertainty, in the unit people read it in."""

    name: str
    """Field term with axis: `bias x`, `scale y`, `non-orthogonality xy`, `mounting z`."""
    unit: str
    """`m/s^2`, `rad/s`, `uT`, `1`, `deg`."""
    value: float
    sigma: float
    """1-sigma; infinite where the data do not show the parameter."""
    low: float
    high: float
    """Ends of the 95 % interval."""
    observable: bool = True
    reason: str = ""
    """Reason why it could not be observed."""
    inherited: float | None = None
    """1-sigma, within `sigma`, that reference and gravity leave on all targets; None where not stated."""

    def row(self) -> Row:
        """Returns it as columns of a table, its name as `parameter`."""
        return {"parameter": self.name} | {
            name: getattr(self, name)
            for name in ("value", "sigma", "low", "high", "unit", "observable", "reason")
        }


class AxisEstimates(NamedTuple):
    """Numbers of one kind for the axes of a triad, as plain arrays."""

    value: FloatArray
    """(3,) NaN where the data do not show it."""
    sigma: FloatArray
    """(3,) 1-sigma; infinite where the data do not show it."""


def estimates_of(parameters: Iterable[Parameter], name: str) -> AxisEstimates:
    """Gathers the parameters whose name, but for its last word, is `name`: `bias` for those of x, y and z.

    Raises `KeyError` with the names there are.
    """
    groups: dict[str, list[Parameter]] = {}
    for parameter in parameters:
        groups.setdefault(parameter.name.rpartition(" ")[0], []).append(parameter)
    if name not in groups:
        raise KeyError(f"{name}: is none of {', '.join(filter(None, groups))}")
    return axis_estimates(groups[name])


def axis_estimates(parameters: Iterable[Parameter]) -> AxisEstimates:
    """Gathers parameters of one kind, an axis each."""
    found = [(each.value, each.sigma) if each.observable else (np.nan, np.inf) for each in parameters]
    value, sigma = np.array(found, dtype=np.float64).T
    return AxisEstimates(value.copy(), sigma.copy())


@dataclass(frozen=True, slots=True)
class TriadResult:
    """Calibration of three accelerometers, gyroscopes or magnetometers: `y = M u + b`, `M = K L Q`."""

    triad: CalibratedTriad
    unit: str
    """`m/s^2`, `rad/s` or `uT`: unit of b and of the residuals."""
    M: FloatArray
    """(3, 3) sensor from case."""
    b: FloatArray
    """(3,) in `unit`."""
    K: FloatArray
    """(3, 3) diagonal scale."""
    L: FloatArray
    """(3, 3) lower triangular with unit rows: non-orthogonality."""
    Q: FloatArray
    """(3, 3) rotation, sensor_from_case: mounting."""
    covariance: FloatArray
    """(12, 12) of [M row by row, b]; NaN in rows and columns of what was not observable; without
    `inherited`."""
    parameters: tuple[Parameter, ...]
    """bias, scale, non-orthogonality and mounting, three each."""
    estimated: tuple[str, ...]
    """Groups that the data showed: subset of `bias`, `matrix`, `g-sensitivity`."""
    unobservable: tuple[str, ...]
    """Directions of [M, b] the data did not show, in words; empty if all were seen."""
    rank: int
    chi_square: float
    degrees_of_freedom: int
    residuals: FloatArray
    """(k, 3) measured minus modelled for each rest (accelerometer), rest and turn (gyroscope), in `unit`."""
    residual_sigma: FloatArray
    """(k, 3) 1-sigma of the measured means."""
    residual_labels: tuple[str, ...]
    """(k,) `rest 3: Y up`, `turn 3-4`."""
    noise_density: FloatArray
    """(3,) white noise N, unit / sqrt(Hz)."""
    bias_instability: FloatArray
    """(3,) flicker noise B, unit; zero where the record does not show any."""
    g_sensitivity: FloatArray | None = None
    """(3, 3) rad/s per m/s^2, gyroscope only, on request."""
    g_sensitivity_sigma: FloatArray | None = None
    inherited: FloatArray | None = None
    """(12, 12) covariance of [M row by row, b] that all targets of a reference, or of one gravity,
    have in common; None where nobody states that."""
    widening: float = 1.0
    """Factor by which all sigmas were widened because the residuals exceed the noise; 1 where they do not."""
    by_direction: float = 0.0
    """1-sigma, in `unit`, by which residuals go with the direction of gravity, which the sigmas include."""
    objections: tuple[str, ...] = ()
    """Sentences on what else the model does not hold; empty if there is nothing."""

    def estimates(self, name: str) -> AxisEstimates:
        """Returns values and sigmas of `bias`, `scale`, `non-orthogonality` or `mounting`, (3,) each.

        Units are those of the parameters: of the triad, 1, and deg for angles.
        """
        return estimates_of(self.parameters, name)

    @property
    def model_met(self) -> bool:
        """Returns whether noise, or an equally random effect, explains the residuals, and nothing objects."""
        return self.widening <= LARGEST_WIDENING and not self.objections

    @property
    def p_value(self) -> float:
        """Chance of a larger chi-square, were the model and the noise right."""
        return _core.chi_square_tail(self.chi_square, self.degrees_of_freedom)


@dataclass(frozen=True, slots=True)
class Rest:
    """A stretch in which the unit stood still."""

    start: float
    end: float
    """Seconds of the recording's own clock."""
    samples: int
    specific_force: FloatArray
    """(3,) mean, m/s^2, as measured."""
    angular_rate: FloatArray
    """(3,) mean, rad/s, as measured."""
    specific_force_sigma: FloatArray
    """(3,) 1-sigma of the mean."""
    angular_rate_sigma: FloatArray
    pose: str = ""
    """Name of the matched pose, empty if none."""
    used: bool = True
    remark: str = ""
    """Reason why it was not used, or an irregularity."""

    def from_start(self, time: LogTime) -> Rest:
        """Returns the rest with times from the first sample of its recording."""
        return replace(self, start=time.since(self.start), end=time.since(self.end))


@dataclass(frozen=True, slots=True)
class Trace:
    """A recording at a glance: means over equal stretches, few enough to draw."""

    time: FloatArray
    """(n,) s."""
    accelerometer: FloatArray
    """(n, 3) m/s^2."""
    gyroscope: FloatArray
    """(n, 3) rad/s."""

    def from_start(self, time: LogTime) -> Trace:
        """Returns the recording with times from its first sample."""
        return replace(self, time=self.time - time.zero)


@dataclass(frozen=True, slots=True)
class LimitCheck:
    """One line of a limits file held against one target."""

    parameter: str
    """`accelerometer bias x`."""
    value: float
    limit: float
    """Largest magnitude allowed."""
    unit: str
    passed: bool
    remark: str = ""
    """Reason why it could not be shown to be within its limit."""
