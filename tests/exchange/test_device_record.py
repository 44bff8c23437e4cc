"""Records for devices: what they hold, and what is no record."""

import numpy as np
import pytest

from exchange_units import calibration, with_current
from tumble.calibration.document import Calibration
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.units import TRIADS
from tumble.tools.exchange.procedure import export, import_calibrations

FORMS = ("record", "record-hex", "record-c")
IDENTITY = {"identity": "0x0123456789ABCDEF"}


def unit_with_sigmas(seed):
    content = calibration(seed, parts=("scale", "non-orthogonality"), over_temperature=True).content()
    sigma = np.array([1e-3] * 11 + [np.nan])
    for triad in TRIADS:
        content[triad]["covariance"] = np.diag(sigma**2)
    return Calibration.model_validate(content)


@pytest.mark.parametrize("form", FORMS)
def test_sigmas_temperature_and_identity_outlast_a_record(tmp_path, form):
    unit = unit_with_sigmas(2)
    (tmp_path / "unit").write_bytes(export(unit, form, IDENTITY).content)
    (found,) = import_calibrations(tmp_path / "unit")
    assert found.serial == str(0x0123456789ABCDEF)
    assert found.temperature.mean == 30.0
    for triad in TRIADS:
        ours, theirs = getattr(unit, triad), getattr(found, triad)
        sigmas = np.sqrt(np.diag(theirs.covariance))
        assert sigmas[:11] == pytest.approx(1e-3)
        assert np.isnan(sigmas[11])
        assert theirs.temperature_drift.reference == 30.0
        for power, stored in zip(ours.temperature_drift.bias, theirs.temperature_drift.bias, strict=True):
            assert stored == pytest.approx(power, rel=1e-6)
    force, rate = np.random.default_rng(1).normal(size=(2, 20, 3))
    for ours, theirs in zip(unit.correct(force, rate, 50.0), found.correct(force, rate, 50.0), strict=True):
        assert np.abs(ours - theirs).max() < 1e-5


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("current_unit", ["A", "1"])
def test_a_magnetometer_outlasts_a_record(tmp_path, form, current_unit):
    content = with_current(4, current_unit).content()
    sigma = np.array([1e-3] * 11 + [np.nan])
    content["magnetometer"]["covariance"] = np.diag(sigma**2)
    unit = Calibration.model_validate(content)
    exported = export(unit, form, IDENTITY)
    assert exported.losses == ()
    (tmp_path / "unit").write_bytes(exported.content)
    (found,) = import_calibrations(tmp_path / "unit")
    assert found.magnetometer.current_unit == current_unit
    assert np.sqrt(np.diag(found.magnetometer.covariance))[:11] == pytest.approx(1e-3)
    field = 50.0 * np.random.default_rng(1).normal(size=(20, 3))
    assert np.abs(unit.correct_magnetic(field, 7.0) - found.correct_magnetic(field, 7.0)).max() < 1e-4


@pytest.mark.parametrize("place", [0, 2, 5, 40, 165, 300, -1])
def test_a_byte_that_changed_is_refused(tmp_path, place):
    content = bytearray(export(unit_with_sigmas(3), "record", IDENTITY).content)
    content[place] ^= 0x10
    (tmp_path / "unit.bin").write_bytes(content)
    with pytest.raises(CalibrationFileError, match="a record "):
        import_calibrations(tmp_path / "unit.bin", "record")


@pytest.mark.parametrize("length", [1, 6, 100, 170, 175])
def test_a_record_that_was_cut_off_is_refused(tmp_path, length):
    content = export(unit_with_sigmas(4), "record", IDENTITY).content[:length]
    (tmp_path / "unit.bin").write_bytes(content)
    with pytest.raises(CalibrationFileError, match="a record "):
        import_calibrations(tmp_path / "unit.bin", "record")
