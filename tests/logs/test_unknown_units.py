"""A unit that a log states and that is unknown is refused, unless the user states one: none is guessed."""

from __future__ import annotations

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet as pq
import pytest

from log_fixtures import read
from tumble.foundation.errors import LogError
from tumble.foundation.recording import Recording
from tumble.logs import ReadOptions, open_recording

DRAWS = np.random.default_rng(81)
ROWS = 400
TIME = np.arange(ROWS) / 100.0
FORCE = np.array([0.1, 0.2, 9.8]) + DRAWS.normal(0.0, 0.02, (ROWS, 3))
RATE = np.radians(DRAWS.normal(0.2, 0.05, (ROWS, 3)))
FIELD = np.array([20.0, -5.0, 42.0]) + DRAWS.normal(0.0, 0.1, (ROWS, 3))
COLUMNS = {
    "time": TIME,
    **{f"a{axis}": FORCE[:, k] for k, axis in enumerate("xyz")},
    **{f"g{axis}": RATE[:, k] for k, axis in enumerate("xyz")},
    "temp": 25.0 + TIME / 100.0,
    **{f"m{axis}": FIELD[:, k] for k, axis in enumerate("xyz")},
}
OF = {
    "accelerometer": ("ax", "ay", "az"),
    "gyroscope": ("gx", "gy", "gz"),
    "time": ("time",),
    "temperature": ("temp",),
    "magnetometer": ("mx", "my", "mz"),
}
UNKNOWN = {
    "accelerometer": ("LSB", "counts", "ft/s^2", "0.1 mg", "1e-3 m/s^2", "V", "deg/s", "raw", "mGal"),
    "gyroscope": ("gon/s", "rad/min", "0.1deg/s", "10 deg/s", "LSB", "deg", "deg/h", "m/s^2", "digit"),
    "time": ("0.1ms", "100ns", "min", "ticks", "h"),
    "temperature": ("0.1 degC", "LSB", "degR", "m/s^2"),
    "magnetometer": ("A/m", "LSB", "counts", "local_flux", "deg/s"),
}
UNSTATED = {"time": "s", "accelerometer": "m/s^2", "gyroscope": "rad/s"}


def named(units):
    return {f"{name} [{units[name]}]" if name in units else name: COLUMNS[name] for name in COLUMNS}


def csv(path, units):
    pd.DataFrame(named(units)).to_csv(path, index=False)


def csv_in_parentheses(path, units):
    columns = {name.replace("[", "(").replace("]", ")"): values for name, values in named(units).items()}
    pd.DataFrame(columns).to_csv(path, index=False)


def csv_below_the_names(path, units):
    # Only a line of which one unit is known is one of units: the other columns state theirs.
    known = {name: unit for quantity, unit in UNSTATED.items() for name in OF[quantity]}
    below = [(known | units).get(name, "-") for name in COLUMNS]
    rows = pd.DataFrame(COLUMNS).to_csv(index=False, header=False)
    path.write_text(f"{','.join(COLUMNS)}\n{','.join(below)}\n{rows}")


def npy(path, units):
    columns = named(units)
    table = np.zeros(ROWS, dtype=[(name, np.float64) for name in columns])
    for name, values in columns.items():
        table[name] = values
    np.save(path, table)


def hdf5(path, units):
    with h5py.File(path, "w") as file:
        for name, values in COLUMNS.items():
            file[name] = values
            if name in units:
                file[name].attrs["units"] = units[name]


def hdf5_triads(path, units):
    arrays = {"time": TIME, "acc": FORCE, "gyro": RATE, "temp": COLUMNS["temp"], "mag": FIELD}
    with h5py.File(path, "w") as file:
        for (name, values), columns in zip(
            arrays.items(), (OF[each] for each in ("time", *list(OF)[:2], *list(OF)[3:])), strict=True
        ):
            file[name] = values
            if columns[0] in units:
                file[name].attrs["Unit"] = np.bytes_(units[columns[0]])


def with_metadata(units):
    fields = [
        pa.field(name, pa.float64(), metadata={"unit": units[name]} if name in units else None)
        for name in COLUMNS
    ]
    return pa.table([pa.array(values) for values in COLUMNS.values()], schema=pa.schema(fields))


def parquet(path, units):
    pq.write_table(with_metadata(units), path)


def feather(path, units):
    pyarrow.feather.write_feather(with_metadata(units), path)


WAYS = {
    "csv": csv,
    "csv in parentheses": csv_in_parentheses,
    "csv below the names": csv_below_the_names,
    "npy": npy,
    "h5": hdf5,
    "h5 of triads": hdf5_triads,
    "parquet": parquet,
    "feather": feather,
}
IN_PARENTHESES = {"V", "degR", "local_flux"}
"""Unknown texts that may be names of something else there."""
ROWS_OF_LAW = [
    (way, quantity, text)
    for way in WAYS
    for quantity, texts in UNKNOWN.items()
    for text in texts
    if way != "csv in parentheses" or text not in IN_PARENTHESES
]


def refused(action):
    with pytest.raises(LogError) as caught:
        action()
    return str(caught.value)


def written(folder, way, quantity, text):
    path = folder / f"log.{way.split()[0]}"
    WAYS[way](path, dict.fromkeys(OF[quantity], text))
    return path


@pytest.mark.parametrize(("way", "quantity", "text"), ROWS_OF_LAW)
def test_an_unknown_unit_is_refused_by_file_column_and_text(tmp_path, way, quantity, text):
    path = written(tmp_path, way, quantity, text)
    option = f"--{quantity}-unit"
    if quantity == "temperature":
        found = open_recording(path)
        assert all(chunk.temperature is None for chunk in found.chunks())
        said = f"{path.name} {found.metadata.temperature_fault}"
    elif quantity == "magnetometer":
        said = refused(lambda: open_recording(path).magnetic)
    else:
        said = refused(lambda: open_recording(path))
    assert "\n" not in said
    assert all(each in said for each in (path.name, f"states {text}, ", option)), said
    assert any(f"column {name}" in said for name in (OF[quantity][0], "acc.x", "gyro.x", "mag.x")), said


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("quantity", OF)
def test_a_unit_that_the_user_states_goes_before_an_unknown_one(tmp_path, way, quantity):
    own = {"temperature": "degC", "magnetometer": "uT"} | UNSTATED
    path = written(tmp_path, way, quantity, UNKNOWN[quantity][0])
    options = ReadOptions(**{f"{quantity}_unit": own[quantity]})
    chunk = read(path, options)
    np.testing.assert_allclose(chunk.accelerometer, FORCE, rtol=1e-12)
    np.testing.assert_allclose(chunk.gyroscope, RATE, rtol=1e-12)
    np.testing.assert_allclose(chunk.temperature, COLUMNS["temp"], rtol=1e-12)
    np.testing.assert_allclose(open_recording(path, options).magnetic.field, FIELD, rtol=1e-12)


@pytest.mark.parametrize("triad", ["accelerometer", "gyroscope", "magnetometer"])
def test_counts_per_unit_go_before_an_unknown_unit(tmp_path, triad):
    path = written(tmp_path, "csv", triad, "LSB")
    options = ReadOptions(**{f"{triad}_scale": 1.25})
    is_magnetic = triad == "magnetometer"
    values = (
        open_recording(path, options).magnetic.field if is_magnetic else getattr(read(path, options), triad)
    )
    expected = {"accelerometer": FORCE, "gyroscope": RATE, "magnetometer": FIELD}[triad]
    np.testing.assert_allclose(values, expected / 1.25, rtol=1e-12)


@pytest.mark.parametrize("text", ["LSB", "gon/s"])
def test_readings_as_they_stand_need_no_known_unit(tmp_path, text):
    path = written(tmp_path, "csv", "gyroscope", text)
    assert isinstance(open_recording(path, ReadOptions(as_numbers=True)), Recording)


@pytest.mark.parametrize("end", ["(IMU1)", "(body)", "(MPU6050)", "(x)", "[-]", "[n/a]", "[body]", "(6DOF)"])
@pytest.mark.parametrize("quantity", OF)
def test_a_name_that_states_no_unit_is_read_as_before(tmp_path, quantity, end):
    path = tmp_path / "log.csv"
    columns = {f"{name} {end}" if name in OF[quantity] else name: COLUMNS[name] for name in COLUMNS}
    pd.DataFrame(columns).to_csv(path, index=False)
    assert len(read(path)) == ROWS


@pytest.mark.parametrize(
    "end", ["(UTC)", "[unix]", "(GPS)", "[ISO 8601]", "(hh:mm:ss)", "[seconds since boot]"]
)
def test_a_clock_behind_the_name_of_times_is_no_unit(tmp_path, end):
    path = tmp_path / "log.csv"
    pd.DataFrame({f"time {end}" if name == "time" else name: COLUMNS[name] for name in COLUMNS}).to_csv(
        path, index=False
    )
    np.testing.assert_allclose(read(path).time, TIME, atol=1e-12)


@pytest.mark.parametrize(
    ("quantity", "text", "factor", "zero"),
    [
        ("accelerometer", "cm/s^2", 100.0, 0.0),
        ("accelerometer", "Gal", 100.0, 0.0),
        ("accelerometer", "cm s-2", 100.0, 0.0),
        ("accelerometer", "m·s⁻²", 1.0, 0.0),
        ("gyroscope", "degrees/second", 180.0 / np.pi, 0.0),
        ("gyroscope", "rad s-1", 1.0, 0.0),
        ("gyroscope", "º/s", 180.0 / np.pi, 0.0),
        ("temperature", "degrees F", 1.8, 32.0),
        ("temperature", "℃", 1.0, 0.0),
        ("time", "microseconds since 1970-01-01", 1e6, 0.0),
    ],
)
@pytest.mark.parametrize("way", ["csv", "h5", "parquet"])
def test_spellings_of_known_units_are_read(tmp_path, way, quantity, text, factor, zero):
    path = tmp_path / f"log.{way}"
    scaled = {name: COLUMNS[name] * factor + zero for name in OF[quantity]}
    with pytest.MonkeyPatch.context() as patch:
        for name, values in scaled.items():
            patch.setitem(COLUMNS, name, values)
        WAYS[way](path, dict.fromkeys(OF[quantity], text))
    values = getattr(read(path), quantity)
    expected = {"accelerometer": FORCE, "gyroscope": RATE, "time": TIME, "temperature": COLUMNS["temp"]}
    np.testing.assert_allclose(values, expected[quantity], rtol=1e-9, atol=1e-9)


def test_a_column_that_the_user_names_states_its_unit_too(tmp_path):
    path = tmp_path / "log.csv"
    columns = {f"foo{name} [gon/s]" if name in OF["gyroscope"] else name: COLUMNS[name] for name in COLUMNS}
    pd.DataFrame(columns).to_csv(path, index=False)
    named_so = ReadOptions(columns={name: f"foo{name}" for name in OF["gyroscope"]})
    with pytest.raises(LogError, match=r"column foogx \[gon/s\] states gon/s"):
        open_recording(path, named_so)


@pytest.mark.parametrize("text", ["g", "rad/s", "0.1 dps", "mG", "Gal", "16384 LSB", "raw", "m s-2"])
def test_parentheses_state_a_unit_where_their_text_is_like_one(tmp_path, text):
    path = tmp_path / "log.csv"
    csv_in_parentheses(path, dict.fromkeys(OF["gyroscope"], text))
    if text == "rad/s":
        np.testing.assert_allclose(read(path).gyroscope, RATE, rtol=1e-12)
    else:
        assert f"column gx ({text}) states {text}, " in refused(lambda: open_recording(path))


def test_a_sensor_in_parentheses_leaves_the_unit_of_the_name(tmp_path):
    path = tmp_path / "log.csv"
    rates = {f"{name}_dps (IMU1)": np.degrees(COLUMNS[name]) for name in OF["gyroscope"]}
    others = {name: values for name, values in COLUMNS.items() if name not in OF["gyroscope"]}
    pd.DataFrame(others | rates).to_csv(path, index=False)
    np.testing.assert_allclose(read(path).gyroscope, RATE, rtol=1e-9)


def test_one_unknown_axis_is_refused_beside_known_ones(tmp_path):
    path = tmp_path / "log.csv"
    csv(path, {"ax": "m/s^2", "ay": "m/s^2", "az": "LSB"})
    assert "column az [LSB] states LSB" in refused(lambda: open_recording(path))
