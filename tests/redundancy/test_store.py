"""Stored errors: kept over runs, refused when damaged or strange, never lost."""

from __future__ import annotations

import os
import re
import shutil

import numpy as np
import pytest
import yaml

from redundancy_sets import (
    BIASED,
    PRIMARY,
    QUICK,
    SOUND,
    motion,
    of,
    record,
    refusal,
    replay,
    typed,
    units,
    write_table,
)
from stored_errors import ONE, TWO, an_error
from tumble.foundation.errors import OutputError
from tumble.procedures.redundancy.result import SecondaryError
from tumble.procedures.redundancy.store import SENSORS, ErrorStore, Identified, StoredError
from turntable_sessions import contents


def same(one, other):
    for name in SecondaryError.__slots__:
        if name != "adopted":
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("sensor", ["accelerometer", "gyroscope"])
@pytest.mark.parametrize("residual", [0.02, np.nan])
def test_stored_error_is_read_back_to_the_last_digit(tmp_path, sensor, residual):
    error = an_error(sensor, residual=residual)
    ErrorStore(tmp_path, ONE).save(TWO, error)
    found, rejected = ErrorStore(tmp_path, ONE).load(TWO)
    assert rejected == []
    same(found[0], error)
    assert found[0].adopted is None


def test_file_without_the_followed_error_reads_as_having_none(tmp_path):
    path = ErrorStore(tmp_path, ONE).save(TWO, an_error(followed=np.array([0.1, 0.0, 0.0])))
    content = yaml.safe_load(path.read_text())
    assert content.pop("followed") == [0.1, 0.0, 0.0]
    content["checksum"] = StoredError.model_validate(content).digest()
    path.write_text(yaml.safe_dump(content))
    found, rejected = ErrorStore(tmp_path, ONE).load(TWO)
    assert rejected == []
    assert found[0].followed.tolist() == [0.0, 0.0, 0.0]


def test_the_last_error_is_replaced_and_the_first_one_kept_beside_it(tmp_path):
    store = ErrorStore(tmp_path, ONE)
    for sequence in (1, 2, 3):
        store.save(TWO, an_error(sequence=sequence))
    assert {path.name for path in tmp_path.iterdir()} == {
        "imu2-accelerometer.yaml",
        "imu2-accelerometer-factory.yaml",
    }
    assert yaml.safe_load((tmp_path / "imu2-accelerometer-factory.yaml").read_text())["sequence"] == 1
    assert store.load(TWO)[0][0].sequence == 3


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda text: text.replace("0.1,", "0.2,"), "its checksum does not match"),
        (lambda text: text[: len(text) // 2], ""),
        (lambda _: "", "an empty file"),
        (lambda _: "\x00\xff", ""),
        (lambda text: text.replace("sensor: accelerometer", "sensor: barometer"), "sensor"),
    ],
)
def test_damaged_file_is_rejected_for_the_factory_error(tmp_path, damage, says):
    store = ErrorStore(tmp_path, ONE)
    store.save(TWO, an_error(sequence=1))
    path = store.save(TWO, an_error(sequence=2))
    path.write_text(damage(path.read_text()))
    found, rejected = ErrorStore(tmp_path, ONE).load(TWO)
    assert [error.sequence for error in found] == [1]
    assert (rejected[0].unit, rejected[0].sensor, rejected[0].reason) == ("imu2", "accelerometer", "corrupt")
    assert says in rejected[0].detail


def test_record_of_another_unit_or_primary_is_rejected(tmp_path):
    ErrorStore(tmp_path, ONE).save(TWO, an_error())
    found, rejected = ErrorStore(tmp_path, ONE).load(Identified("imu2", 3))
    assert found == []
    assert {each.reason for each in rejected} == {"of another unit"}
    found, rejected = ErrorStore(tmp_path, Identified("imu3", 3)).load(TWO)
    assert found == []
    assert {each.reason for each in rejected} == {"against another primary"}


def test_a_doubted_file_is_set_aside_and_not_overwritten(tmp_path):
    store = ErrorStore(tmp_path, ONE)
    path = store.save(TWO, an_error(sequence=1))
    for number in (2, 3):
        path.write_text(f"damaged {number}")
        store = ErrorStore(tmp_path, ONE)
        store.load(TWO)
        store.save(TWO, an_error(sequence=number))
    assert (tmp_path / "imu2-accelerometer.yaml.rejected").read_text() == "damaged 2"
    assert (tmp_path / "imu2-accelerometer.yaml.rejected-2").read_text() == "damaged 3"
    assert ErrorStore(tmp_path, ONE).load(TWO)[0][0].sequence == 3


def test_a_store_that_fails_to_write_keeps_what_it_had(tmp_path, monkeypatch):
    store = ErrorStore(tmp_path, ONE)
    store.save(TWO, an_error(sequence=1))
    before = contents(tmp_path)

    def full(self, target):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr("pathlib.Path.replace", full)
    with pytest.raises(OutputError, match="No space left"):
        store.save(TWO, an_error(sequence=2))
    assert contents(tmp_path) == before


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """A flight in which the secondary is calibrated, and another after it."""
    folder = tmp_path_factory.mktemp("flights")
    moved = motion()
    paths = [
        write_table(folder / f"{n}.csv", record([PRIMARY, BIASED, SOUND], 30 + n, moved)) for n in (1, 2)
    ]
    result, _ = replay(
        paths[0], *units(["imu1", "imu2", "imu3"]), *QUICK, "--store", folder / "store", "-o", folder / "out"
    )
    assert {error["unit"] for error in result["errors"]} == {"imu2"}
    return folder, paths


@pytest.fixture
def stored(flights, tmp_path):
    """A copy of the store after the first flight."""
    folder, _ = flights
    copy = tmp_path / "store"
    copy.mkdir()
    for name, text in contents(folder / "store").items():
        (copy / name).write_bytes(text)
    return copy


def second(flights, store, out, *more, code=0):
    return replay(
        flights[1][1], *units(["imu1", "imu2", "imu3"]), *QUICK, "--store", store, "-o", out, *more, code=code
    )


def test_secondary_starts_with_its_stored_error_and_does_not_deviate(flights, stored, tmp_path):
    before = contents(stored)
    result, events = second(flights, stored, tmp_path / "out")
    assert {event["figures"]["sensor"] for event in of(events, "imu2", "restored")} == {
        "accelerometer",
        "gyroscope",
    }
    assert of(events, "imu2", "triggered") == []
    assert all(error["adopted"] is None for error in result["errors"])
    assert contents(stored) == before
    assert (tmp_path / "out" / "imu2.redundancy.yaml").exists()
    assert not (tmp_path / "out" / "store").exists()


def test_corrupt_store_is_reported_and_the_replay_goes_on(flights, stored, tmp_path):
    for path in stored.glob("imu2-accelerometer*.yaml"):
        path.write_text("garbage")
    result, events = second(flights, stored, tmp_path / "out")
    rejected = of(events, "imu2", "record rejected")
    assert {event["figures"]["reason"] for event in rejected} == {"corrupt"}
    assert any("was not loaded, corrupt" in line for line in result["warnings"])
    assert of(events, "imu2", "adopted")
    assert (stored / "imu2-accelerometer.yaml.rejected").read_text() == "garbage"
    assert (stored / "imu2-accelerometer-factory.yaml.rejected").read_text() == "garbage"
    assert ErrorStore(stored, _identified("imu1")).load(_identified("imu2"))[1] == []


def test_store_of_another_unit_is_reported_and_the_replay_goes_on(flights, stored, tmp_path):
    _, events = second(flights, stored, tmp_path / "out", "--set", "units.imu2.identity=99")
    assert {event["figures"]["reason"] for event in of(events, "imu2", "record rejected")} == {
        "of another unit"
    }
    assert of(events, "imu2", "adopted")


def test_store_of_another_primary_is_reported_and_the_replay_goes_on(flights, stored, tmp_path):
    result, events = replay(
        flights[1][1], *units(["imu3", "imu2"]), *QUICK, "--store", stored, "-o", tmp_path / "out"
    )
    assert {event["figures"]["reason"] for event in of(events, "imu2", "record rejected")} == {
        "against another primary"
    }
    assert any("was calibrated against imu1, not imu3" in line for line in result["warnings"])


SERIALS = {"imu1": "P-7", "imu2": "S-8", "imu3": "S-9"}


def serials(**changes):
    """Options that state the serial of each unit."""
    stated = SERIALS | changes
    return [word for name, serial in stated.items() for word in ("--set", f"units.{name}.serial={serial}")]


@pytest.fixture(scope="module")
def with_serials(flights):
    """The store of the first flight, whose units have serials."""
    folder, paths = flights
    names = units(["imu1", "imu2", "imu3"])
    store = folder / "with_serials"
    replay(paths[0], *names, *QUICK, *serials(), "--store", store, "-o", folder / "out_serials")
    return store


@pytest.fixture
def marked(with_serials, tmp_path):
    """A copy of that store."""
    return shutil.copytree(with_serials, tmp_path / "marked")


def test_stored_error_carries_date_and_both_serials(marked):
    for path in marked.glob("imu2-*.yaml"):
        stored = yaml.safe_load(path.read_text())
        assert (stored["serial"], stored["primary_serial"]) == ("S-8", "P-7")
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", stored["date"])


@pytest.mark.parametrize(("unit", "was"), [("imu1", "P-7"), ("imu2", "S-8")])
def test_store_of_another_set_with_equal_names_is_refused_unchanged(flights, marked, tmp_path, unit, was):
    before = contents(marked)
    names = units(["imu1", "imu2", "imu3"])
    other = serials(**{unit: "X-1"})
    line = refusal(flights[1][1], *names, *QUICK, *other, "--store", marked, "-o", tmp_path / "out")
    assert f"{unit} with serial {was}, but the log is of {unit} with serial X-1" in line
    assert contents(marked) == before


def test_the_store_of_the_same_serials_is_taken_without_a_word(flights, marked, tmp_path):
    result, events = second(flights, marked, tmp_path / "out", *serials())
    assert len(of(events, "imu2", "restored")) == 2
    assert not any("serial" in line for line in result["warnings"])


def test_unit_without_a_serial_is_known_by_name_with_a_notice(flights, marked, tmp_path):
    result, events = second(flights, marked, tmp_path / "out")
    assert len(of(events, "imu2", "restored")) == 2
    assert any(
        line.startswith("no serial number of imu1, imu2, imu3 is known") for line in result["warnings"]
    )


def test_stored_error_without_serial_is_taken_by_name_with_a_notice(flights, stored, tmp_path):
    result, events = second(flights, stored, tmp_path / "out", *serials())
    assert len(of(events, "imu2", "restored")) == 2
    said = [line for line in result["warnings"] if "does not state the serials" in line]
    assert [str(stored / f"imu2-{sensor}.yaml") in line for sensor, line in zip(SENSORS, said, strict=True)]


def test_a_serial_that_contradicts_that_of_the_log_is_refused(flights, tmp_path):
    names = units(["imu1", "imu2"])
    logged = ("--for", "imu2:serial=S-8")
    line = refusal(flights[1][1], *names, *logged, "--set", "units.imu2.serial=X-1", "-o", tmp_path / "out")
    assert "serial is X-1, but its log states S-8" in line


def test_units_with_the_serial_of_their_board_differ_by_name(flights, tmp_path):
    store = tmp_path / "store"
    for run in (1, 2):
        board = ("--serial", "BOARD-3", "--store", store)
        names = units(["imu1", "imu2", "imu3"])
        _, events = replay(flights[1][1], *names, *QUICK, *board, "-o", tmp_path / str(run))
    assert len(of(events, "imu2", "restored")) == 2
    stored = [yaml.safe_load(path.read_text()) for path in store.glob("*.yaml")]
    assert {each["serial"] for each in stored} == {"BOARD-3"}
    assert all(each["identity"] != each["primary_identity"] for each in stored)


def test_implausible_stored_error_is_rejected_and_set_aside(flights, tmp_path):
    store = tmp_path / "store"
    wild = an_error(bias=np.array([50.0, 0.0, 0.0]), matrix_sigma=np.full((3, 3), 1e-3))
    ErrorStore(store, _identified("imu1")).save(_identified("imu2"), wild)
    _, events = second(flights, store, tmp_path / "out")
    assert of(events, "imu2", "record rejected")[0]["figures"]["reason"] == "implausible"
    assert (store / "imu2-accelerometer.yaml.rejected").exists()
    assert ErrorStore(store, _identified("imu1")).load(_identified("imu2"))[0][0].bias[0] < 1.0


def test_a_replay_that_is_refused_leaves_the_store_as_it_was(flights, stored, tmp_path):
    before = contents(stored)
    done = typed(
        "redundancy",
        flights[1][1],
        *units(["imu1", "imu2", "imu3"]),
        *QUICK,
        "--store",
        stored,
        "--command",
        "900:evaluate",
        "-o",
        tmp_path / "out",
    )
    assert done.code == 2
    assert contents(stored) == before


def test_unwritable_store_is_refused_before_the_replay(flights, tmp_path):
    path = tmp_path / "file"
    path.write_text("")
    names = units(["imu1", "imu2", "imu3"])
    line = refusal(flights[1][1], *names, "--store", path, "-o", tmp_path / "out")
    assert line.startswith(f"{path}: cannot write")


def test_the_sequence_counts_on_over_flights(flights, stored, tmp_path):
    # With so small a threshold imu3 is to be calibrated too, which makes it no better.
    _, events = second(
        flights, stored, tmp_path / "out", "--set", "secondary_accelerometer_threshold=0.0001", code=3
    )
    assert {event["figures"]["sequence"] for event in of(events, "imu2", "adopted")} <= {2, 3}
    restored = of(events, "imu2", "restored")
    assert {event["figures"]["sequence"] for event in restored} == {1}


def _identified(name):
    from tumble.procedures.redundancy.units import UnitSettings, identity_of

    return Identified(name, identity_of(name, UnitSettings()))
