"""Words of certificates, which are in several languages at once; a text is one text for each.

The words here are English. Those of another language are in its catalogue, with the context `certificate`, as
a certificate uses the terms of accreditation, which are not those of a page everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from tumble.foundation.errors import TumbleError
from tumble.foundation.translation import speaking, translated
from tumble.laboratory.certificate.model import Language

Texts: TypeAlias = dict[str, str]
"""One text for each language, by its code."""
CONTEXT = "certificate"
"""Context of these words in a catalogue."""

LABELS: Mapping[str, str] = {
    "title": "Calibration certificate",
    "number": "Number",
    "page": "Page",
    "of": "of",
    "laboratory": "Laboratory",
    "accreditation": "Accreditation",
    "customer": "Customer",
    "item": "Item",
    "inertial unit": "Inertial measurement unit",
    "manufacturer": "Manufacturer",
    "model": "Model",
    "serial": "Serial number",
    "name": "Name",
    "address": "Address",
    "issued": "Date of issue",
    "calibrated": "Date of calibration",
    "condition": "Condition",
    "begun": "Calibration begun",
    "place": "Place",
    "method": "Method",
    "software": "Software",
    "environment": "Environment",
    "temperature": "Temperature of the sensor",
    "gravity": "Gravity",
    "traceability": "Traceability",
    "reference": "Reference",
    "due": "Reference valid until",
    "results": "Results",
    "parameter": "Parameter",
    "value": "Value",
    "expanded uncertainty": "Expanded uncertainty U",
    "uncertainty": "U",
    "coverage factor": "k",
    "unit": "Unit",
    "conformity": "Conformity",
    "remarks": "Deviations and remarks",
    "operator": "Calibrated by",
    "authorised": "Authorised by",
    "result": "Result",
    "result as found": "Results as found",
    "result as left": "Results as left",
    "as found": "As found",
    "as left": "As left",
    "not observable": "not observable",
    "sensor model": "Sensor model",
    "fixed parameters": "Sensor model: parameters without uncertainty",
    "no condition": "Not recorded",
    "pass": "Pass",
    "conditional pass": "Conditional pass",
    "conditional fail": "Conditional fail",
    "fail": "Fail",
    "attached": "The attached XML holds the same numbers",
}
"""Words and short phrases."""

TERMS: Mapping[str, str] = {
    "accelerometer": "Accelerometer",
    "gyroscope": "Gyroscope",
    "bias": "bias",
    "scale": "scale",
    "non-orthogonality": "non-orthogonality",
    "mounting": "mounting",
    "g-sensitivity": "g-sensitivity",
    "noise-density": "noise density",
    "bias-instability": "bias instability",
    "random-walk": "random walk",
}
"""Triads and groups of parameters."""

METHODS: Mapping[str, str] = {
    "turntable": (
        "Comparison with a co-mounted reference unit at rests and turns on a turntable; least squares."
    ),
    "multipose": "Rests in many orientations, against the magnitude of gravity; least squares.",
    "spin": "Rest and turns on the spot of a vehicle, against gravity; least squares.",
    "redundancy": "Comparison with the primary of a redundant set in motion; least squares.",
    "noise": "Allan deviation of a recording at rest.",
    "thermal": "Rests at many temperatures; polynomials of bias and scale.",
}
"""Method of each procedure."""

SENTENCES: Mapping[str, str] = {
    "only in full": (
        "This certificate may be reproduced only in full, unless the laboratory agrees in writing."
    ),
    "only this item": "The results relate only to the item calibrated, on the dates stated.",
    "model": (
        "The sensor reads y = M u + b, where u is the truth in the frame of the case; M = K L Q: scale, "
        "non-orthogonality, mounting. M and b with their covariance are in the attached XML."
    ),
    "uncertainty": (
        "U is the expanded uncertainty: the standard uncertainty times k, for a coverage probability of 95 % "
        "(JCGM 100). Values without U are for information."
    ),
    "rule simple": (
        "Decision rule: simple acceptance; a value within its limit passes, whatever its uncertainty "
        "(ILAC-G8:09, 4.2.1)."
    ),
    "rule guarded": (
        "Decision rule: guarded acceptance; the acceptance limit is the limit less {guard} U "
        "(ILAC-G8:09, 4.2.3)."
    ),
    "traceable": "Traceable by certificate {certificate} of {laboratory}, calibrated {certified}.",
    "by data sheet": (
        "The uncertainty of the reference is that of {source}, no certificate: no traceability is claimed."
    ),
    "relative": (
        "No uncertainty of the reference is stated: results are relative to it, no traceability is claimed."
    ),
    "by gravity": "No reference unit was used; no traceability is claimed.",
    "not shown": "The data did not show: {parameters}.",
    "supersedes": "This certificate replaces certificate {number}.",
}


def texts(text: str, languages: Sequence[Language], **values: str) -> Texts:
    """Return a text of this module in each language, with values from outside in its places."""
    found: Texts = {}
    for language in languages:
        with speaking(language):
            found[language] = translated(text, context=CONTEXT).format(**values)
    return found


def label(key: str, languages: Sequence[Language]) -> Texts:
    """Return a label in each language."""
    return texts(LABELS[key], languages)


def parameter_name(parameter: str, languages: Sequence[Language]) -> Texts:
    """Return `bias x` of `accelerometer bias x` in each language."""
    _, group, axis = parameter.split(" ")
    return {language: f"{name} {axis}" for language, name in texts(TERMS[group], languages).items()}


def languages_of(setting: str) -> tuple[Language, ...]:
    """Return the languages of the setting `language`; raises `TumbleError`."""
    known: dict[str, tuple[Language, ...]] = {"": ("en",), "en": ("en",), "en,zh": ("en", "zh")}
    if setting not in known:
        raise TumbleError(f"--language {setting}: give en or en,zh")
    return known[setting]
