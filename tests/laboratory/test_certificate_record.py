"""Certificates in the registry, on both engines: numbers without gaps, and nothing is ever lost."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from made_up_calibrations import made_up, save
from made_up_certificates import certificate
from tumble.foundation.errors import TumbleError
from tumble.laboratory.certificate import record
from tumble.laboratory.certificate.model import Certificate
from tumble.laboratory.certificate.numbering import first_free, parse_pattern
from tumble.laboratory.registry import Registry

PATTERN = parse_pattern("IMU-{year}-{n:04}")
DAY = "2026-11-26"


def make(number):
    return record.Rendered(number, f"%PDF- {number}".encode(), f"<xml>{number}</xml>".encode())


def issue(registry, result, **options):
    return record.issue(registry, PATTERN, DAY, [result], make, **options).number


@pytest.fixture
def results(registry, tmp_path):
    units = [made_up(serial=str(n), log=str(n)) for n in range(6)]
    return [each.identity for each in registry.add(save(tmp_path / "results", *units))]


def test_numbers_are_unique_and_without_gaps(registry, results):
    numbers = [issue(registry, result) for result in results[:3]]
    assert numbers == ["IMU-2026-0001", "IMU-2026-0002", "IMU-2026-0003"]
    assert record.issue(registry, PATTERN, "2027-01-02", [results[3]], make).number == "IMU-2027-0001"
    assert registry.verify().intact


@pytest.mark.parametrize(
    "day", ["2026-02-30", "2026-13-01", "0000-01-01", "2026-11-2", "\uff12026-01-01", "2026-11-26\n"]
)
@pytest.mark.parametrize("place", ["issued", "begun", "day"])
def test_each_day_of_a_certificate_is_one_of_the_calendar(day, place):
    content = certificate().content()
    changed = content if place == "issued" else content["calibrated"][0]
    assert changed[place].startswith("2026-11-2")
    changed[place] = day
    with pytest.raises(ValidationError, match=r"calendar|pattern"):
        Certificate.model_validate(content)


def test_a_certificate_that_fails_leaves_its_number_free(registry, results):
    def fail(number):
        raise TumbleError(f"{number}: no room")

    with pytest.raises(TumbleError, match="no room"):
        record.issue(registry, PATTERN, DAY, results[:1], fail)
    assert issue(registry, results[0]) == "IMU-2026-0001"
    assert registry.verify().intact


def test_stations_at_once_get_numbers_of_their_own(registry, results):
    place = registry.address.url or registry.address.path
    text = place if registry.address.path else place.render_as_string(hide_password=False)

    def station(result):
        return issue(Registry(str(text).replace("+psycopg", "")), result)

    with ThreadPoolExecutor(len(results)) as stations:
        numbers = list(stations.map(station, results))
    assert sorted(numbers) == [PATTERN.number(n + 1, DAY) for n in range(len(results))]
    assert registry.verify().intact


def test_a_withdrawn_certificate_stays_on_record_with_its_files(registry, results):
    number = issue(registry, results[0])
    record.withdraw(registry, number, "wrong customer", who="Ann")
    row = record.certificate_row(registry, number)
    assert (row["state"], row["reason"], row["results"]) == ("withdrawn", "wrong customer", [results[0]])
    assert record.documents_of(registry, number) == make(number)
    with pytest.raises(TumbleError, match="withdrawn already"):
        record.withdraw(registry, number, "again")
    assert issue(registry, results[0]) == "IMU-2026-0002"
    assert registry.verify().intact


def test_a_result_is_on_one_certificate_that_holds(registry, results):
    first = issue(registry, results[0])
    with pytest.raises(TumbleError, match=f"is on certificate {first}"):
        issue(registry, results[0])
    second = issue(registry, results[0], supersedes=first)
    assert record.certificate_row(registry, first)["state"] == f"superseded by {second}"
    assert record.documents_of(registry, first) == make(first)
    with pytest.raises(TumbleError, match=f"is superseded by {second}"):
        issue(registry, results[0], supersedes=first)
    states = [(row["number"], row["state"], row["serial"]) for row in record.listed(registry)]
    assert states == [(first, f"superseded by {second}", "0"), (second, "issued", "0")]


def test_signed_files_take_the_place_of_unsigned_ones(registry, results):
    number = issue(registry, results[0])
    signed = record.Rendered(number, b"%PDF- signed", b"<signed/>")
    record.replace_documents(registry, signed, "certificate signed")
    assert record.documents_of(registry, number) == signed
    assert registry.verify().intact
    assert registry.verify().unreferenced == 0


def test_a_flipped_bit_in_a_stored_certificate_is_found(registry, results, tmp_path):
    number = issue(registry, results[0])
    digest = record.certificate_row(registry, number)["pdf"]
    path = tmp_path / "documents" / digest[:2] / digest
    content = bytearray(path.read_bytes())
    content[3] ^= 1
    path.write_bytes(content)
    assert not registry.verify().intact
    with pytest.raises(TumbleError, match="was changed"):
        record.documents_of(registry, number)


def test_a_number_that_does_not_exist_is_one_line(registry):
    for found in (record.certificate_row, record.documents_of):
        with pytest.raises(TumbleError, match="none of that number"):
            found(registry, "IMU-1")
    with pytest.raises(TumbleError, match="none of that number"):
        record.withdraw(registry, "IMU-1", "why")


def test_a_backup_holds_the_certificates(registry, results, tmp_path):
    number = issue(registry, results[0])
    assert registry.backup(tmp_path / "copy").intact
    assert record.documents_of(Registry(tmp_path / "copy" / "registry.db"), number) == make(number)


@given(st.integers(0, 10_000))
def test_the_first_free_number_follows_those_taken(count):
    questions = []

    def is_taken(number):
        questions.append(number)
        return int(number.rpartition("-")[2]) <= count

    assert first_free(PATTERN, DAY, is_taken) == PATTERN.number(count + 1, DAY)
    assert len(questions) <= 30


@pytest.mark.parametrize(
    "text",
    [
        "",
        "IMU",
        "IMU-{year}",
        "{n}-{n}",
        "{n:d}",
        "{n!r}",
        "{serial}-{n}",
        "{n",
        "{n.real}",
        "a\nb{n}",
        "{0}{n}",
    ],
)
def test_a_pattern_that_is_none_is_one_line(text):
    with pytest.raises(TumbleError, match="pattern") as caught:
        parse_pattern(text)
    assert "\n" not in str(caught.value)


def test_a_pattern_may_count_by_month():
    assert parse_pattern("K/{year}{month}/{n}").number(12, DAY) == "K/202611/12"
