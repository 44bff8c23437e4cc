"""Several sources read at once: all samples, one clock, loss and return, with and without asyncio."""

from __future__ import annotations

import asyncio
import socket
import threading

import numpy as np
import pytest

from live_fixtures import resting, serial_device, text_lines
from ports import free_port, free_ports
from repetitions import drawn_seed
from tumble.foundation import clock
from tumble.foundation.errors import LogError
from tumble.live import HEARTBEAT, LiveChunk, LiveSet, open_set, open_source
from tumble.live.multi_source import ABREAST

TABLE = resting(60)
pytestmark = pytest.mark.usefixtures("simulated_clock")


class Senders:
    """Devices that send datagrams, each to the port of its unit."""

    def __init__(self, names):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._ports = dict(zip(names, free_ports(len(names)), strict=True))

    @property
    def words(self):
        return [f"{name}=udp://127.0.0.1:{port}" for name, port in self._ports.items()]

    def send(self, name, lines):
        for line in lines:
            self._socket.sendto(line, ("127.0.0.1", self._ports[name]))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._socket.close()


def lines_of(table):
    """A datagram with the names of columns, then one a sample."""
    return text_lines(table).splitlines()


def gathered(units, wanted, patience=5.0):
    """Chunks by unit until each of these has so many samples, or so many s have passed."""
    chunks = {name: [] for name in wanted}
    ends = clock.now() + patience
    for name, chunk in units:
        if len(chunk):
            chunks[name].append(chunk)
        enough = all(sum(map(len, chunks[name])) >= count for name, count in wanted.items())
        if enough or clock.now() > ends:
            return chunks
    return chunks


def joined(chunks, column="time"):
    return np.concatenate([getattr(chunk, column) for chunk in chunks])


def test_every_sample_of_every_unit_comes_once_and_in_order():
    generator = np.random.default_rng(drawn_seed())
    names = ["a", "b", "c"]
    with Senders(names) as senders, open_set(senders.words) as units:
        left = {name: lines_of(TABLE) for name in names}
        found = {name: [] for name in names}
        chunks = iter(units)
        while any(left.values()):
            name = generator.choice([name for name in names if left[name]])
            some = int(generator.integers(1, 8))
            senders.send(name, left[name][:some])
            del left[name][:some]
            for _ in range(int(generator.integers(0, 4))):
                given, chunk = next(chunks)
                found[given].append(chunk)
        for name, rest in gathered(
            chunks, {name: len(TABLE) - sum(map(len, found[name])) for name in names}
        ).items():
            found[name] += rest
    for name in names:
        chunks = [chunk for chunk in found[name] if len(chunk)]
        assert np.array_equal(joined(chunks, "sensor_time"), TABLE[:, 0])
        assert np.array_equal(joined(chunks, "accelerometer"), TABLE[:, 1:4])


def test_one_thread_reads_all_that_have_a_descriptor():
    before = threading.active_count()
    with Senders(["a", "b"]) as senders, open_set(senders.words) as units:
        next(iter(units))
        assert threading.active_count() <= before


def test_sensors_with_own_clocks_are_put_on_that_of_this_computer():
    late = TABLE + np.eye(7)[0] * 1000.0
    with Senders(["a", "b"]) as senders, open_set(senders.words) as units:
        began = clock.now()
        for one, other in zip(lines_of(TABLE), lines_of(late), strict=True):
            senders.send("a", [one])
            senders.send("b", [other])
        found = gathered(units, {"a": len(TABLE), "b": len(TABLE)})
        ended = clock.now()
    assert np.array_equal(joined(found["b"], "sensor_time"), late[:, 0])
    for chunks in found.values():
        assert began <= chunks[0].arrival <= ended
        assert (np.diff(joined(chunks)) > 0.0).all()
    # Neither sent later than the other by more than the test took.
    assert np.abs(joined(found["a"]) - joined(found["b"])).max() <= ended - began


def test_each_silent_unit_gives_an_empty_chunk():
    with Senders(["a", "b"]) as senders, open_set(senders.words) as units:
        began = clock.now()
        heard = [next(iter(units)) for _ in range(8)]
        assert clock.now() - began >= 3 * HEARTBEAT
    assert {name for name, _ in heard} == {"a", "b"}
    assert not any(len(chunk) for _, chunk in heard)


def test_time_that_the_computer_was_busy_is_not_counted_as_silence():
    with Senders(["a", "b"]) as senders, open_set(senders.words) as units:
        iterated = iter(units)
        for _ in range(6):
            next(iterated)
        heard = units.listened
        assert heard > 2 * HEARTBEAT
        clock.sleep(10 * HEARTBEAT)
        next(iterated)
        assert units.listened - heard < 2 * HEARTBEAT


def test_logs_replayed_without_pace_come_in_the_order_of_their_times(tmp_path):
    tables = {"fast": resting(400, rate=400.0), "slow": resting(90, rate=100.0)}
    for name, table in tables.items():
        (tmp_path / f"{name}.csv").write_bytes(text_lines(table))
    words = [f"{name}=replay:{tmp_path / name}.csv?speed=max" for name in tables]
    with open_set(words) as units:
        found = [(name, chunk) for name, chunk in units if len(chunk)]
    ends = np.array([chunk.time[-1] for _, chunk in found])
    assert (np.maximum.accumulate(ends) - ends <= ABREAST).all()
    for name, table in tables.items():
        times = joined([chunk for given, chunk in found if given == name])
        assert np.array_equal(times, table[:, 0])


def test_logs_at_their_own_pace_end_the_set_when_all_have_ended(tmp_path):
    for name, count in (("long", 40), ("short", 25)):
        (tmp_path / f"{name}.csv").write_bytes(text_lines(TABLE[:count]))
    with open_set([f"{name}=replay:{tmp_path / name}.csv?speed=4" for name in ("long", "short")]) as units:
        counts = {"long": 0, "short": 0}
        for name, chunk in units:
            counts[name] += len(chunk)
    assert counts == {"long": 40, "short": 25}


def test_source_that_fails_to_open_is_reported_with_its_unit():
    with (
        pytest.raises(LogError, match=r"^wheel: serial:/dev/no_such_port: .*is it plugged in\?"),
        open_set(["wheel=serial:/dev/no_such_port", f"b=udp://127.0.0.1:{free_port()}"]),
    ):
        pass


def test_a_source_that_is_lost_ends_the_set_with_the_name_of_its_unit():
    with (
        serial_device() as device,
        Senders(["b"]) as senders,
        open_set([f"a=serial:{device.path}", *senders.words]) as units,
    ):
        device.write(text_lines(TABLE))
        gathered(units, {"a": 40})
        device.unplug()
        with pytest.raises(LogError, match=r"^a: serial:.*the connection was lost"):
            gathered(units, {"a": 1000})


def test_with_keep_going_others_go_on_and_a_lost_source_returns(tmp_path):
    line = tmp_path / "line"
    events = []
    with serial_device() as first, serial_device() as second, Senders(["b"]) as senders:
        line.symlink_to(first.path)
        words = [f"a=serial:{line}", *senders.words]
        with open_set(words, keep_going=True, on_event=events.append) as units:
            first.write(text_lines(TABLE))
            before = gathered(units, {"a": len(TABLE)})
            # Gone before its terminal is: the next one that anybody makes may get that one's name.
            line.unlink()
            first.unplug()
            senders.send("b", lines_of(TABLE))
            meanwhile = gathered(units, {"b": len(TABLE)})
            assert [(event.kind, event.name) for event in events] == [("lost", "a")]
            assert "the connection was lost" in events[0].reason
            line.symlink_to(second.path)
            while len(events) < 2:
                next(iter(units))
            second.write(text_lines(TABLE))
            after = gathered(units, {"a": len(TABLE)})
    assert [event.kind for event in events] == ["lost", "returned"]
    assert len(joined(meanwhile["b"])) == len(TABLE)
    # The board began its clock anew; time of the set goes on.
    assert np.array_equal(joined(after["a"], "sensor_time"), TABLE[:, 0])
    assert joined(after["a"])[0] > joined(before["a"])[-1]


class Board:
    """A source of another package: it can be iterated and nothing else."""

    name = "board"
    remarks = ("a board of the test",)
    gyroscope_unit_is_assumed = False

    def __init__(self, samples, error=None):
        self.open = 0
        self._samples, self._error = samples, error

    def __enter__(self):
        self.open += 1
        return self

    def __exit__(self, *error):
        self.open -= 1

    def __iter__(self):
        for time_ in self._samples:
            yield LiveChunk(np.array([time_]), np.array([[0.0, 0.0, 9.8]]), np.zeros((1, 3)))
        if self._error is not None:
            raise self._error


def test_a_source_that_can_only_be_iterated_is_read_by_a_thread():
    before = threading.active_count()
    board = Board([0.0, 0.1, 0.2])
    with LiveSet({"board": board}) as units:
        found = [chunk for _, chunk in units if len(chunk)]
        assert units.remarks["board"][0] == "a board of the test"
    assert joined(found, "sensor_time").tolist() == [0.0, 0.1, 0.2]
    assert board.open == 0
    assert threading.active_count() <= before


def test_error_of_a_source_is_raised_with_the_name_of_its_unit():
    with LiveSet({"left": Board([0.0], LogError("board: fell off"))}) as units:
        found = []
        with pytest.raises(LogError, match=r"^left: board: fell off$"):
            found += [len(chunk) for _, chunk in units]


def test_gaps_are_reported_for_their_unit():
    gappy = np.delete(TABLE, slice(40, 45), axis=0)
    with Senders(["a", "b"]) as senders, open_set(senders.words) as units:
        senders.send("a", lines_of(TABLE))
        senders.send("b", lines_of(gappy))
        gathered(units, {"a": len(TABLE), "b": len(gappy)})
        assert any("1 gap in time, 0.06 s at most" in remark for remark in units.remarks["b"])
        assert not any("gap" in remark for remark in units.remarks["a"])
        assert units.timing["b"].missing == 5


def test_a_set_is_iterated_beside_other_tasks_of_asyncio(simulated_clock):
    async def run():
        ticks = []

        async def tick():
            while True:
                ticks.append(clock.now())
                await asyncio.sleep(0.01)

        other = asyncio.create_task(tick())
        found = {"a": [], "b": []}
        with Senders(["a", "b"]) as senders, open_set(senders.words) as units:
            for name in found:
                senders.send(name, lines_of(TABLE))
            silent = 0
            async for name, chunk in units:
                found[name].append(chunk)
                silent += not len(chunk)
                if silent >= 4:
                    break
        other.cancel()
        return found, ticks

    found, ticks = simulated_clock.run(run())
    for chunks in found.values():
        assert np.array_equal(joined([each for each in chunks if len(each)], "sensor_time"), TABLE[:, 0])
    assert len(ticks) > 10
    assert np.diff(ticks) == pytest.approx(0.01)


def test_a_source_is_iterated_beside_other_tasks_of_asyncio(simulated_clock, tmp_path):
    (tmp_path / "log.csv").write_bytes(text_lines(TABLE))

    async def run(address):
        with open_source(address) as source:
            return [chunk async for chunk in source if len(chunk)]

    found = simulated_clock.run(run(f"replay:{tmp_path}/log.csv?speed=max"))
    assert np.array_equal(joined(found), TABLE[:, 0])
    port = free_port()

    async def first(address):
        with open_source(address) as source, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for line in lines_of(TABLE):
                sender.sendto(line, ("127.0.0.1", port))
            return await anext(chunk async for chunk in source if len(chunk))

    chunk = simulated_clock.run(first(f"udp://127.0.0.1:{port}"))
    assert np.array_equal(chunk.time, TABLE[: len(chunk), 0])
