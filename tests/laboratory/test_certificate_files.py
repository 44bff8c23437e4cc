"""Files of certificates: those of another number are kept, whatever their names."""

from __future__ import annotations

import pytest

from made_up_certificates import HOSTILE, certificate
from tumble.foundation.errors import OutputError
from tumble.foundation.files import files_of_command
from tumble.laboratory.certificate.issue import Layout, numbered, rendered, write

PAIRS = (
    ("A/1", "A_1"),
    ("A:1", "A 1"),
    ("2026/1", "2026_1"),
    ("<A&1>", "_A_1_"),
    ("A'1", 'A"1'),
    ("é/1", "é_1"),
)
"""Numbers of certificates of which files have one name."""


@pytest.fixture(scope="module")
def drawn():
    """Both renderings of a certificate, by its number."""
    return lambda number: rendered(numbered(certificate(("en",)), number), Layout())


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_a_certificate_never_replaces_one_of_another_number(tmp_path, drawn, first, second):
    found = drawn(first)
    paths = write(found, tmp_path)
    other = drawn(second)
    for path in paths:
        content = path.read_bytes()
        with pytest.raises(OutputError, match="and is kept"):
            write(other, tmp_path)
        assert path.read_bytes() == content
        path.unlink()
        with pytest.raises(OutputError, match="and is kept"):
            write(other, tmp_path)
        assert not path.exists()
        path.write_bytes(content)
    with files_of_command() as files:
        assert write(found, tmp_path) == paths
    assert len(list(files.remarks())) == 1


@pytest.mark.parametrize("number", HOSTILE)
def test_a_certificate_replaces_itself_whatever_its_number(tmp_path, drawn, number):
    found = drawn(number)
    assert write(found, tmp_path) == write(found, tmp_path)


def test_a_drawing_of_others_is_kept(tmp_path, drawn):
    found = drawn("A1")
    for name, content in (
        ("A1.pdf", b"%PDF-1.4 my own drawing of a tumble dryer"),
        ("A1.pdf", b"%PDF-1.4 <pdf:Keywords>Tumble, A2</pdf:Keywords>"),
        ("A1.xml", b"<notes>tumble</notes>"),
    ):
        path = tmp_path / name
        path.write_bytes(content)
        with pytest.raises(OutputError, match="and is kept"):
            write(found, tmp_path)
        assert [each.read_bytes() for each in tmp_path.iterdir()] == [content]
        path.unlink()
