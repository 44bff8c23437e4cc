"""Sensors of Linux IIO, in a folder that imitates what the kernel shows of them."""

from __future__ import annotations

import errno
import shutil
import subprocess
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iio_fixtures import ImitatedDevice, axes, scans, stored
from live_fixtures import first_samples
from tumble.foundation.errors import LogError
from tumble.live import open_source
from tumble.live.iio_scan import Scan, parse_element

COUNT = 60
TRIADS = {"in_accel_scale": "0.000598", "in_anglvel_scale": "0.000153"}
IMU = {
    **axes("in_accel", "le:s16/16>>0", 0),
    **axes("in_anglvel", "le:s16/16>>0", 3),
    "in_timestamp": ("le:s64/64>>0", 6),
}


def readings(seed=0, count=COUNT):
    """Whole readings of an IMU at rest, (n, 6), and times, ns."""
    generator = np.random.default_rng(seed)
    table = generator.integers(-40, 40, (count, 6))
    table[:, 2] += 16_400
    return table, 5_000_000_000 + 10_000_000 * np.arange(count)


def imu_scans(table, stamps, kind="le:s16/16>>0", size=2):
    columns = [(table[:, place], kind, place * size) for place in range(6)]
    offset = -(-6 * size // 8) * 8
    return scans([*columns, (stamps, "le:s64/64>>0", offset)], offset + 8)


def si(table, stamps):
    """Samples in SI units that a reader makes of them."""
    return np.column_stack([stamps / 1e9, 0.000598 * table[:, :3], 0.000153 * table[:, 3:]])


def read(device, source, data, count=COUNT):
    with source:
        device.send(data)
        return first_samples(source, count)


@pytest.fixture
def root(tmp_path):
    return tmp_path


def imitated(root, number=0, name="lsm6dsm", channels=None, attributes=(), **how):
    return closing(ImitatedDevice(root, number, name, channels or IMU, {**TRIADS, **dict(attributes)}, **how))


@pytest.mark.parametrize("merged", [False, True], ids=["scan_elements", "buffer0"])
@pytest.mark.parametrize("place", ["device0", "lsm6dsm"])
def test_an_imu_is_read_by_its_place_and_by_its_name(root, merged, place):
    table, stamps = readings()
    with imitated(root, merged=merged) as device:
        source = open_source(f"iio:{place}?root={root}")
        found = read(device, source, imu_scans(table, stamps))
    assert np.allclose(found, si(table, stamps), rtol=1e-12)
    assert source.name == "lsm6dsm"
    assert not source.gyroscope_unit_is_assumed


@pytest.mark.parametrize("kind", ["be:s16/16>>0", "le:s12/16>>4", "be:s20/32>>8", "le:s24/32>>0"])
def test_readings_are_shifted_and_their_bytes_put_in_order(root, kind):
    table, stamps = readings()
    table[:, 2] //= 16 if "12" in kind else 1
    size = 4 if "/32" in kind else 2
    channels = {
        **axes("in_accel", kind, 0),
        **axes("in_anglvel", kind, 3),
        "in_timestamp": ("le:s64/64>>0", 6),
    }
    scale = {"in_accel_scale": "0.000598" if "12" not in kind else "0.009568"}
    with imitated(root, channels=channels, attributes=scale) as device:
        found = read(device, open_source(f"iio:device0?root={root}"), imu_scans(table, stamps, kind, size))
    wanted = si(table, stamps)
    wanted[:, 1:4] *= float(scale["in_accel_scale"]) / 0.000598
    assert np.allclose(found, wanted, rtol=1e-9)


@settings(max_examples=200)
@given(
    order=st.sampled_from(["be", "le"]),
    sign=st.sampled_from("su"),
    storage=st.sampled_from([8, 16, 32, 64]),
    data=st.data(),
)
def test_any_number_is_read_as_it_was_stored(order, sign, storage, data):
    bits = data.draw(st.integers(1, min(storage, 53)))
    shift = data.draw(st.integers(0, storage - bits))
    least, most = (-(1 << (bits - 1)), (1 << (bits - 1)) - 1) if sign == "s" else (0, (1 << bits) - 1)
    values = data.draw(st.lists(st.integers(least, most), min_size=1, max_size=5))
    kind = f"{order}:{sign}{bits}/{storage}>>{shift}"
    scan = Scan([parse_element("in_accel_x", "0", kind)])
    assert scan.numbers(stored(values, kind).tobytes())["in_accel_x"].tolist() == values


@pytest.mark.parametrize("kind", ["", "s16/16", "le:s16/12>>0", "le:s17/16>>0", "le:s16/16>>1", "le:f32/32"])
def test_a_type_that_is_none_is_refused(root, kind):
    assert parse_element("in_accel_x", "0", kind) is None
    with (
        imitated(root, channels={**IMU, "in_accel_x": (kind, 0)}),
        pytest.raises(LogError, match="not known here"),
    ):
        open_source(f"iio:device0?root={root}")


def test_channels_are_aligned_to_their_size_and_scans_to_the_largest():
    small, large = parse_element("a", "0", "le:s16/16"), parse_element("t", "3", "le:s64/64")
    assert Scan([small, large]).bytes == 16
    assert Scan([small, parse_element("b", "1", "le:u8/8")]).bytes == 4
    assert Scan([large, parse_element("q", "1", "le:s16/16X4")]).bytes == 16


def test_offset_and_scale_of_an_axis_go_before_those_of_all(root):
    table, stamps = readings()
    attributes = {"in_accel_x_scale": "0.001", "in_accel_offset": "100", "in_anglvel_z_offset": "-7"}
    with imitated(root, attributes=attributes) as device:
        found = read(device, open_source(f"iio:device0?root={root}"), imu_scans(table, stamps))
    assert np.allclose(found[:, 1], 0.001 * (table[:, 0] + 100))
    assert np.allclose(found[:, 3], 0.000598 * (table[:, 2] + 100))
    assert np.allclose(found[:, 6], 0.000153 * (table[:, 5] - 7))


def test_rotation_by_the_mount_matrix_is_applied_and_reported(root):
    table, stamps = readings()
    attributes = {
        "in_mount_matrix": "0, 1, 0; -1, 0, 0; 0, 0, 1",
        "in_anglvel_mount_matrix": "1, 0, 0; 0, 1, 0; 0, 0, 1",
    }
    with imitated(root, attributes=attributes) as device:
        source = open_source(f"iio:device0?root={root}")
        found = read(device, source, imu_scans(table, stamps))
    plain = si(table, stamps)
    assert np.allclose(found[:, 1:4], np.column_stack([plain[:, 2], -plain[:, 1], plain[:, 3]]))
    assert np.allclose(found[:, 4:], plain[:, 4:])
    assert "axes of the accelerometer are turned by the mount matrix of the device" in source.remarks


def test_all_that_was_changed_is_put_back(root):
    channels = {**IMU, **axes("in_gravity", "le:s16/16>>0", 7)}
    attributes = {"trigger/current_trigger": "", "sampling_frequency": "50"}
    with imitated(root, channels=channels, attributes=attributes) as device:
        (root / "sys/bus/iio/devices/trigger0").mkdir()
        (root / "sys/bus/iio/devices/trigger0/name").write_text("lsm6dsm-dev0\n")
        device.write("scan_elements/in_gravity_x_en", "1")
        before = device.state()
        with open_source(f"iio:device0?root={root}&rate=200"):
            during = device.state()
        assert device.state() == before
    assert during["buffer/enable"] == "1"
    assert during["sampling_frequency"] == "200"
    assert during["current_timestamp_clock"] == "monotonic"
    assert during["trigger/current_trigger"] == "lsm6dsm-dev0"
    assert during["scan_elements/in_gravity_x_en"] == "0"
    assert int(during["buffer/length"]) > 100


def test_failed_opening_restores_changed_attributes(root):
    with imitated(root) as device:
        before = device.state()
        device.node.unlink()
        with pytest.raises(LogError, match="dev/iio:device0 cannot be used: No such file"):
            open_source(f"iio:device0?root={root}").__enter__()
        assert device.state() == before


def test_accelerometer_and_gyroscope_may_be_two_devices(root):
    time = ("le:s64/64>>0", 3)
    wave = np.round(1000 * np.sin(0.1 * np.arange(80)))
    with (
        imitated(root, 0, "accel_3d", {**axes("in_accel", "le:s32/32>>0", 0), "in_timestamp": time}) as first,
        imitated(
            root, 1, "gyro_3d", {**axes("in_anglvel", "le:s32/32>>0", 0), "in_timestamp": time}
        ) as second,
        open_source(f"iio:accel_3d+gyro_3d?root={root}") as source,
    ):
        stamps = 1_000_000_000 + 10_000_000 * np.arange(80)
        columns = [(wave, "le:s32/32>>0", 0), (wave, "le:s32/32>>0", 4), (wave + 16_400, "le:s32/32>>0", 8)]
        later = stamps + 3_000_000
        turned = [(wave // 8, "le:s32/32>>0", 4 * axis) for axis in range(3)]
        for begin in range(0, 80, 10):
            part = slice(begin, begin + 10)
            first.send(scans([*((v[part], k, o) for v, k, o in columns), (stamps[part], time[0], 16)], 24))
            second.send(scans([*((v[part], k, o) for v, k, o in turned), (later[part], time[0], 16)], 24))
        found = first_samples(source, 79, silence=3)
        assert any("are two devices" in remark for remark in source.remarks)
    assert source.name == "accel_3d+gyro_3d"
    # The last one has no reading of the accelerometer after it.
    assert np.allclose(found[:, 0], later[:-1] / 1e9)
    assert np.allclose(found[:, 4], 0.000153 * (wave // 8)[:-1])
    assert np.allclose(found[:, 1], 0.000598 * np.interp(later, stamps, wave)[:-1])


def fields_of(source, count):
    """Readings of the magnetometer beside so many samples, (n, 3) uT."""
    chunks = []
    for chunk in source:
        chunks += [chunk] if len(chunk) else []
        if sum(map(len, chunks)) >= count:
            break
    return None if chunks[0].field is None else np.concatenate([chunk.field for chunk in chunks])


def test_magnetometer_of_an_imu_comes_with_each_sample(root):
    table, stamps = readings()
    kind = "le:s16/16>>0"
    channels = {**IMU, **axes("in_magn", kind, 6), "in_timestamp": ("le:s64/64>>0", 9)}
    counts = np.arange(3 * COUNT).reshape(COUNT, 3) + 1
    both = np.hstack([table, counts])
    columns = [(both[:, place], kind, 2 * place) for place in range(9)]
    data = scans([*columns, (stamps, "le:s64/64>>0", 24)], 32)
    with imitated(root, channels=channels, attributes={"in_magn_scale": "0.0015"}) as device:
        with open_source(f"iio:device0?root={root}") as source:
            device.send(data)
            # IIO has gauss, of which one is 100 uT.
            assert fields_of(source, COUNT) == pytest.approx(0.15 * counts)
        with open_source(f"iio:device0?root={root}&magnetometer=none") as source:
            device.send(imu_scans(table, stamps))
            assert fields_of(source, COUNT) is None


def test_magnetometer_of_its_own_comes_beside_the_next_sample(root):
    table, stamps = readings()
    kind, time = "le:s16/16>>0", ("le:s64/64>>0", 3)
    own = {**axes("in_magn", kind, 0), "in_timestamp": time}
    counts = np.arange(COUNT // 4)[:, np.newaxis] * [1, 2, 3] + 7
    taken = stamps[::4] - 2_000_000
    data = scans([*((counts[:, axis], kind, 2 * axis) for axis in range(3)), (taken, time[0], 8)], 16)
    with (
        imitated(root, attributes={"sampling_frequency": "50"}) as device,
        imitated(root, 1, "ak8963", own, {"in_magn_scale": "0.0015"}) as beside,
        open_source(f"iio:lsm6dsm+ak8963?root={root}&rate=200") as source,
    ):
        beside.send(data)
        device.send(imu_scans(table, stamps))
        found = fields_of(source, COUNT)
        assert any("magnetometer are put beside" in remark for remark in source.remarks)
    assert found[::4] == pytest.approx(0.15 * counts)
    assert np.isnan(np.delete(found, np.s_[::4], axis=0)).all()


def refusal(text):
    with pytest.raises(LogError) as caught:
        open_source(text).__enter__()
    message = str(caught.value)
    assert message.startswith(text)
    assert "\n" not in message
    return message


def test_an_unknown_device_is_refused_with_those_there_are(root):
    assert "no IIO device in" in refusal(f"iio:device0?root={root}")
    with imitated(root):
        assert "no IIO device 'bmi160'; found: device0 (lsm6dsm)" in refusal(f"iio:bmi160?root={root}")
        assert "no setting 'baud' for iio" in refusal(f"iio:device0?root={root}&baud=1")


def test_a_name_that_two_devices_bear_is_refused(root):
    with imitated(root, 0), imitated(root, 1):
        assert "device0, device1 are all named 'lsm6dsm'" in refusal(f"iio:lsm6dsm?root={root}")


def test_a_device_with_one_triad_is_refused_with_what_to_type(root):
    channels = {**axes("in_accel", "le:s16/16>>0", 0), "in_timestamp": ("le:s64/64>>0", 3)}
    with imitated(root, channels=channels):
        message = refusal(f"iio:device0?root={root}")
    assert "has no gyroscope (in_anglvel_x, _y, _z); name two devices" in message


def test_a_device_without_a_buffer_is_refused(root):
    with imitated(root) as device:
        (device.folder / "buffer/enable").unlink()
        assert "its driver has no buffer" in refusal(f"iio:device0?root={root}")


def test_device_in_use_by_another_program_is_refused_and_left_alone(root):
    with imitated(root) as device:
        device.write("buffer/enable", "1")
        before = device.state()
        assert "another program captures from it" in refusal(f"iio:device0?root={root}")
        assert device.state() == before


def test_a_device_without_a_trigger_is_refused_with_those_there_are(root):
    with imitated(root, attributes={"trigger/current_trigger": ""}):
        (root / "sys/bus/iio/devices/trigger3").mkdir()
        (root / "sys/bus/iio/devices/trigger3/name").write_text("timer\n")
        assert "give one, as ?trigger=NAME (found: timer)" in refusal(f"iio:device0?root={root}")
        assert "no trigger 'clock'; found: timer" in refusal(f"iio:device0?root={root}&trigger=clock")
        with open_source(f"iio:device0?root={root}&trigger=timer"):
            pass


def test_missing_permission_is_reported_with_a_remedy(root, monkeypatch):
    written = Path.write_text

    def forbid(path, text):
        if path.name == "length":
            raise PermissionError(errno.EACCES, "Permission denied")
        return written(path, text)

    with imitated(root) as device:
        before = device.state()
        monkeypatch.setattr(Path, "write_text", forbid)
        message = refusal(f"iio:device0?root={root}")
        monkeypatch.undo()
        assert device.state() == before
    assert "no permission to use" in message
    assert "buffer/length; run this as root, or give your group the right by a rule of udev" in message


def test_a_matrix_that_is_none_is_refused(root):
    with imitated(root, attributes={"in_mount_matrix": "1, 0; 0, 1"}):
        assert "no 3 by 3 matrix" in refusal(f"iio:device0?root={root}")


@pytest.fixture
def dummy():
    """A device of the kernel's own module for tests, where there is one and it may be made."""
    if modprobe := shutil.which("modprobe"):
        subprocess.run([modprobe, "iio_dummy"], capture_output=True, check=False)
    place = Path("/sys/kernel/config/iio/devices/dummy")
    if not place.is_dir():
        pytest.skip(f"{place} is not there: this kernel has no module iio_dummy, or configfs is not mounted")
    device = place / "tumble-test"
    try:
        device.mkdir()
    except PermissionError:
        pytest.skip(f"{device} cannot be made: only root may")
    yield device.name
    device.rmdir()


def test_kernel_device_without_imu_is_listed_and_refused_in_one_line(dummy):
    with pytest.raises(LogError) as refused, open_source("iio:no-such-device"):
        pass
    assert dummy in str(refused.value)
    with pytest.raises(LogError) as refused, open_source(f"iio:{dummy}"):
        pass
    assert dummy in str(refused.value)
    assert "\n" not in str(refused.value)
