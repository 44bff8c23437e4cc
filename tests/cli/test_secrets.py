"""Secrets of addresses are shown nowhere, whatever the scheme, and names from outside stay on their line."""

from __future__ import annotations

import contextlib
import io
import json
import logging

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tumble.bench.server_log import LOGGERS, hide_secrets_in_logs
from tumble.cli.standard_output import checked_output
from tumble.foundation.errors import TumbleError
from tumble.foundation.secrets import HIDDEN, without_secrets
from turntable_sessions import typed

ADDRESSES = (
    "https://u:{}@host/a.csv",
    "https://{}@host/a.csv",
    "zip://x.csv::https://u:{}@host/a.zip",
    "simplecache::zip://*.csv::s3://key:{}@bucket/x",
    "postgresql://ann:{}@server/lab",
    "postgresql://server/lab?user=ann&password={}",
    "https://host/a?X-Amz-Signature={}&y=2",
    "https://host/a?sv=1&sig={}",
    "abfs://container@account/x?sas_token={}",
    "http://127.0.0.1:8080/?token={}",
    "ann:{}@host",
    "//ann:{}@host/a.csv",
    "/home/ann/ann:{}@host/lab",
    "github://ann:repository:{}@main/a.csv",
    "KeyError('ann:{}@host')",
)
_secrets = st.text("abcXYZ019%:+-_.!$*(),/", min_size=6, max_size=20).map(lambda text: f"S{text}T")


def without_scheme(address):
    """Returns whether an address has no scheme, so that its password ends where a path begins."""
    return "://" not in address


@pytest.mark.parametrize("address", ADDRESSES)
@given(secret=_secrets)
def test_a_secret_is_shown_by_no_error_and_no_line(address, secret):
    if without_scheme(address):
        secret = secret.replace("/", "")
    given = address.format(secret)
    text = f"x: {given}: cannot be reached; folder {given.replace('://', ':/')} does not exist either"
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown), checked_output():
        print(text)
    for each in (
        without_secrets(text),
        str(TumbleError(text)),
        str(TumbleError("why", text)),
        shown.getvalue(),
    ):
        assert secret not in each
        assert HIDDEN in each


@pytest.mark.parametrize("address", ADDRESSES)
def test_json_with_a_hidden_secret_is_still_json(address):
    given = {"address": address.format("Secret1T"), "next": 1}
    hidden = json.loads(without_secrets(json.dumps(given)))
    assert "Secret1T" not in hidden["address"]
    assert hidden["next"] == 1


@pytest.mark.parametrize(
    "text",
    [
        "s3://bucket/a@b/c.csv",
        "see https://ptb.de/dcc, or write to ann@example.org",
        "--set key=value: no such setting",
        "postgresql://ann:***@server/lab?sslmode=require",
        "udp://:9000 and ros2:///imu",
    ],
)
def test_other_text_is_shown_as_it_is(text):
    assert without_secrets(text) == text


@pytest.mark.parametrize("command", ["run", "status"])
def test_a_fleet_shows_no_password_of_its_job(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    for number, address in enumerate(ADDRESSES[:3]):
        place = address.format("pa/SECRET").replace("https", "http").replace("@host", "@127.0.0.1:9")
        job = f"schema: tumble-fleet-job/1\nprocedure: noise\ninputs: '{place}'\nresults: '{place}'\n"
        (tmp_path / f"{number}.yaml").write_text(job)
        done = typed("fleet", command, f"{number}.yaml")
        assert done.code == 2
        assert "SECRET" not in done.out + done.err


@given(st.text(max_size=30))
def test_an_error_is_one_line_whatever_names_it_holds(text):
    shown = str(TumbleError(f"topic {text} holds no messages", about=text))
    assert len(shown.splitlines()) == 1
    assert not set(shown) & {*map(chr, range(32)), *"\x7f\u061c\u200e\u200f\u202e\u2066\u2028"}


def test_a_page_that_is_not_found_is_logged_without_its_token(caplog):
    hide_secrets_in_logs()
    hide_secrets_in_logs()
    for name in LOGGERS:
        with caplog.at_level("WARNING", logger=name):
            logging.getLogger(name).warning("%s not found", "http://bench:8080/x?token=SECRET")
    assert len(caplog.messages) == len(LOGGERS)
    assert "SECRET" not in caplog.text
