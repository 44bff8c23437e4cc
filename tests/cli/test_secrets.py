"""Secrets of addresses are shown nowhere, whatever the scheme, and names from outside stay on their line."""

from __future__ import annotations

import contextlib
import io
import json
import logging
import re
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

import tumble
from hostile_places import SERVING, patient, places, usual
from regular_expressions import processor_seconds
from repetitions import SOAK, drawn_seed
from tumble.bench.server_log import LOGGERS, hide_secrets_in_logs
from tumble.cli.screen import print_document
from tumble.cli.standard_output import checked_output
from tumble.foundation.errors import TumbleError
from tumble.foundation.secrets import HARMLESS, HIDDEN, without_secrets
from tumble.foundation.words import quoted, short
from turntable_sessions import typed
from workplaces import work_in

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
WITH_ANY_SIGN = (
    "postgresql://ann:{}@server/lab",
    "postgresql://ann:1234 {}@server/lab",
    "https://u@host/a?jwt={}",
    "https://host/a?rate=1%26jwt={}&y",
    "https://host/a?y=2&%6aw%74={}&sslmode=x",
    "postgresql://server/lab?options=-cpassword={}",
    "s3://bucket/a#{}",
    "s3://bucket/a?={}",
    "udp://:9000?baud=9600&pin={}",
    "serial:/dev/ttyUSB0?pin={}",
    "/home/ann/mavlink:udpin:0.0.0.0:14550?code={}",
)
"""Addresses as somebody types them, whose secrets may hold blanks and quotation marks."""
_any_secrets = st.text("abc019%+-_.!$*(),/ '\"<>", min_size=6, max_size=20).map(lambda text: f'S"{text} T')
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


@pytest.mark.parametrize("address", WITH_ANY_SIGN)
@given(secret=_any_secrets)
def test_no_part_of_a_secret_with_any_sign_is_shown(address, secret):
    given = address.format(secret)
    for text in (given, f"x: {given}: cannot be reached; give another"):
        shown = str(TumbleError(text))
        assert shown == without_secrets(shown) == str(TumbleError(shown))
        assert HIDDEN in shown
        assert "S" not in shown.replace("USB", "")
        assert "T" not in shown
        assert (text == given) != shown.endswith(": cannot be reached; give another")
    assert json.loads(_printed(print_document, "x", "y", {"given": given}))["given"] == str(
        TumbleError(given)
    )
    assert "S" not in quoted(given).replace("USB", "")
    assert "S" not in short(given).replace("USB", "")


def _printed(print_it, *words):
    shown = io.StringIO()
    with contextlib.redirect_stdout(shown), checked_output():
        print_it(*words)
    return shown.getvalue()


def test_a_secret_that_is_cut_is_hidden():
    given = f"https://ann:{'S' * 90}@host"
    assert "SS" not in quoted(given) + short(given) + short([given])


@pytest.mark.parametrize(
    "address", ["x://h?a=b&", "x://h?a=b;", "x://", "x://u:", "a:", "a:b?", "x:/", "?a="]
)
def test_time_grows_with_the_length_of_a_text(address):
    for is_message in (False, True):
        taken = []
        for count in (1000, 8000):
            before = processor_seconds()
            without_secrets(address * count, is_message=is_message)
            taken.append(processor_seconds() - before)
        assert taken[1] < 30 * max(taken[0], 1e-3)


def test_settings_of_tumble_are_shown():
    package = Path(tumble.__file__).parent
    found = {
        key
        for path in package.rglob("*.py")
        for call in re.findall(r"refuse_other_settings\(([^)]*)\)", path.read_text(encoding="utf-8"))
        for key in re.findall(r'"([\w-]+)"', call)
    }
    assert {"baud", "rate", "speed"} <= found <= HARMLESS
    for key in HARMLESS:
        text = f"serial:/dev/ttyUSB0?{key}=a/b:1,2: no samples"
        assert str(TumbleError(text)) == text == without_secrets(text)


ASKED = 30
"""Commands tried with an address, drawn from all."""


def test_no_command_shows_a_secret_of_an_address(tmp_path, monkeypatch):
    work_in(tmp_path, monkeypatch)
    every = [
        (place, address)
        for place in places()
        if place.words not in SERVING and place.option != "--output"  # a folder may have any name
        for address in WITH_ANY_SIGN
    ]
    bad = []
    for place, address in every if SOAK else Random(drawn_seed()).sample(every, ASKED):
        option = [place.option] if place.option else []
        with patient():
            done = typed(*place.words, *map(usual, place.needed), *option, address.format('Geh"eim Nis'))
        if any(part in done.out + done.err for part in ("Geh", "eim", "Nis")):
            bad.append((str(place), address, done))
    assert bad == []


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
