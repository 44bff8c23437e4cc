"""Sentences that a certificate makes about itself and its results, in its languages."""

from __future__ import annotations

from collections.abc import Iterator

from tumble.laboratory.certificate.catalogue import METHODS, SENTENCES, TERMS, Texts, texts
from tumble.laboratory.certificate.model import CalibratedItem, Certificate, Equipment, Language

NOT_STATED = "not stated"
"""Source of an uncertainty of the reference that nobody states."""


def general(certificate: Certificate) -> Iterator[tuple[str, Texts]]:
    """Yield key and sentence of all that holds for the whole certificate."""
    for key in ("uncertainty", "model", "only this item", "only in full"):
        yield key, texts(SENTENCES[key], certificate.languages)
    if certificate.supersedes:
        number = certificate.supersedes
        yield "supersedes", texts(SENTENCES["supersedes"], certificate.languages, number=number)


def methods(certificate: Certificate, each: CalibratedItem) -> dict[str, Texts]:
    """Return the methods by which results were found, by procedure."""
    return {name: texts(METHODS[name], certificate.languages) for name in each.procedures}


def is_traceable(reference: Equipment | None) -> bool:
    """Return True if a reference states the certificate that its uncertainty comes from."""
    return reference is not None and bool(reference.certificate) and NOT_STATED not in sources(reference)


def sources(reference: Equipment) -> tuple[str, ...]:
    """Return the sources of the uncertainty of a reference, each once."""
    return tuple(dict.fromkeys(filter(None, (reference.accelerometer, reference.gyroscope))))


def traceability(certificate: Certificate, each: CalibratedItem) -> Texts:
    """Return the sentence on traceability of results."""
    reference, languages = each.reference, certificate.languages
    if reference is None:
        return texts(SENTENCES["by gravity"], languages)
    if is_traceable(reference):
        return texts(
            SENTENCES["traceable"],
            languages,
            certificate=reference.certificate,
            laboratory=reference.laboratory or "-",
            certified=reference.certified or "-",
        )
    stated = [source for source in sources(reference) if source != NOT_STATED]
    if not stated or NOT_STATED in sources(reference):
        return texts(SENTENCES["relative"], languages)
    return texts(SENTENCES["by data sheet"], languages, source=", ".join(stated))


def rule(certificate: Certificate, each: CalibratedItem) -> Texts | None:
    """Return the decision rule; None where results were held against no limits."""
    if each.decision is None:
        return None
    key = f"rule {each.decision.rule}"
    return texts(SENTENCES[key], certificate.languages, guard=f"{each.decision.guard:g}")


def not_shown(certificate: Certificate, each: CalibratedItem) -> Texts | None:
    """Return the sentence that lists parameters which the data did not show; None where there are none."""
    missing = [quantity.parameter for quantity in each.quantities if quantity.value is None]
    if not missing:
        return None
    found: Texts = {}
    for language in certificate.languages:
        names = ", ".join(_whole_name(name, language) for name in missing)
        found |= texts(SENTENCES["not shown"], [language], parameters=names)
    return found


def _whole_name(parameter: str, language: Language) -> str:
    triad, group, axis = parameter.split(" ")
    sensor, quantity = (texts(TERMS[word], [language])[language] for word in (triad, group))
    return f"{sensor.lower()} {quantity} {axis}"
