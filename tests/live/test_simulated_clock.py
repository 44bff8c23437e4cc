"""The clock of the tests: turns in order, time that passes only while all wait, a busy computer drawn."""

from __future__ import annotations

import os
import pty
import signal
import socket
import threading
import tty

import pytest

from simulated_clock import SimulatedClock, SimulationError
from tumble.foundation import clock


def narrated(late=0.0, seed=0):
    """Moments at which three threads did something: a sender, a receiver, and one that waits for an event."""
    told = []

    def tell(name):
        told.append((name, clock.now()))

    with (
        SimulatedClock(seed, late),
        socket.socket(type=socket.SOCK_DGRAM) as here,
        socket.socket(type=socket.SOCK_DGRAM) as there,
    ):
        here.bind(("127.0.0.1", 0))
        event = threading.Event()

        def send():
            for _ in range(5):
                clock.sleep(1.0)
                tell("sends")
                there.sendto(b".", here.getsockname())
            event.set()

        def receive():
            for _ in range(5):
                while not clock.readable(here.fileno(), 0.3):
                    tell("waits on")
                here.recv(1)
                tell("receives")

        threads = [clock.thread(work, name=work.__name__) for work in (receive, send)]
        for thread in threads:
            thread.start()
        assert clock.wait(event)
        tell("is set")
        assert all(clock.wait(thread) for thread in threads)
    return told


def test_threads_take_turns_and_time_passes_only_while_all_wait():
    told = narrated()
    began = told[0][1] - 0.3
    assert [name for name, _ in told[:6]] == [
        "waits on",
        "waits on",
        "waits on",
        "sends",
        "receives",
        "waits on",
    ]
    assert {round(at - began, 9) for name, at in told if name in ("sends", "receives")} == {
        1.0,
        2.0,
        3.0,
        4.0,
        5.0,
    }
    assert told[-1][1] == told[-2][1] == began + 5.0


@pytest.mark.parametrize("late", [0.0, 0.01, 1.0])
def test_what_happens_is_the_same_each_run(late):
    assert narrated(late, seed=1) == narrated(late, seed=1)


def test_busy_computers_differ_by_their_seed_and_wake_late():
    quiet, one, other = narrated(), narrated(0.1, seed=1), narrated(0.1, seed=2)
    assert one != other
    ended = [told[-1][1] for told in (quiet, one, other)]
    assert ended[0] < min(ended[1:])


def test_those_who_wait_for_what_never_comes_are_named():
    def wait_for_one_another():
        with SimulatedClock():
            stuck = clock.thread(lambda: clock.wait(threading.Event()), name="stuck")
            stuck.start()
            clock.wait(stuck)

    with pytest.raises(
        SimulationError, match=r"never comes:(.*\n)*.*the end of stuck\n.*stuck waits for an event"
    ):
        wait_for_one_another()


def test_a_thread_that_outlives_the_simulation_is_named_and_ends():
    ends = []

    def sleep_on():
        try:
            clock.sleep(1e3)
        finally:
            ends.append(clock.now())

    def leave_too_early():
        with SimulatedClock():
            clock.thread(sleep_on, name="sleeper").start()
            clock.sleep(1.0)

    with pytest.raises(SimulationError, match="not ended: sleeper"):
        leave_too_early()
    assert len(ends) == 1


def test_an_error_of_the_test_is_raised_though_threads_sleep():
    def fail():
        with SimulatedClock():
            clock.thread(clock.sleep, 1e3).start()
            clock.sleep(1.0)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()


@pytest.mark.parametrize("late", [0.0, 0.05])
def test_work_is_done_in_order_while_others_go_on(late):
    done = []
    with SimulatedClock(3, late, work=0.2):
        worker = clock.executor()
        first, second, third = (worker.submit(done.append, number) for number in range(3))
        assert not first.done()
        assert not clock.wait(second, 0.1)
        third.cancel()
        assert clock.wait(second, 10.0)
        assert first.done()
        worker.submit(clock.sleep, 5.0)
        began = clock.now()
        worker.shutdown()
        assert clock.now() >= began + 5.0
    assert done == [0, 1]


def test_an_error_of_work_is_that_of_its_future():
    with SimulatedClock():
        worker = clock.executor()
        failing = worker.submit(lambda: 1 / 0)
        clock.wait(failing)
        with pytest.raises(ZeroDivisionError):
            failing.result()
        worker.shutdown()


def test_a_signal_is_received_where_the_main_thread_waits():
    came = []
    before = signal.signal(signal.SIGTERM, lambda number, _: came.append((number, clock.now())))
    try:
        with SimulatedClock() as simulated:
            began = clock.now()

            def send():
                clock.sleep(2.0)
                simulated.interrupt(signal.SIGTERM)
                clock.sleep(1.0)
                simulated.interrupt(signal.SIGINT)

            sender = clock.thread(send)
            sender.start()
            with pytest.raises(KeyboardInterrupt):
                clock.sleep(10.0)
            assert clock.now() == began + 3.0
            clock.wait(sender)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert came == [(signal.SIGTERM, began + 2.0)]


def test_coroutines_sleep_and_read_by_the_clock_too():
    import asyncio

    async def read(line):
        come = asyncio.Event()
        asyncio.get_running_loop().add_reader(line, come.set)
        ticks = asyncio.ensure_future(asyncio.sleep(30.0))
        await come.wait()
        asyncio.get_running_loop().remove_reader(line)
        at = clock.now()
        await ticks
        return at

    with SimulatedClock() as simulated:
        here, there = socket.socketpair()
        with here, there:
            began = clock.now()

            def send():
                clock.sleep(7.0)
                there.send(b".")

            sender = clock.thread(send)
            sender.start()
            assert simulated.run(read(here.fileno())) == began + 7.0
            assert clock.now() == pytest.approx(began + 30.0, abs=1e-6)
            clock.wait(sender)


def test_a_library_that_waits_for_a_serial_line_waits_by_the_clock():
    import serial

    device, line = pty.openpty()
    tty.setraw(line)
    with SimulatedClock(), serial.Serial(os.ttyname(line), timeout=60.0) as port:
        began = clock.now()
        assert port.read(1) == b""
        assert clock.now() == pytest.approx(began + 60.0)
        sender = clock.thread(lambda: (clock.sleep(5.0), os.write(device, b"ab")))
        sender.start()
        assert port.read(2) == b"ab"
        assert clock.now() == pytest.approx(began + 65.0)
        clock.wait(sender)
    os.close(device)
    os.close(line)
