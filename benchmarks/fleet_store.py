"""A server of S3 on this machine that fails a share of all calls, as a busy store does."""

from __future__ import annotations

import logging
import os
import random
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import boto3  # type: ignore[import-untyped]
from moto.moto_server.werkzeug_app import DomainDispatcherApplication, MotoRequestHandler, create_backend_app
from werkzeug.serving import make_server

BUCKET = "fleet"
_BUSY = (
    b'<?xml version="1.0" encoding="UTF-8"?>\n<Error><Code>SlowDown</Code>'
    b"<Message>Please reduce your request rate.</Message></Error>"
)


class BusyStore:
    """Serves S3 and answers a share of the calls with `503 Slow Down`."""

    def __init__(self, share: float, seed: int) -> None:
        self.calls = 0
        self.failed = 0
        self._share = share
        self._draws = random.Random(seed)
        self._lock = threading.Lock()
        self._serve: Any = DomainDispatcherApplication(create_backend_app)

    def __call__(self, environment: dict[str, Any], answer: Any) -> Iterable[bytes]:  # noqa: ANN401 - WSGI
        """Answers a call as of WSGI."""
        with self._lock:
            self.calls += 1
            fails = self._draws.random() < self._share
            self.failed += fails
        if not fails:
            answered: Iterable[bytes] = self._serve(environment, answer)
            return answered
        environment["wsgi.input"].read(int(environment.get("CONTENT_LENGTH") or 0))
        answer("503 Slow Down", [("Content-Type", "application/xml")])
        return [_BUSY]


@contextmanager
def busy_store(share: float, seed: int) -> Iterator[BusyStore]:
    """Serves a bucket while the block runs; the environment states address and credentials."""
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    store = BusyStore(share, seed)
    server = make_server("127.0.0.1", 0, store, threaded=True, request_handler=MotoRequestHandler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    os.environ |= {
        "AWS_ENDPOINT_URL": f"http://127.0.0.1:{server.server_port}",
        "AWS_ACCESS_KEY_ID": "test",
        "AWS_SECRET_ACCESS_KEY": "test",
        "AWS_DEFAULT_REGION": "us-east-1",
    }
    try:
        boto3.client("s3").create_bucket(Bucket=BUCKET)
        yield store
    finally:
        server.shutdown()
        thread.join()
