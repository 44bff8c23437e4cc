"""Text as it comes over a line: whole, in pieces, torn, as CSV or JSON, with garbage in between."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from live_fixtures import HEADER, chunks_of, pieces_of, resting, samples_of, scripted, text_lines
from tumble.foundation.errors import LogError
from tumble.live.labels import LabelReader
from tumble.logs import ReadOptions

TABLE = resting(120)


def refusal(pieces, whole=False, **options):
    """The line with which a stream is refused."""
    with pytest.raises(LogError) as caught:
        samples_of(scripted(pieces, whole, **options))
    message = str(caught.value)
    assert "\n" not in message
    return message


@given(cuts=st.lists(st.integers(1, 4000), max_size=30))
def test_samples_do_not_depend_on_how_bytes_are_cut_into_pieces(cuts):
    data = text_lines(TABLE)
    edges = sorted({0, len(data), *(cut for cut in cuts if cut < len(data))})
    pieces = [data[first:last] for first, last in pairwise(edges)]
    assert np.array_equal(samples_of(scripted(pieces)), TABLE)


def test_row_that_lacks_its_front_is_left_out_when_joined_midway():
    data = text_lines(TABLE, header=None)
    first_number = len(repr(TABLE[0, 0])) + 1
    found = samples_of(scripted([data[first_number + 3 :]]))
    assert np.array_equal(found, TABLE[1:])


def test_names_without_their_front_do_not_shift_the_columns():
    for lost in range(1, len(HEADER)):
        found = samples_of(scripted([text_lines(TABLE)[lost:]]))
        assert np.array_equal(found, TABLE), HEADER[lost:]


def test_names_may_come_first_when_a_device_starts_on_opening():
    noise = b"ets Jul 29 2019 12:21:46\r\nrst:0x1 (POWERON_RESET)\r\n"
    assert np.array_equal(samples_of(scripted([noise + text_lines(TABLE)])), TABLE)


def test_names_that_come_again_are_no_sample():
    data = text_lines(TABLE[:60]) + text_lines(TABLE[60:])
    source = scripted([data])
    assert np.array_equal(samples_of(source), TABLE)
    (remark,) = source.remarks
    assert "gyroscope is assumed to be in rad/s" in remark


def test_seven_numbers_without_names_are_time_force_and_rate():
    source = scripted([text_lines(TABLE, header=None)], whole=True)
    assert np.array_equal(samples_of(source), TABLE)
    assert "no column names: assumed to be time, ax, ay, az, gx, gy, gz" in source.remarks


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_fields_may_be_separated_as_in_logs(separator):
    data = text_lines(TABLE, header=HEADER.replace(",", separator), separator=separator)
    assert np.array_equal(samples_of(scripted([data])), TABLE)


@pytest.mark.parametrize("end", [b"\n", b"\r", b"\r\n"])
def test_lines_may_end_as_devices_end_them(end):
    data = text_lines(TABLE).replace(b"\r\n", end)
    assert np.array_equal(samples_of(scripted(pieces_of(data, 100))), TABLE)


def test_columns_may_be_named_by_the_user():
    data = text_lines(TABLE[:, [4, 5, 6, 0, 1, 2, 3]], header=None)
    columns = {"gx": "1", "gy": "2", "gz": "3", "time": "4", "ax": "5", "ay": "6", "az": "7"}
    assert np.array_equal(samples_of(scripted([data], whole=True, columns=columns)), TABLE)


def test_one_of_several_imus_is_picked_by_the_prefix_of_its_columns():
    header = "time,left_ax,left_ay,left_az,left_gx,left_gy,left_gz," + ",".join(
        f"right_{name}" for name in HEADER.split(",")[1:]
    )
    other = resting(120, seed=9)
    data = text_lines(np.column_stack([TABLE, other[:, 1:]]), header=header)
    found = samples_of(scripted([data], topic="right"))
    assert np.array_equal(found, np.column_stack([TABLE[:, 0], other[:, 1:]]))
    assert "name one, as serial:/dev/test:left (found: left, right)" in refusal([data])
    assert "no column prefix 'middle'; found: left, right" in refusal([data], topic="middle")


def test_lines_torn_on_the_way_are_left_out_and_counted():
    lines = text_lines(TABLE).splitlines(keepends=True)
    torn = [b"0.3,0.1\r\n", b"\xff\xfe\x00garbage\x80\r\n", b"0.4,,x1,9.8,0,0,0\r\n"]
    mixed = lines[:50] + torn + lines[50:]
    source = scripted([b"".join(mixed)])
    assert np.array_equal(samples_of(source), TABLE)
    assert "left out 3 lines without a sample" in source.remarks


def test_long_run_of_lines_without_sample_is_refused_with_one_of_them():
    message = refusal([text_lines(TABLE) + b"boot: low voltage\r\n" * 60])
    assert "50 lines in a row hold no sample" in message
    assert "boot: low voltage" in message


def test_bytes_at_the_wrong_baud_rate_are_refused():
    garbage = bytes(np.random.default_rng(1).integers(128, 256, 20000, dtype=np.uint8))
    assert "baud" in refusal(pieces_of(garbage, 512))


def test_columns_that_are_no_imu_are_refused_with_what_was_found():
    data = text_lines(TABLE[:, :4], header="time,ax,ay,az")
    assert "no column for gx, gy, gz; columns found: time, ax, ay, az" in refusal([data])


def test_an_unknown_unit_is_refused_unless_another_is_stated():
    header = HEADER.replace("gx", "gx [gon/s]")
    assert "column gx [gon/s] states gon/s, which is no known unit" in refusal([text_lines(TABLE, header)])
    found = samples_of(scripted([text_lines(TABLE, header)], gyroscope_unit="rad/s"))
    assert np.array_equal(found, TABLE)


def test_raw_counts_need_their_scale():
    counts = TABLE.copy()
    counts[:, 1:4] *= 16384 / 9.80665
    assert "--accelerometer-scale" in refusal([text_lines(counts)])
    found = samples_of(
        scripted(
            [text_lines(counts)], accelerometer_scale=16384.0, accelerometer_unit="g", gyroscope_scale=1.0
        )
    )
    assert np.allclose(found, TABLE, rtol=0.0, atol=1e-12)


def test_units_are_those_of_the_column_names():
    shown = TABLE * np.array([1e6, *[1 / 9.80665] * 3, *[180 / np.pi] * 3])
    header = "time_us,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps"
    source = scripted([text_lines(shown, header=header)])
    assert np.allclose(samples_of(source), TABLE, rtol=0.0, atol=1e-12)
    assert not source.gyroscope_unit_is_assumed


def test_a_stated_unit_that_contradicts_the_readings_is_refused():
    message = refusal([text_lines(TABLE)], accelerometer_unit="g")
    assert "stated in g" in message
    assert "--accelerometer-unit m/s^2" in message


def test_degrees_taken_for_radians_are_refused_when_the_device_turns():
    turning = TABLE.copy()
    turning[60:, 6] += 57.3
    message = refusal(pieces_of(text_lines(turning), 512))
    assert "--gyroscope-unit (deg/s?)" in message
    found = samples_of(scripted([text_lines(turning)], gyroscope_unit="deg/s"))
    assert found[-1, 6] == pytest.approx(np.radians(turning[-1, 6]))


def test_axes_and_sign_are_turned_as_in_logs():
    shown = TABLE.copy()
    shown[:, 1:4] *= -1.0
    source = scripted([text_lines(shown)], accelerometer_sign=-1, axes="y,-x,z")
    found = samples_of(source)
    assert np.array_equal(found[:, 1:4], TABLE[:, 1:4] @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]).T)
    assert "sign of the accelerometer changed to read +g up" in source.remarks


def test_a_datagram_may_hold_several_lines_or_one():
    lines = text_lines(TABLE).splitlines(keepends=True)
    together = [b"".join(lines[first : first + 7]) for first in range(0, len(lines), 7)]
    assert np.array_equal(samples_of(scripted(lines, whole=True)), TABLE)
    assert np.array_equal(samples_of(scripted(together, whole=True)), TABLE)


def test_json_may_be_flat_nested_or_in_arrays():
    flat = [dict(zip(HEADER.split(","), row, strict=True)) for row in TABLE.tolist()]
    nested = [{"t": row[0], "imu": {"acc": row[1:4], "gyro": row[4:7]}} for row in TABLE.tolist()]
    spelt = [
        {
            "header": {"stamp": row[0], "frame_id": "imu"},
            "linear_acceleration": dict(zip("xyz", row[1:4], strict=True)),
            "angular_velocity": dict(zip("xyz", row[4:7], strict=True)),
        }
        for row in TABLE.tolist()
    ]
    for objects in (flat, nested, spelt):
        alone = [json.dumps(each).encode() for each in objects]
        assert np.array_equal(samples_of(scripted(alone, whole=True)), TABLE)
        array = [json.dumps(objects, indent=1).encode()]
        assert np.array_equal(samples_of(scripted(array, whole=True)), TABLE)
    over_serial = b"\n".join(json.dumps(each).encode() for each in flat) + b"\n"
    assert np.array_equal(samples_of(scripted(pieces_of(over_serial, 100))), TABLE)


def test_json_without_an_imu_is_refused():
    assert "no column for" in refusal([b'{"battery": 11.1}'] * 60, whole=True)
    assert "hold no sample" in refusal([b"{not json}"] * 60, whole=True)


def test_the_state_of_the_wheels_comes_with_the_samples():
    moving = np.where(np.arange(len(TABLE)) < 60, 0.0, 0.35)
    data = text_lines(np.column_stack([TABLE, moving]), header=f"{HEADER},wheel_speed")
    found = np.concatenate([chunk.moving for chunk in chunks_of(scripted([data]))])
    assert np.array_equal(found, (moving != 0.0).astype(float))
    unnamed = text_lines(np.column_stack([TABLE, moving]), header=f"{HEADER},drive")
    named = chunks_of(scripted([unnamed], columns={"moving": "drive"}))
    assert np.array_equal(np.concatenate([chunk.moving for chunk in named]), found)
    objects = [
        {**dict(zip(HEADER.split(","), row, strict=True)), "moving": state}
        for row, state in zip(TABLE.tolist(), [True, False, None] * 40, strict=True)
    ]
    said = chunks_of(scripted([json.dumps(objects).encode()], whole=True))
    assert np.array_equal(
        np.concatenate([chunk.moving for chunk in said]), [1.0, 0.0, np.nan] * 40, equal_nan=True
    )
    assert chunks_of(scripted([text_lines(TABLE)]))[0].moving is None


def test_samples_without_a_number_are_left_out_until_too_many():
    some = text_lines(TABLE[:60]) + b"0.6,,0,9.8,0,0,0\r\n" + text_lines(TABLE[61:], header=None)
    source = scripted([some])
    assert np.array_equal(samples_of(source), np.delete(TABLE, 60, axis=0))
    assert "left out 1 sample without a number" in source.remarks
    broken = TABLE.copy()
    broken[60:, 5] = np.nan
    assert "50 samples in a row are not numbers" in refusal([text_lines(broken)])


def test_an_object_that_gives_a_key_twice_is_no_sample():
    """Whichever of both values counted, it would be a guess."""
    text = b'{"t": 1.0, "ax": 0.1, "ay": 0.0, "az": 9.8, "gx": 0.0, "gy": 0.0, "gz": 0.0, "ax": 5.0}\n'
    (row,) = LabelReader(ReadOptions()).read([text])
    assert isinstance(row.row, str)
