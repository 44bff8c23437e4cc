"""A source holds to what it stated: one that returns is read as before, one that changes is refused."""

from __future__ import annotations

import json
import socket
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from live_fixtures import (
    HEADER,
    Scripted,
    ScriptIsOverError,
    chunks_of,
    resting,
    samples_of,
    scripted,
    text_lines,
)
from ports import free_port
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.errors import LogError
from tumble.live import LiveSet, open_set, parse_address
from tumble.live.source import SourceChangedError
from tumble.live.text import TextLine
from tumble.logs import ReadOptions

TABLE = resting(400)
STATED = "time,gx [deg/s],gy [deg/s],gz [deg/s],ax [g],ay [g],az [g]"
"""Names in another order and other units than those that are assumed."""
FIELDS = ("t_us", "gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g")


def shown(table):
    """Samples as a device shows them that states `STATED`."""
    return np.column_stack([table[:, 0], np.degrees(table[:, 4:]), table[:, 1:4] / STANDARD_GRAVITY])


def in_lines(table, names=True):
    return text_lines(shown(table), header=STATED if names else None).splitlines(keepends=True)


def in_objects(table, names=True):
    rows = shown(table) * np.array([1e6, *[1.0] * 6])
    return [json.dumps(dict(zip(FIELDS, row, strict=True))).encode() + b"\n" for row in rows.tolist()]


class Ending(Scripted):
    """Bytes of a device after which its line is at its end."""

    def receive(self):
        try:
            return super().receive()
        except ScriptIsOverError:
            raise EOFError from None


class Unplugged(Scripted):
    """Bytes of a device that is unplugged after them."""

    def receive(self):
        try:
            return super().receive()
        except ScriptIsOverError:
            raise LogError("the connection was lost") from None


def opened(*transports, unit=None, **options):
    """Makes the source of each of these transports in turn."""
    left, read = list(transports), ReadOptions(**options)

    def opening():
        transport = left.pop(0) if len(left) > 1 else left[0]
        address = parse_address("udp://test:1" if transport.whole else "serial:/dev/test")
        line = TextLine(address, read, transport, "test")
        return line.unit(parse_address(f"{address.text}:{unit}") if unit else address, read)

    return opening


def given_by(opening):
    """Time, force and rate of all samples of a set of one unit, what happened to it, and the set."""
    events, chunks = [], []
    with LiveSet({"a": opening}, keep_going=True, on_event=events.append) as units:
        chunks += [chunk for _, chunk in units if len(chunk)]
    rows = [np.column_stack([each.sensor_time, each.accelerometer, each.gyroscope]) for each in chunks]
    return np.concatenate(rows), events, units


@pytest.mark.usefixtures("simulated_clock")
@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("encoded", [in_lines, in_objects])
def test_a_device_that_restarts_is_read_in_the_units_it_stated(encoded, whole):
    before = encoded(TABLE[:200]) + encoded(TABLE[:60])
    pieces = before if whole else [b"".join(before[:90]), b"".join(before[90:])]
    after = encoded(TABLE[60:300], names=False)
    # A line that is joined midway costs its first row.
    after = after if whole else [b"0.1,", b"".join(after)]
    found, events, units = given_by(opened(Scripted(pieces, whole), Ending(after, whole)))
    assert [event.kind for event in events] == ["lost", "returned"]
    assert "time ran back" in events[0].reason
    expected = np.concatenate([TABLE[:200], TABLE[60:300] if whole else TABLE[61:300]])
    assert found.shape == expected.shape
    assert np.allclose(found, expected, rtol=0.0, atol=1e-9)
    assert any("came after a restart" in remark for remark in units.remarks["a"])


@pytest.mark.usefixtures("simulated_clock")
@pytest.mark.parametrize("lost", range(1, len(STATED), 7))
def test_a_device_that_was_unplugged_is_read_as_before(lost):
    torn = STATED.encode()[lost:] + b"\n"
    after = [torn, *in_lines(TABLE[100:200], names=False)]
    found, events, _ = given_by(opened(Unplugged(in_lines(TABLE[:100])), Ending(after)))
    assert [event.kind for event in events] == ["lost", "returned"]
    assert len(found) >= 199
    assert np.allclose(found, TABLE[np.searchsorted(TABLE[:, 0], found[:, 0] - 1e-9)], rtol=0.0, atol=1e-9)


@pytest.mark.usefixtures("simulated_clock")
@pytest.mark.parametrize("whole", [True, False])
def test_a_device_that_returns_under_other_names_is_refused(whole):
    found, (first, *others), units = given_by(
        opened(
            Unplugged(in_lines(TABLE[:100]), whole),
            Unplugged(text_lines(TABLE[100:]).splitlines(True), whole),
        )
    )
    assert np.allclose(found, TABLE[:100], rtol=0.0, atol=1e-9)
    assert (first.kind, first.is_final) == ("lost", False)
    assert [(event.kind, event.is_final) for event in others] == [("returned", False), ("lost", True)]
    assert STATED in others[-1].reason
    assert HEADER in others[-1].reason
    (loss,) = units.losses
    assert loss.is_heavy
    assert str(loss) == others[-1].reason


@pytest.mark.usefixtures("simulated_clock")
def test_a_device_that_returns_in_another_unit_is_refused():
    # Assumed to be in m/s^2, by its values; then it sends g, without a word.
    after = TABLE[100:] * np.array([1.0, *[1.0 / STANDARD_GRAVITY] * 3, *[1.0] * 3])
    transports = [
        Unplugged(text_lines(table, header=header).splitlines(keepends=True), True)
        for table, header in ((TABLE[:100], HEADER), (after, None))
    ]
    events, found = [], []
    with LiveSet({"a": opened(*transports)}, keep_going=True, on_event=events.append) as units:
        for _, chunk in units:
            found.append(chunk)
            if len(events) == 3:
                break
    assert sum(map(len, found)) == 100
    assert [event.kind for event in events] == ["lost", "returned", "lost"]
    assert "accelerometer is stated in m/s^2 (it was read so before)" in events[-1].reason


@pytest.mark.usefixtures("simulated_clock")
def test_units_told_apart_by_a_column_stay_so_when_they_return():
    other = resting(400, seed=3)
    both = [
        f"{name},{','.join(map(repr, row))}\n".encode()
        for pair in zip(TABLE.tolist(), other.tolist(), strict=True)
        for name, row in zip("12", pair, strict=True)
    ]
    names = f"unit,{HEADER}\n".encode()
    found, _, _ = given_by(opened(Unplugged([names, *both[:300]], True), Ending(both[300:], True), unit="1"))
    assert np.array_equal(found, TABLE)


@pytest.mark.usefixtures("simulated_clock")
def test_datagrams_of_a_device_that_restarts_keep_their_units():
    port = free_port()
    with (
        open_set([f"a=udp://127.0.0.1:{port}"], keep_going=True) as units,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device,
    ):
        events, rates, forces, left = [], [], [], in_lines(TABLE[:200]) + in_lines(TABLE)
        units.on_event = events.append
        for _, chunk in units:
            rates.append(chunk.gyroscope)
            forces.append(chunk.accelerometer)
            some, left = left[:5], left[5:]
            for line in some if left else []:
                device.sendto(line, ("127.0.0.1", port))
            if not left:
                break
    assert [event.kind for event in events] == ["lost", "returned"]
    rate, force = np.concatenate(rates), np.concatenate(forces)
    assert len(rate) > 250
    assert np.abs(rate).max() < 0.1
    assert np.allclose(force, [0.0, 0.0, STANDARD_GRAVITY], rtol=0.0, atol=0.1)


OTHERS = {
    "order": "time,gx,gy,gz,ax,ay,az",
    "unit": "time,ax,ay,az,gx [deg/s],gy [deg/s],gz [deg/s]",
    "unit of time": "time [ms],ax,ay,az,gx,gy,gz",
    "axis": "time,ay,ax,az,gx,gy,gz",
    "one more": f"{HEADER},temperature",
    "one less": HEADER.removeprefix("time,"),
    "no IMU": "time,ax,ay,az,mx,my,mz",
}


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("names", OTHERS.values(), ids=OTHERS)
def test_other_names_end_a_source_in_a_line_that_names_both(names, whole):
    lines = text_lines(TABLE[:200]).splitlines(keepends=True)
    lines += text_lines(TABLE[200:], header=names).splitlines(keepends=True)
    chunks = []
    source = scripted(lines if whole else [b"".join(lines)], whole)
    with pytest.raises(SourceChangedError) as caught, source:
        chunks.extend(chunk for chunk in source if len(chunk))
    assert np.array_equal(np.concatenate([chunk.time for chunk in chunks]), TABLE[:200, 0])
    message = str(caught.value)
    assert f"named '{HEADER}' so far, and are now named '{names}'" in message
    assert "start again" in message
    assert "\n" not in message


@given(place=st.integers(0, len(STATED) - 1), letter=st.integers(0, 255))
def test_names_with_a_corrupted_letter_never_give_wrong_samples(place, letter):
    again = bytearray(STATED.encode())
    again[place] = letter
    lines = [*in_lines(TABLE[:50]), bytes(again) + b"\n", *in_lines(TABLE[50:100], names=False)]
    chunks, source = [], scripted([b"".join(lines)])
    with suppress(SourceChangedError, ScriptIsOverError), source:
        chunks.extend(chunk for chunk in source if len(chunk))
    found = np.concatenate([np.column_stack([c.time, c.accelerometer, c.gyroscope]) for c in chunks])
    assert len(found) in (50, 100)
    assert np.allclose(found, TABLE[: len(found)], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "corrupted"),
    [("time", "tim~"), ("gx [deg/s]", "gx [deg/s}"), ("gz [deg/s]", "gz [deg/t]"), ("ay [g]", "ay~[g]")],
)
def test_names_corrupted_on_the_way_are_a_line_without_sample(name, corrupted):
    names = STATED.replace(name, corrupted).encode() + b"\n"
    lines = [*in_lines(TABLE[:50]), names, *in_lines(TABLE[50:100], names=False)]
    source = scripted([b"".join(lines)])
    assert np.allclose(samples_of(source), TABLE[:100], rtol=0.0, atol=1e-9)
    assert "left out 1 line without a sample" in source.remarks


def test_names_after_rows_without_them_may_state_what_was_assumed():
    unnamed = text_lines(TABLE[:200], header=None).splitlines(keepends=True)
    said = text_lines(TABLE[200:], header="t [s],ax [m/s^2],ay,az,gx [rad/s],gy,gz").splitlines(keepends=True)
    assert np.array_equal(samples_of(scripted(unnamed + said, True)), TABLE)


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (
            HEADER.replace("gx", "gx [deg/s]"),
            "the gyroscope was read in rad/s so far, and is now stated in deg/s",
        ),
        (
            HEADER.replace("ax", "ax [g]"),
            "the accelerometer was read in m/s^2 so far, and is now stated in g",
        ),
        (HEADER.replace("time", "time [ms]"), "the time was read in s so far, and is now stated in ms"),
        (OTHERS["order"], f"columns were read as, without names, '{HEADER}' so far, and are now named"),
    ],
)
def test_names_that_contradict_what_was_assumed_end_a_source(names, says):
    lines = text_lines(TABLE[:200], header=None) + text_lines(TABLE[200:], header=names)
    found, source = [], scripted(lines.splitlines(keepends=True), True)
    with pytest.raises(SourceChangedError) as caught, source:
        found.extend(chunk for chunk in source if len(chunk))
    assert says in str(caught.value)
    assert sum(map(len, found)) == 200


@pytest.mark.parametrize("whole", [True, False])
def test_objects_with_other_fields_end_a_source(whole):
    plain = [
        json.dumps(dict(zip(HEADER.split(","), row, strict=True))).encode() + b"\n" for row in TABLE.tolist()
    ]
    for other in (in_objects(TABLE), [line.replace(b'"gx"', b'"gx_dps"') for line in plain]):
        found, source = [], scripted(plain[:200] + other[200:], whole)
        with (
            pytest.raises(SourceChangedError, match="columns were named 'time,ax,ay,az,gx,gy,gz' so far"),
            source,
        ):
            found.extend(chunk for chunk in source if len(chunk))
        assert sum(map(len, found)) == 200


def test_objects_may_lack_what_is_no_part_of_a_sample():
    objects = [
        {**dict(zip(HEADER.split(","), row, strict=True)), **({"temperature": 20.0} if k % 3 == 0 else {})}
        for k, row in enumerate(TABLE.tolist())
    ]
    objects[7] = {"battery": 11.1}
    source = scripted([json.dumps(each).encode() for each in objects], True)
    assert np.array_equal(samples_of(source), np.delete(TABLE, 7, axis=0))


def test_rows_of_text_are_not_read_by_the_order_of_json_fields():
    order = ("time", "gx", "gy", "gz", "ax", "ay", "az")
    objects = [
        json.dumps(dict(zip(order, row, strict=True))).encode()
        for row in TABLE[:, [0, 4, 5, 6, 1, 2, 3]].tolist()
    ]
    rows = text_lines(TABLE[200:230], header=None).splitlines()
    assert np.array_equal(samples_of(scripted(objects[:200] + rows, True)), TABLE[:200])


def test_samples_before_a_restart_are_kept_and_those_behind_counted():
    source = scripted([b"".join(in_lines(TABLE) + in_lines(TABLE[:100]))])
    found = []
    with pytest.raises(LogError, match="time ran back"), source:
        found.extend(chunk for chunk in source if len(chunk))
    assert np.array_equal(np.concatenate([chunk.time for chunk in found]), TABLE[:, 0])
    left_out = [int(r.split()[2]) for r in source.remarks if r.startswith("left out")]
    assert sum(left_out) == 100


def test_the_same_names_again_are_no_line_without_a_sample():
    source = scripted([b"".join(in_lines(TABLE[:200]) + in_lines(TABLE[200:]))])
    assert sum(map(len, chunks_of(source))) == 400
    assert not any("without a sample" in remark for remark in source.remarks)
