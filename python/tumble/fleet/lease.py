"""A results folder that one driver works on at a time, also where the store knows no locks."""

from __future__ import annotations

import os
import re
import secrets
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from tumble.fleet.places import FileStore
from tumble.foundation import clock
from tumble.foundation.errors import TumbleError
from tumble.foundation.files import FileKind, hold_folder, prepare_folder
from tumble.foundation.stores import StoreError
from tumble.foundation.words import plain

LEASE_FILE = "driver"
RENEWED_EVERY = 2.0
"""s between two times that a driver renews its lease."""
GONE_AFTER = 10.0
"""s without a renewal after which a driver is gone. Clocks of two machines are never compared."""
_LONGEST_NAME = 200
KIND = FileKind("a lease of tumble fleet", re.compile(rb"\A[0-9a-f]{16} \d+ "))


class OtherDriverError(TumbleError):
    """Another driver works on the same results."""


@contextmanager
def driver_lease(results: FileStore) -> Iterator[DriverLease]:
    """Keeps other drivers from the results while the block runs.

    A folder is locked by the kernel, and free again once the process has ended. Elsewhere a file is renewed
    while its driver lives. Two drivers that begin at the same moment both go on until the next renewal; their
    results are one.

    Raises `OtherDriverError`, or `OutputError` for a folder, where another driver works there.
    """
    lease = DriverLease(results)
    if results.is_local:
        release = hold_folder(prepare_folder(results.root))
        try:
            yield lease
        finally:
            release()
        return
    lease.take()
    try:
        yield lease
    finally:
        lease.release()


class DriverLease:
    """Lease of one driver."""

    def __init__(self, results: FileStore) -> None:
        self._results = results
        self._name = f"{socket.gethostname()} process {os.getpid()}"
        self._renewals = 0
        self._token = secrets.token_hex(8)
        self._ended = threading.Event()
        self._other = ""
        self._thread = clock.thread(self._renew)

    def take(self) -> None:
        """Takes the lease once nobody renews it any more, and renews it from then on."""
        found = self._results.read(LEASE_FILE)
        until = clock.now() + GONE_AFTER
        while found is not None and clock.now() < until:
            clock.sleep(RENEWED_EVERY / 2)
            later = self._results.read(LEASE_FILE)
            if later is not None and later != found:
                self._other = _owner(later)
                self.check()
            found = later
        self._write()
        self._thread.start()

    def check(self) -> None:
        """Raises `OtherDriverError` where another driver has taken over."""
        if self._other:
            raise OtherDriverError(
                f"{self._results}: another driver ({self._other}) works on these results; wait for it to "
                "end, or end it with tumble fleet cancel"
            )

    def release(self) -> None:
        """Ends the lease."""
        self._ended.set()
        clock.wait(self._thread)
        if not self._other:
            # A lease that cannot be removed is over by itself, and no reason for a finished job to fail.
            with suppress(StoreError):
                self._results.remove(LEASE_FILE, KIND)

    def _write(self) -> None:
        self._renewals += 1
        self._results.write(LEASE_FILE, f"{self._token} {self._renewals} {self._name}".encode(), KIND)

    def _renew(self) -> None:
        while not clock.wait(self._ended, RENEWED_EVERY):
            try:
                found = self._results.read(LEASE_FILE)
                if found is not None and not found.startswith(self._token.encode()):
                    self._other = _owner(found)
                    return
                self._write()
            except StoreError:
                # A call that fails costs one renewal; a store that fails for long ends the job itself.
                continue


def _owner(lease: bytes) -> str:
    """Returns the name in a lease."""
    return plain(lease.decode("utf-8", "replace").partition(" ")[2].partition(" ")[2][:_LONGEST_NAME])
