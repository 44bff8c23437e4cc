"""A logo of any content is a small picture, or one line that names it."""

import multiprocessing
import os
import random
import struct
import zlib

import pytest

from made_up_certificates import certificate
from patience import PATIENCE
from tumble.foundation.bounded_process import in_bounded_process
from tumble.foundation.errors import TumbleError
from tumble.laboratory.certificate import typesetting
from tumble.laboratory.certificate.dcc import dcc_of
from tumble.laboratory.certificate.logo import Logo, load_logo
from tumble.laboratory.certificate.pdf import TEMPLATE, pdf_of

SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9">{}</svg>'
WITHIN = '<image href="data:image/png;base64,x"/>'


def png(width, height, rows=b""):
    """A PNG that states a size, of as many rows as are given."""
    parts = ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)), (b"IDAT", zlib.compress(rows)))
    chunks = (
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in (*parts, (b"IEND", b""))
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def frame(width, height, marker=0xC0):
    return bytes([0xFF, marker]) + struct.pack(">HBHHB", 11, 8, height, width, 1) + b"\1\x11\0"


def jpeg(*frames):
    """The head of a JPEG, with a thumbnail of any size in a segment of its own."""
    thumbnail = b"\xff\xe1" + struct.pack(">H", 2 + len(frame(60000, 60000))) + frame(60000, 60000)
    return b"\xff\xd8" + thumbnail + b"".join(frames)


DRAWN = "<defs><style>path{fill:red}</style><linearGradient id='g'><stop/></linearGradient></defs>" + (
    "<title>a</title><desc>b</desc><metadata><p:title xmlns:p='urn:p'>c</p:title></metadata>"
    "<g><path d='M0 0h9v9'/><rect width='9' height='9' fill='url(#g)'/><text>d<tspan>e</tspan></text></g>"
)
ELEMENTS = """
    a altGlyph altGlyphDef altGlyphItem animate animateColor animateMotion animateTransform canvas clipPath
    color-profile cursor feBlend feColorMatrix feComponentTransfer feComposite feConvolveMatrix
    feDiffuseLighting feDisplacementMap feDropShadow feFlood feFuncA feGaussianBlur feImage feMerge
    feMergeNode feMorphology feOffset feSpecularLighting feTile feTurbulence filter font foreignObject
    glyph glyphRef hatch iframe image marker mask mesh pattern script set solidColor switch symbol textPath
    tref use video view
"""
"""Elements of SVG that draw others once more, compute pictures, show other files, or move."""
SMALL = frame(90, 90)
GOOD = png(9, 9, 9 * bytes(10))


@pytest.mark.parametrize(
    "content",
    [
        png(60000, 60000),
        png(1 << 31, 1),
        *(jpeg(frame(60000, 60000, marker)) for marker in (0xC0, 0xC1, 0xC2, 0xC9, 0xCF)),
        jpeg(SMALL, frame(60000, 60000)),
        jpeg(SMALL, b"\xff\xda\0\2entropy\xff\0\xff\xd0", b"\xff\xff", frame(60000, 60000)),
    ],
)
def test_a_picture_of_too_many_pixels_is_never_unpacked(tmp_path, content):
    path = tmp_path / "logo"
    path.write_bytes(content)
    with pytest.raises(TumbleError, match=f"{path}: has [0-9]+ pixels"):
        load_logo(str(path))


@pytest.mark.parametrize(
    "text",
    [
        SVG.format(WITHIN),
        SVG.format(f"<g><defs>{WITHIN}</defs></g>"),
        SVG.format('<filter><feImage href="data:image/png;base64,x"/></filter>'),
        f"<!DOCTYPE svg [<!ENTITY a '{WITHIN}'>]>{SVG.format('&a;')}",
        SVG.replace("<svg", "<s:svg").replace("xmlns", "xmlns:s").replace("</", "</s:").format("<s:image/>"),
    ],
)
def test_a_drawing_shows_no_other_picture(tmp_path, text):
    (tmp_path / "logo.svg").write_text(text)
    with pytest.raises(TumbleError, match=r"logo\.svg: line 1: has (image|filter), and a logo has shapes"):
        load_logo(str(tmp_path / "logo.svg"))


def test_a_drawing_takes_no_more_than_its_bytes(tmp_path):
    path = tmp_path / "logo.svg"
    path.write_text(SVG.format(DRAWN))
    assert load_logo(str(path)).content
    strays = [f"<{name}/>" for name in ELEMENTS.split()]
    strays += [f'<rect {name}="blur(9)"/>' for name in ("filter", "FILTER")]
    strays += [
        f'<rect style="{text}"/>' for text in ("filter:blur(9)", "fill:red;Filter :none", "f\\69lter:x")
    ]
    strays += ["<style>path{filter:blur(9)}</style>", "<style>p{fil<!---->\\ter:x}</style>"]
    for stray in strays:
        path.write_text(SVG.format(f"<defs>\n{stray}</defs>"))
        with pytest.raises(TumbleError, match=r"logo\.svg: line 2: has .*, and a logo has shapes, text"):
            load_logo(str(path))
    path.write_text(SVG.format('<rect style="color-interpolation-filters:sRGB;fill:red"/>'))
    assert load_logo(str(path)).content


@pytest.mark.parametrize("whose", ["template", "logo"])
def test_what_goes_on_for_ever_is_given_up(tmp_path, monkeypatch, whose):
    found = certificate(("en",))
    endless = '<filter id="f"><feTurbulence numOctaves="2000000000"/></filter><rect filter="url(#f)"/>'
    template = tmp_path / "ours.typ"
    template.write_text(TEMPLATE.read_text() + "\n#while true {}")
    given = (
        {"template": template}
        if whose == "template"
        else {"logo": Logo("ours.svg", SVG.format(endless).encode())}
    )
    monkeypatch.setattr(typesetting, "SET_WITHIN", 0.0)
    with pytest.raises(TumbleError, match=r"ours.*: typst takes more than 0 s; give a simpler") as caught:
        pdf_of(found, dcc_of(found), **given)
    assert "\n" not in str(caught.value)
    assert multiprocessing.active_children() == []


def test_a_process_that_ends_without_an_answer_is_named():
    with pytest.raises(EOFError, match="ends without an answer"):
        in_bounded_process(os._exit, 1, seconds=PATIENCE)
    assert in_bounded_process(divmod, 7, 3, seconds=PATIENCE) == (2, 1)
    with pytest.raises(ZeroDivisionError):
        in_bounded_process(divmod, 7, 0, seconds=PATIENCE)


@pytest.mark.parametrize(
    "content", [b"GIF89a", b"", b"%PDF-1.7", b"<html/>", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xc0"]
)
def test_what_is_no_logo_is_one_line(tmp_path, content):
    (tmp_path / "logo").write_bytes(content)
    with pytest.raises(TumbleError, match="logo: is no SVG, PNG or JPEG, or damaged"):
        load_logo(str(tmp_path / "logo"))


def test_a_damaged_picture_is_named_and_ends_nothing(tmp_path):
    seed = 43
    draws = random.Random(seed)
    found = certificate(("en",))
    xml = dcc_of(found)
    path = tmp_path / "ours.png"
    lines = []
    for _ in range(6):
        damaged = bytearray(GOOD)
        damaged[draws.randrange(8, len(damaged) - 12)] ^= 1 << draws.randrange(8)
        path.write_bytes(damaged)
        try:
            pdf_of(found, xml, logo=load_logo(str(path)))
        except TumbleError as error:
            lines.append(str(error))
    assert lines, seed
    assert all(line.startswith(f"{path}: ") for line in lines), seed
    path.write_bytes(GOOD)
    assert pdf_of(found, xml, logo=load_logo(str(path)))
