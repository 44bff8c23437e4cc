"""Text that is packed, or in an encoding of Windows, reads as the plain file does."""

from __future__ import annotations

import bz2
import gzip
import io
import lzma
import tarfile
import zipfile

import numpy as np
import pytest
import zstandard

from log_fixtures import made_up, read, refusal, same, write, write_text
from tumble.logs import ReadOptions, open_recording

PACK = {
    ".gz": gzip.compress,
    ".bz2": bz2.compress,
    ".xz": lzma.compress,
    ".zst": zstandard.ZstdCompressor().compress,
}


def packed(path, ending):
    target = path.with_name(path.name + ending)
    target.write_bytes(PACK[ending](path.read_bytes()))
    return target


@pytest.fixture(scope="module")
def text(tmp_path_factory):
    return write_text(
        tmp_path_factory.mktemp("log") / "log.csv", made_up(4000, temperature=False)
    ).read_bytes()


@pytest.fixture
def log(tmp_path, text):
    path = tmp_path / "log.csv"
    path.write_bytes(text)
    return path


@pytest.mark.parametrize("ending", PACK)
def test_a_packed_table_holds_the_very_samples_of_the_plain_one(log, ending):
    path = packed(log, ending)
    assert same(read(path), read(log))
    assert open_recording(path).name == "log"


@pytest.mark.parametrize("ending", PACK)
def test_a_bad_line_of_a_packed_table_is_said_with_its_number(log, ending):
    lines = log.read_text().splitlines(keepends=True)
    lines[2000] = "1,2\n"
    log.write_text("".join(lines))
    assert "line 2001 has 2 fields" in refusal(packed(log, ending))


@pytest.mark.parametrize("ending", PACK)
@pytest.mark.parametrize("share", [0.5, 0.999])
def test_packed_table_that_is_cut_short_is_reported(log, ending, share):
    path = packed(log, ending)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    assert "damaged or cut short" in refusal(path)


@pytest.mark.parametrize("ending", PACK)
def test_several_packed_files_one_after_another_are_one(log, ending):
    data = log.read_bytes()
    path = log.with_name("joined.csv" + ending)
    middle = data.index(b"\n", len(data) // 2) + 1
    parts, empty = (PACK[ending](data[:middle]), PACK[ending](data[middle:])), 20 * PACK[ending](b"")
    for between in (b"", empty):
        path.write_bytes(between + between.join(parts) + between)
        assert same(read(path), read(log))


@pytest.mark.parametrize("ending", [".gz", ".zst"])
def test_packed_file_with_one_endless_line_is_refused(tmp_path, ending):
    head = b"time,ax,ay,az,gx,gy,gz\n" + b"0,0,0,9.8,0,0,0\n" * 2000
    path = tmp_path / f"log.csv{ending}"
    path.write_bytes(PACK[ending](head + b"7" * (68 << 20)))
    assert path.stat().st_size < 1 << 20
    assert "line is longer than 64 MiB" in refusal(path)


def test_xz_file_that_asks_for_excessive_memory_is_refused(tmp_path):
    path = tmp_path / "log.csv.xz"
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 9, "dict_size": 1 << 29}]
    path.write_bytes(lzma.compress(b"time,ax,ay,az,gx,gy,gz\n" * 9, filters=filters))
    assert "damaged or cut short" in refusal(path)


def test_packed_binary_is_refused_with_its_unpacker(tmp_path):
    parquet = write(tmp_path / "log.parquet", made_up(100))
    assert "holds the format parquet: gunzip log.parquet.gz" in refusal(packed(parquet, ".gz"))
    matrix = tmp_path / "log.mat"
    matrix.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + bytes(64))
    assert "holds no text: gunzip log.mat.gz" in refusal(packed(matrix, ".gz"))
    archive = io.BytesIO()
    with tarfile.open(fileobj=archive, mode="w") as tar:
        tar.add(parquet, "log.parquet")
    path = tmp_path / "logs.tar.gz"
    path.write_bytes(gzip.compress(archive.getvalue()))
    assert "a tar archive; unpack it with tar -xf" in refusal(path)
    path = tmp_path / "nothing.csv.gz"
    path.write_bytes(gzip.compress(b""))
    assert "holds nothing, packed by gzip" in refusal(path)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_table_with_a_byte_order_mark_reads_as_without(log, encoding):
    path = log.with_name("marked.csv")
    path.write_text(log.read_text(), encoding=encoding)
    assert same(read(path), read(log))


def test_units_in_the_characters_of_windows_are_understood(tmp_path):
    chunk = made_up(500, temperature=False)
    header = "Time [µs]\tax [m/s²]\tay [m/s²]\taz [m/s²]\tgx [°/s]\tgy [°/s]\tgz [°/s]"
    path = write_text(tmp_path / "log.txt", chunk, header, "\t", (1e6, 1.0, 180.0 / np.pi))
    path.write_bytes(path.read_text().replace(".", ",").encode("cp1252"))
    metadata = open_recording(path).metadata
    assert (metadata.time_unit.name, metadata.gyroscope_unit.name) == ("us", "deg/s")
    assert np.allclose(read(path).gyroscope, chunk.gyroscope, rtol=1e-12)


@pytest.mark.parametrize(("delimiter", "ending"), [("\t", ".tsv"), (";", ".csv")])
def test_a_decimal_comma_between_tabs_or_semicolons_reads_exactly(tmp_path, delimiter, ending):
    chunk = made_up(500, temperature=False)
    path = write_text(tmp_path / f"log{ending}", chunk, delimiter=delimiter)
    path.write_text(path.read_text().replace(".", ","))
    assert same(read(path), chunk)


@pytest.mark.parametrize(
    ("member", "words"),
    [
        ("xl/workbook.xml", "an Excel workbook; save its sheet as CSV"),
        ("word/document.xml", "a Word document"),
        ("Accelerometer.csv", "a ZIP archive; unpack it"),
    ],
)
def test_a_zip_archive_is_named_for_what_it_is(tmp_path, member, words):
    path = tmp_path / "log.csv"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", "<x/>" * 9)
        archive.writestr(member, np.random.default_rng(0).bytes(100_000))
    assert words in refusal(path)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"\x0e\x03\x13\x01" + bytes(99), "HDF4 file; convert it to HDF5 with h4toh5"),
        (b"\xb5\x62\x01\x07" + bytes(99), "u-blox log (UBX); write its ESF"),
        (b"     3.03           OBSERVATION DATA    M                   RINEX VERSION / TYPE\n", "RINEX"),
        (b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\n", "NMEA sentences"),
        (b"\x00\x00\x00\x18ftypmp42" + bytes(99), "a video"),
        (bytes(16) + b"BUILD 2016" + bytes(99), "a DJI flight record; convert it to CSV with DatCon"),
        (b"H Product:Blackbox flight data recorder by Nicholas Sherlock\n", "blackbox_decode"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(99), "an old Excel workbook"),
        (b"\xfa\xff\x36\x20" + bytes(99), "MT Manager"),
    ],
)
def test_unreadable_format_is_refused_with_its_converter(tmp_path, head, words):
    path = tmp_path / "log.csv"
    path.write_bytes(head)
    assert words in refusal(path)


def test_skipped_bad_lines_of_a_packed_table_are_counted(log):
    lines = log.read_text().splitlines(keepends=True)
    lines[2000] = "1,2\n"
    log.write_text("".join(lines))
    stream = open_recording(packed(log, ".gz"), ReadOptions(skip_bad_lines=True)).chunks()
    assert sum(map(len, stream)) == 3999
    assert "line 2001" in " ".join(stream.counts.notices())
