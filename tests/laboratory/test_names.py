"""One unit has one name, and a result one date: forms of a name are one, and a date is one that was."""

from __future__ import annotations

import unicodedata

import pytest

from made_up_calibrations import made_up, save
from tumble.calibration.document import Calibration
from tumble.foundation.errors import TumbleError
from tumble.foundation.names import LONGEST_NAME, normal_name
from tumble.foundation.recording import Metadata
from tumble.laboratory import equipment
from tumble.laboratory.registry import Registry, UnitFacts
from tumble.logs import ReadOptions
from turntable_sessions import one_line, typed

SERIAL = "Gerät 7"
FORMS = (
    SERIAL,
    f"{SERIAL} ",
    f"\t{SERIAL}\u2003",
    unicodedata.normalize("NFD", SERIAL),
    "Ge\u200brät 7\ufeff",
)
TOO_LONG = "x" * (LONGEST_NAME + 1)


@pytest.fixture
def registry(tmp_path):
    return Registry.create(tmp_path / "lab.db")


@pytest.mark.parametrize(
    "enter",
    [
        lambda form: made_up(form).serial,
        lambda form: made_up(name=form).name,
        lambda form: ReadOptions(serial=form).serial,
        lambda form: Metadata.of_arrays("a", serial=form).serial,
        lambda form: UnitFacts(lot=form).lot,
    ],
)
def test_all_forms_of_a_name_are_one(enter):
    assert {enter(form) for form in FORMS} == {SERIAL}
    with pytest.raises((TumbleError, ValueError), match=f"a name of {len(TOO_LONG)} letters"):
        enter(TOO_LONG)


def test_forms_of_a_serial_are_one_unit(registry, tmp_path):
    for number, form in enumerate(FORMS):
        made = made_up("0", log=str(number)).text().replace("serial: '0'", f'serial: "{form}"')
        folder = tmp_path / str(number)
        folder.mkdir()
        (folder / "unit.yaml").write_text(made, encoding="utf-8")
        registry.add(folder)
    assert [unit["serial"] for unit in registry.units()] == [SERIAL]
    assert all(len(registry.list(serial=form)) == len(FORMS) for form in FORMS)


def test_a_name_beyond_all_bounds_is_one_line(registry, tmp_path):
    path = tmp_path / "unit.yaml"
    path.write_text(made_up().text().replace("name: unit", f"name: {'x' * (1 << 20)}"))
    done = typed("registry", "add", path, "--registry", registry.address)
    assert (done.code, "1048576 letters; 1000 at most" in one_line(done.err)) == (2, True)
    with pytest.raises(TumbleError, match="100000000 letters"):
        UnitFacts(owner="x" * 100_000_000)
    with pytest.raises(TumbleError, match="letters"):
        equipment.add(registry, TOO_LONG, {"kind": "table"})


@pytest.mark.parametrize(
    "date",
    [
        "yesterday",
        "2026-02-30",
        "2999-01-01",
        "2026-13-01T00:00:00Z",
        "2026-01-05T10:00",
        "0001-01-01",
        "1969-12-31",
        "20260105",
        "2026-01-05T24:00:00Z",
        "2026-01-05T10:00:00+02:00",
    ],
)
def test_a_result_without_a_date_that_was_is_refused(registry, tmp_path, date):
    folder = save(tmp_path / "results", made_up(date=date))
    done = typed("registry", "add", folder, "--registry", registry.address)
    assert done.code == 2
    assert f"the date '{date}' is " in one_line(done.err)
    built_up = made_up().model_copy(update={"contributions": ()}).content()
    built_up["contributions"] = [
        {"gave": ["accelerometer noise"], "method": {"procedure": "noise"}, "date": date}
    ]
    folder = save(tmp_path / "built up", Calibration.model_validate(built_up))
    with pytest.raises(TumbleError, match="the date"):
        registry.add(folder)
    assert not len(registry.list())


def test_a_clock_of_the_future_dates_no_entry(registry, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "32503680000")
    with pytest.raises(TumbleError, match="in the future"):
        registry.add(save(tmp_path / "results", made_up()))


def test_a_name_has_one_form_alone():
    for form in FORMS:
        assert normal_name(normal_name(form)) == normal_name(form)
