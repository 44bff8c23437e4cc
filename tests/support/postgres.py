"""A PostgreSQL server of its own: in a temporary folder, on a free port, run by an ordinary user."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ORDINARY_USER = "nobody"
"""Runs the server where root runs the tests: PostgreSQL refuses root."""
PASSWORD = "s3cret@:/word"
"""Holds signs that a URL has to quote."""


def programs() -> Path | None:
    """Folder with `initdb`; None where PostgreSQL is not installed."""
    beside = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    found = shutil.which("initdb") or (beside[-1] if beside else None)
    return Path(found).resolve().parent if found else None


def require() -> Path:
    """Folder of the programs; where they are missing the test is skipped, and fails in CI."""
    found = programs()
    if found is None and os.environ.get("CI") == "true":
        pytest.fail("PostgreSQL is not installed; run scripts/install_postgres.sh as root")
    if found is None:
        pytest.skip("PostgreSQL is not installed; scripts/install_postgres.sh installs it as root")
    return found


class Server:
    """A running server."""

    def __init__(self, bin_folder: Path, folder: Path) -> None:
        self._bin, self._data = bin_folder, folder / "data"
        self._folder = folder
        self.port = _free_port()
        (folder / "password").write_text(PASSWORD)
        if os.geteuid() == 0:
            shutil.chown(folder, ORDINARY_USER)
            shutil.chown(folder / "password", ORDINARY_USER)
        options = ("--username=tumble", "--encoding=UTF8", "--locale=C", "--no-sync", "--auth=scram-sha-256")
        self._run("initdb", f"--pgdata={self._data}", f"--pwfile={folder / 'password'}", *options)
        self.start()

    def url(self, database: str) -> str:
        """URL of a database, with the password."""
        from urllib.parse import quote

        return f"postgresql://tumble:{quote(PASSWORD, safe='')}@127.0.0.1:{self.port}/{database}"

    def make(self, database: str, template: str = "template1") -> str:
        """Make a database, with all that another one holds; its URL."""
        import psycopg

        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            connection.execute(f'CREATE DATABASE "{database}" TEMPLATE "{template}"')
        return self.url(database)

    def start(self) -> None:
        """Start the server, and wait until it answers."""
        # Programs are killed here, not computers: what is written need not reach the disk.
        settings = f"-p {self.port} -k {self._folder} -c listen_addresses=127.0.0.1 -c fsync=off"
        self._control("-l", self._folder / "log", "-o", settings, "start")

    def stop(self, mode: str = "fast") -> None:
        """Stop the server, whoever is connected."""
        self._control("-m", mode, "stop")

    def _control(self, *words: object) -> None:
        self._run("pg_ctl", "--wait", "--timeout", "300", "-D", self._data, *words)

    def _run(self, program: str, *words: object) -> None:
        ordinary = (
            {"user": ORDINARY_USER, "group": "nogroup", "extra_groups": []} if os.geteuid() == 0 else {}
        )
        done = subprocess.run(
            [self._bin / program, *map(str, words)],
            cwd=self._folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            **ordinary,
        )
        assert done.returncode == 0, done.stderr


@contextmanager
def running() -> Iterator[Server]:
    """Run a server while the block runs."""
    bin_folder = require()
    with tempfile.TemporaryDirectory(prefix="tumble-postgres-", ignore_cleanup_errors=True) as folder:
        server = Server(bin_folder, Path(folder))
        try:
            yield server
        finally:
            server.stop("immediate")


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
