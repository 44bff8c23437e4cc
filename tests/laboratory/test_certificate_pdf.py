"""Certificates as PDF: PDF/A-3 that carries the XML of the same numbers."""

from __future__ import annotations

import io
import re

import pikepdf
import pytest

from made_up_certificates import HOSTILE, certificate
from pdf_text import text_of
from tumble.foundation.errors import TumbleError
from tumble.laboratory.certificate import pdf, typesetting
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.logo import Logo
from tumble.laboratory.certificate.pdf import TEMPLATE, font_families, pdf_of

LANGUAGES = ("en", "zh") if set(pdf.CHINESE_FONTS) & set(typesetting.fonts().families()) else ("en",)
"""Both where a font with Chinese letters is installed."""


def made(found):
    return pdf_of(found, dcc_of(found))


def opened(content):
    return pikepdf.open(io.BytesIO(content))


def test_the_file_states_what_makes_it_pdf_a_3():
    with opened(made(certificate(LANGUAGES))) as document:
        intent = document.Root.OutputIntents[0]
        assert intent.S == "/GTS_PDFA1"
        assert intent.DestOutputProfile.N == 3
        with document.open_metadata() as metadata:
            assert (metadata["pdfaid:part"], metadata["pdfaid:conformance"]) == ("3", "B")
            assert metadata["dc:title"] == "Calibration certificate IMU-2026-0007"
        assert "/Encrypt" not in document.trailer
        fonts = [each for each in document.objects if _is(each, "/FontDescriptor")]
        assert fonts
        assert all({"/FontFile2", "/FontFile3"} & set(font.keys()) for font in fonts)
        assert not any(_is(each, "/Action") or "/JS" in _keys(each) for each in document.objects)


def _keys(found):
    return set(found.keys()) if isinstance(found, pikepdf.Dictionary) else set()


def _is(found, kind):
    return "/Type" in _keys(found) and found.Type == kind


def test_the_xml_is_attached_as_an_alternative():
    found = certificate(LANGUAGES)
    with opened(made(found)) as document:
        (attached,) = document.attachments.values()
        assert attached.get_file().read_bytes() == dcc_of(found)
        assert attached.get_file().mime_type == "application/xml"
        assert document.Root.AF[0].AFRelationship == "/Alternative"


def test_both_renderings_show_the_same_numbers():
    found = certificate(LANGUAGES)
    shown = text_of(made(found))
    for quantity in found.calibrated[0].quantities:
        for number in (quantity.value, quantity.uncertainty, quantity.coverage_factor):
            assert number is None or number in shown
            assert number is None or f">{number}<".encode() in dcc_of(found)
    for fact in (found.number, found.issued, "2026-11-26", "25.0 °C", "9.81 m/s²", "not observable"):
        assert fact in shown


def test_every_page_bears_number_and_page_n_of_m():
    quantity = certificate().calibrated[0].quantities[0]
    whole = certificate().calibrated[0].model_copy(update={"quantities": (quantity,) * 90})
    content = made(certificate(LANGUAGES, calibrated=(whole,)))
    with opened(content) as document:
        pages = len(document.pages)
    assert pages > 2
    shown = text_of(content)
    assert re.findall(r"Page (\d+) of (\d+)", shown) == [(str(n + 1), str(pages)) for n in range(pages)]
    assert shown.count("IMU-2026-0007") >= pages
    assert shown.count("may be reproduced only in full") == pages


@pytest.mark.parametrize("text", HOSTILE)
def test_text_from_outside_stays_text_in_the_pdf(text):
    shown = text_of(made(certificate(("en",), text=text)))
    assert shown.count("".join(text.split())) + shown.count(text) >= 3


def test_the_same_certificate_is_the_same_file():
    assert made(certificate(LANGUAGES)) == made(certificate(LANGUAGES))


def test_a_missing_chinese_font_is_one_line(monkeypatch):
    monkeypatch.setattr(pdf, "CHINESE_FONTS", ("No Such Font",))
    with pytest.raises(TumbleError, match="fonts-wqy-microhei") as caught:
        font_families(certificate(("en", "zh")))
    assert "\n" not in str(caught.value)
    assert font_families(certificate(("en",))) == ["Libertinus Serif"]


def test_a_letter_without_a_font_is_one_line():
    with pytest.raises(TumbleError, match="a font with all letters") as caught:
        made(certificate(("en",), text="\U000e0100\U0001f9ff"))
    assert "\n" not in str(caught.value)


def test_a_template_of_the_laboratory_takes_the_place_of_ours(tmp_path):
    template = tmp_path / "ours.typ"
    template.write_text(f'{TEMPLATE.read_text()}\n#import "more.typ": motto\n#motto')
    (tmp_path / "more.typ").write_text("#let motto = [Measure twice]")
    found = certificate(("en",))
    assert "Measure twice" in text_of(pdf_of(found, dcc_of(found), template))


def test_a_wrong_template_or_logo_is_one_line(tmp_path):
    template = tmp_path / "ours.typ"
    template.write_text("#unknown-name")
    found = certificate(("en",))
    with pytest.raises(TumbleError, match="unknown variable") as caught:
        pdf_of(found, dcc_of(found), template)
    assert "\n" not in str(caught.value)
    with pytest.raises(TumbleError, match=r"^ours\.png: typst reports") as caught:
        pdf_of(found, dcc_of(found), logo=Logo("ours.png", b"no picture"))
    assert "\n" not in str(caught.value)
    with pytest.raises(TumbleError, match="cannot be read"):
        pdf_of(found, dcc_of(found), tmp_path / "absent.typ")


def test_a_logo_is_shown():
    found = certificate(("en",))
    logo = b'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><rect width="9" height="9"/></svg>'
    assert pdf_of(found, dcc_of(found), logo=Logo("ours.svg", logo)) != made(found)
