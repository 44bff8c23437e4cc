"""Edits of a signed certificate, XML or PDF, by somebody who wants other content under a signature."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Mapping
from random import Random

import pikepdf
from asn1crypto import cms
from asn1crypto.algos import DSASignature
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter

ORDER = 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551
"""Number of points of the curve P-256: with (r, s) holds the signature (r, ORDER - s) as well."""
DIGITS = b"0123456789"
_ROOT = b"digitalCalibrationCertificate"
_STRAYS = (
    *(b"<!---->", b"<!-- 0 -->", b"<?x y?>", b"<?xml-stylesheet href='x'?>", b"<![CDATA[]]>", b"&#32;"),
    *(
        b" ",
        b"\n",
        b"\t",
        b"\r\n",
        b"\xc2\xa0",
        b"\xe2\x80\x8b",
        b"\xef\xbb\xbf",
        b"0",
        b"&lt;",
        b"&nothing;",
    ),
)

Edit = Callable[[bytes, Random], bytes]


def _put(content: bytes, place: int, what: bytes, cut: int = 0) -> bytes:
    return content[:place] + what + content[place + cut :]


def _one(found: list[re.Match[bytes]], drawn: Random) -> re.Match[bytes]:
    return found[drawn.randrange(len(found))]


def _tag(content: bytes, drawn: Random) -> re.Match[bytes]:
    return _one(list(re.finditer(rb"<[a-z]+:\w+", content)), drawn)


def _element(content: bytes, drawn: Random) -> re.Match[bytes]:
    """Any element without elements in it."""
    return _one(list(re.finditer(rb"<([a-z]+:\w+)[^<>]*>[^<]*</\1>", content)), drawn)


def stray_in_text(content: bytes, drawn: Random) -> bytes:
    """Puts what readers skip, or take for the end, into a text."""
    text = _one(list(re.finditer(rb">[^<]+<", content)), drawn)
    place = drawn.randint(text.start() + 1, text.end() - 1)
    return _put(content, place, drawn.choice(_STRAYS))


def comment_in_number(content: bytes, drawn: Random) -> bytes:
    """Cuts a number, or a name, by a comment: a reader may take what stands before it."""
    text = _one(list(re.finditer(rb">[^<]+<", content)), drawn)
    place = drawn.randint(text.start() + 1, text.end() - 1)
    return _put(content, place, b"<!--%b-->" % drawn.choice((b"", b" ", b"0", b"\xc3\xa4")))


def stray_anywhere(content: bytes, drawn: Random) -> bytes:
    """Puts the same anywhere."""
    return _put(content, drawn.randint(0, len(content)), drawn.choice(_STRAYS))


def stray_between_elements(content: bytes, drawn: Random) -> bytes:
    """Puts the same before or behind a tag."""
    tag = _one(list(re.finditer(rb"<", content)), drawn)
    return _put(content, tag.start(), drawn.choice((*_STRAYS, b"x")))


def namespace(content: bytes, drawn: Random) -> bytes:
    """Declares a namespace: one that is there, another one, or the same name for another."""
    stated = drawn.choice(
        (
            *(
                b"xmlns:a='urn:a'",
                b"xmlns:dcc='https://ptb.de/dcc'",
                b"xmlns:si='https://ptb.de/si'",
                b"xmlns=''",
            ),
            *(b"xmlns:dcc='urn:a'", b"xmlns:ds='http://www.w3.org/2000/09/xmldsig#'"),
            b"xmlns='https://ptb.de/dcc'",
        )
    )
    return _put(content, _tag(content, drawn).end(), b" " + stated)


def attribute(content: bytes, drawn: Random) -> bytes:
    """Adds an attribute, such as an identity that another element has too."""
    stated = drawn.choice(
        (b'Id="a"', b'ID="a"', b'xml:id="a"', b'id=""', b'lang="zh"', b'xml:space="default"')
    )
    once = _put(content, _tag(content, drawn).end(), b" " + stated)
    return _put(once, _tag(once, drawn).end(), b" " + stated) if drawn.random() < 0.5 else once


def reference(content: bytes, drawn: Random) -> bytes:
    """Lets the signature refer to an identity, which one element or two have."""
    named = content.replace(b'URI=""', b'URI="#a"')
    return attribute(named, drawn)


def wrapped(content: bytes, drawn: Random) -> bytes:
    """Wraps what was signed into another certificate, whose numbers are others."""
    body = content.partition(b"?>\n")[2]
    other = number(re.sub(rb"<ds:Signature .*</ds:Signature>", b"", body), drawn)
    signature = re.search(rb"<ds:Signature .*</ds:Signature>", body)[0]
    end = other.rindex(b"</")
    inside = drawn.choice((body, b"<ds:Object>%b</ds:Object>" % body, signature, signature + body))
    place = drawn.choice((end, end, other.index(b">") + 1, len(other), 0))
    return content[: content.index(b"?>") + 3] + _put(other, place, inside)


def moved(content: bytes, drawn: Random) -> bytes:
    """Moves, repeats or removes an element."""
    element = _element(content, drawn)
    change = drawn.choice(("move", "repeat", "remove"))
    kept = content if change == "repeat" else content[: element.start()] + content[element.end() :]
    if change == "remove":
        return kept
    place = drawn.choice([each.start() for each in re.finditer(rb"<", kept)][1:])
    return _put(kept, place, element[0])


def number(content: bytes, drawn: Random) -> bytes:
    """Changes a digit, or writes a number in another way."""
    found = _one(list(re.finditer(rb">[+-]?[0-9][0-9.e+-]*<", content)), drawn)
    text = found[0][1:-1]
    at = drawn.randrange(len(text))
    other = drawn.choice(
        (_put(text, at, bytes([drawn.choice(DIGITS)]), 1), text + b"0", b"+" + text, b"0" + text)
    )
    return content.replace(found[0], b">" + other + b"<", 1)


def encoding(content: bytes, drawn: Random) -> bytes:
    """Writes the same letters in another encoding, or declares one."""
    text, name = (
        content.decode(),
        drawn.choice(("utf-16", "utf-16-le", "utf-8-sig", "utf-32", "cp037", "ascii")),
    )
    declared = text.replace("UTF-8", drawn.choice(("UTF-8", "utf-8", "US-ASCII", "ISO-8859-1", name.upper())))
    return declared.encode(name, "xmlcharrefreplace")


def spelling(content: bytes, drawn: Random) -> bytes:
    """Writes the same element, attribute, letter or beginning in another way that XML allows."""
    change = drawn.choice(
        ("quote", "empty", "letter", "hexadecimal", "cdata", "declaration", "doctype", "space")
    )
    if change == "quote":
        found = _one(list(re.finditer(rb'="([^"]*)"', content)), drawn)
        return _put(content, found.start(), b"='" + found[1] + b"'", len(found[0]))
    if change == "empty":
        found = _one(list(re.finditer(rb"></[\w:]+>", content)), drawn)
        return _put(content, found.start(), b"/>", len(found[0]))
    if change in ("letter", "hexadecimal", "cdata"):
        text = _one(list(re.finditer(rb">[^<&\x80-\xff]+<", content)), drawn)
        place = drawn.randrange(text.start() + 1, text.end() - 1)
        form = {"letter": b"&#%d;" % content[place], "hexadecimal": b"&#x%x;" % content[place]}
        return _put(content, place, form.get(change, b"<![CDATA[" + content[place : place + 1] + b"]]>"), 1)
    if change == "space":
        found = _one(list(re.finditer(rb"[\w\"]>", content)), drawn)
        return _put(content, found.end() - 1, b" ")
    first, _, rest = content.partition(b"?>\n")
    other = drawn.choice(
        (b'<?xml version="1.0"?>\n', b'<?xml version="1.1" encoding="UTF-8"?>\n', b"", first + b"?>")
    )
    if change == "declaration":
        return other + rest
    kind = drawn.choice((b"<!DOCTYPE dcc:%b>" % _ROOT, b'<!DOCTYPE dcc:%b [<!ENTITY e "0">]>' % _ROOT))
    return first + b"?>\n" + kind + (stray_in_text(rest, drawn).replace(b"&nothing;", b"&e;"))


def signature(content: bytes, drawn: Random) -> bytes:
    """Changes the frame of the signature, which nobody signed."""
    whole = re.search(rb"<ds:Signature .*</ds:Signature>", content)[0]
    value = re.search(rb"<ds:SignatureValue>(.*)</ds:SignatureValue>", whole)[1]
    name = drawn.choice((b"SignatureValue", b"X509Certificate", b"DigestValue"))
    text = re.search(rb"<ds:%b>(.*?)</ds:%b>" % (name, name), whole)[1]
    at = drawn.randrange(len(text))
    key = b"<ds:KeyValue>%b</ds:KeyValue>" % text
    other = drawn.choice(
        (
            whole.replace(text, _put(text, at, drawn.choice((b"\n", b" ", b"=", b"!", b"A")))),
            whole.replace(text, _put(text, at, bytes([drawn.choice(b"ABCDEFabcdef0189+/=")]), 1)),
            whole.replace(b"<ds:X509Data>", key + b"<ds:X509Data>"),
            whole.replace(b"</ds:KeyInfo>", b"</ds:KeyInfo><ds:Object>%b</ds:Object>" % text),
            re.sub(rb"<ds:KeyInfo>.*</ds:KeyInfo>", b"", whole),
            whole.replace(
                b"ecdsa-sha256", drawn.choice((b"hmac-sha256", b"rsa-sha256", b"ecdsa-sha1", b"dsa-sha1"))
            ),
            whole.replace(b"xml-exc-c14n#", drawn.choice((b"xml-exc-c14n#WithComments", b"xml-c14n11"))),
            re.sub(
                rb"<ds:Transform Algorithm=\"[^\"]*\"></ds:Transform>", b"", whole, count=drawn.randint(1, 2)
            ),
            whole + whole,
            b"",
            whole.replace(value, b""),
        )
    )
    return content.replace(whole, other)


def sibling_of_signature(content: bytes, _: Random) -> bytes:
    """Writes the other signature that a curve has: the one edit that changes nothing that was signed."""
    value = re.search(rb"<ds:SignatureValue>(.*)</ds:SignatureValue>", content)[1]
    raw = base64.b64decode(value)
    s = ORDER - int.from_bytes(raw[32:], "big")
    return content.replace(value, base64.b64encode(raw[:32] + s.to_bytes(32, "big")))


def flipped(content: bytes, drawn: Random) -> bytes:
    """Flips a bit."""
    changed = bytearray(content)
    changed[drawn.randrange(len(content))] ^= 1 << drawn.randrange(8)
    return bytes(changed)


def cut(content: bytes, drawn: Random) -> bytes:
    """Cuts out, repeats, puts in or appends a few bytes."""
    place, size = drawn.randrange(len(content)), drawn.randint(1, 9)
    part = content[place : place + size]
    return drawn.choice(
        (
            content[:place] + content[place + size :],
            _put(content, place, part),
            content[:place],
            content + part,
            part + content,
            content + drawn.choice((b"\n", b" ", b"\0", b"<!-- -->", b"%%EOF\n")),
        )
    )


XML_EDITS: Mapping[str, Edit] = {
    each.__name__: each
    for each in (
        *(
            comment_in_number,
            stray_in_text,
            stray_anywhere,
            stray_between_elements,
            namespace,
            attribute,
            reference,
        ),
        *(wrapped, moved, number, encoding, spelling, signature, flipped, cut),
    )
}
"""Edits of an XML."""


# PDF


def flipped_outside_the_signature(content: bytes, drawn: Random) -> bytes:
    """Flips a bit of what is shown, or attached."""
    hole = re.search(rb"/Contents\s*<[0-9A-F]{100,}>", content)
    place = drawn.choice((drawn.randrange(hole.start()), drawn.randrange(hole.end(), len(content))))
    changed = bytearray(content)
    changed[place] ^= 1 << drawn.randrange(8)
    return bytes(changed)


def hole_of_signature(content: bytes, drawn: Random) -> bytes:
    """Changes the bytes that a signature of PDF leaves out: its own."""
    hole = re.search(rb"<([0-9A-F]{100,})>", content)
    inside = hole[1]
    at = drawn.randrange(len(inside))
    other = drawn.choice(
        (
            _put(inside, at, bytes([drawn.choice(b"0123456789ABCDEF")]), 1),
            _put(inside, len(inside) - 1 - drawn.randrange(200), b"1", 1),
            inside.lower(),
            _put(inside, at, drawn.choice((b" ", b"\n", b"g")), 1),
            _put(inside, at, b"><", 2),
            inside[: at // 2 * 2] + b"0" * (len(inside) - at // 2 * 2),
        )
    )
    return _put(content, hole.start(1), other, len(inside))


def sibling_of_pdf_signature(content: bytes, _: Random) -> bytes:
    """Writes the other signature that a curve has, as long as the one of before or a byte longer."""
    hole = re.search(rb"<([0-9A-F]{100,})>", content)
    frame = cms.ContentInfo.load(bytes.fromhex(hole[1].decode()).rstrip(b"\0"))
    (signer,) = frame["content"]["signer_infos"]
    value = DSASignature.load(signer["signature"].native)
    signer["signature"] = DSASignature({"r": value["r"], "s": ORDER - value["s"].native}).dump()
    other = frame.dump(force=True).hex().upper().encode()
    return _put(content, hole.start(1), other.ljust(len(hole[1]), b"0"), len(hole[1]))


def byte_range(content: bytes, drawn: Random) -> bytes:
    """Lets the signature cover less, or other bytes."""
    found = re.search(rb"/ByteRange\s*\[([^\]]*)\]", content)
    numbers = found[1].split()
    at = drawn.randrange(4)
    numbers[at] = str(max(0, int(numbers[at]) + drawn.choice((-1, 1, -40, 40, 10**6)))).encode()
    return _put(content, found.start(1), b" ".join(numbers).ljust(len(found[1])), len(found[1]))


def appended_revision(content: bytes, drawn: Random) -> bytes:
    """Appends a revision, which every reader shows in place of the signed one."""
    writer = IncrementalPdfFileWriter(io.BytesIO(content))
    key = drawn.choice(("/Names", "/Pages", "/AcroForm", "/Outlines", "/Lang"))
    value = drawn.choice((generic.NullObject(), generic.DictionaryObject(), generic.pdf_string("x")))
    writer.root[generic.NameObject(key)] = value
    writer.update_root()
    done = io.BytesIO()
    writer.write(done)
    return done.getvalue()


def rewritten(content: bytes, drawn: Random) -> bytes:
    """Writes the same document anew, as a tool that removes or changes things."""
    done = io.BytesIO()
    with pikepdf.open(io.BytesIO(content)) as document:
        if drawn.random() < 0.5:
            del document.Root.AcroForm, document.pages[0].Annots
        document.save(done, linearize=drawn.random() < 0.3)
    return done.getvalue()


PDF_EDITS: Mapping[str, Edit] = {
    each.__name__: each
    for each in (
        *(flipped_outside_the_signature, hole_of_signature, byte_range, appended_revision, rewritten, cut),
        *(flipped,),
    )
}
"""Edits of a PDF."""
