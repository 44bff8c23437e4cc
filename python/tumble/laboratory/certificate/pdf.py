"""Sets a certificate as PDF/A-3 with its XML attached, by typst."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from tumble.foundation.errors import TumbleError
from tumble.foundation.units import TRIADS
from tumble.laboratory.certificate import statements
from tumble.laboratory.certificate.catalogue import (
    LABELS,
    TERMS,
    Texts,
    label,
    parameter_name,
    texts,
)
from tumble.laboratory.certificate.logo import Logo
from tumble.laboratory.certificate.model import CalibratedItem, Certificate, CertifiedQuantity, Equipment
from tumble.laboratory.certificate.typesetting import TypesettingError, fonts, set_pdf, set_pdf_in_time
from tumble.report.numbers import readable_unit, typeset

TEMPLATE = Path(__file__).with_name("template.typ")
_FONT = "Libertinus Serif"
"""Font that typst brings along."""
CHINESE_FONTS = (
    "Noto Sans CJK SC",
    "Noto Serif CJK SC",
    "Source Han Sans SC",
    "WenQuanYi Micro Hei",
    "WenQuanYi Zen Hei",
    "Microsoft YaHei",
    "SimSun",
    "PingFang SC",
    "Songti SC",
)
"""Families of fonts with Chinese letters, the preferred ones first."""


def pdf_of(
    certificate: Certificate, xml: bytes, template: Path | None = None, logo: Logo | None = None
) -> bytes:
    """Return a certificate as PDF/A-3b with its XML attached.

    Raises `TumbleError` in one line where a font or picture is missing, or the template is wrong or takes
    more than `typesetting.SET_WITHIN`.
    """
    path = template or TEMPLATE
    inputs = {"certificate": json.dumps(_view(certificate, logo)), "xml": xml.decode()}
    moment = datetime.fromisoformat(certificate.issued).replace(tzinfo=timezone.utc)
    # Our own template is right, and ends by itself: the picture is wrong that it shows.
    about = logo.path if logo and template is None else str(path)
    make = set_pdf if template is None and logo is None else set_pdf_in_time
    try:
        return make(path, inputs, moment)
    except TypesettingError as error:
        raise TumbleError(_in_one_line(error.why, logo), about=about) from error
    except (TimeoutError, EOFError) as error:
        raise TumbleError(f"typst {error}; give a simpler template or logo", about=about) from error


def _in_one_line(message: str, logo: Logo | None) -> str:
    if "font" in message or "could not be displayed" in message:
        return f"a font with all letters of the certificate is missing ({message}); install one"
    return f"typst reports: {message}; correct the template{f', or the logo {logo.path}' if logo else ''}"


def font_families(certificate: Certificate) -> list[str]:
    """Return the fonts of a certificate; raises `TumbleError` where one for Chinese is wanted and missing."""
    installed = set(fonts().families())
    chinese = [family for family in CHINESE_FONTS if family in installed]
    if "zh" in certificate.languages and not chinese:
        raise TumbleError(
            "a certificate in Chinese needs a font with Chinese letters; install one, on Debian the package "
            "fonts-wqy-microhei or fonts-noto-cjk, or give --language en"
        )
    return [_FONT, *chinese[:1]]


def _view(certificate: Certificate, logo: Logo | None) -> dict[str, Any]:
    """Return all that a template shows, in the languages of the certificate."""
    return {
        "certificate": certificate.content(),
        "words": {key: label(key, certificate.languages) for key in LABELS},
        "sentences": dict(statements.general(certificate)),
        "calibrated": [_calibrated(certificate, each) for each in certificate.calibrated],
        "fonts": font_families(certificate),
        "logo": list(logo.content) if logo else None,
    }


def _calibrated(certificate: Certificate, each: CalibratedItem) -> dict[str, Any]:
    languages = certificate.languages
    temperature, gravity = each.environment.temperature, each.environment.gravity
    return {
        "title": label(f"result {each.condition}" if each.condition else "results", languages),
        "methods": list(statements.methods(certificate, each).values()),
        "days": each.day if each.begun == each.day else f"{each.begun} \N{EN DASH} {each.day}",
        "temperature": None if temperature is None else _temperature(*temperature),
        "gravity": None if gravity is None else f"{gravity!r} m/s² ({each.environment.gravity_source})",
        "reference": None if each.reference is None else _reference(each.reference),
        "due": None if each.reference is None else each.reference.due,
        "traceability": statements.traceability(certificate, each),
        "verdict": None if each.decision is None else label(each.decision.verdict, languages),
        "rule": statements.rule(certificate, each),
        "not_shown": statements.not_shown(certificate, each),
        "triads": list(_triads(certificate, each)),
    }


def _temperature(low: float, mean: float, high: float) -> str:
    return f"{mean!r} °C ({low!r} °C … {high!r} °C)".replace("-", "\N{MINUS SIGN}")


def _reference(reference: Equipment) -> str:
    return " ".join(filter(None, (reference.name, reference.serial)))


def _triads(certificate: Certificate, each: CalibratedItem) -> Iterator[dict[str, Any]]:
    for triad in TRIADS:
        rows = [
            _row(certificate, quantity)
            for quantity in each.quantities
            if quantity.parameter.startswith(f"{triad} ")
        ]
        if rows:
            name: Texts = texts(TERMS[triad], certificate.languages)
            yield {"name": name, "rows": rows}


def _row(certificate: Certificate, quantity: CertifiedQuantity) -> dict[str, Any]:
    return {
        "name": parameter_name(quantity.parameter, certificate.languages),
        "value": quantity.value,
        "uncertainty": quantity.uncertainty or "",
        "coverage_factor": quantity.coverage_factor or "",
        "unit": "°" if quantity.unit == "deg" else typeset(readable_unit(quantity.unit)) or "1",
    }
