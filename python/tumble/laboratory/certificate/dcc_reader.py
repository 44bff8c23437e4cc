"""Reads a Digital Calibration Certificate that Tumble wrote: the writer, backwards."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from xml.parsers import expat

import numpy as np
from lxml import etree
from pydantic import ValidationError

from tumble.foundation.documents import mistake_in
from tumble.foundation.errors import CalibrationFileError
from tumble.foundation.numbers import number_of
from tumble.foundation.recording import FloatArray
from tumble.foundation.units import TRIADS, UNITS
from tumble.laboratory.certificate.dcc import CONDITIONS, CONFORMITY, DCC, SI, VALUE, XmlElement
from tumble.laboratory.certificate.model import (
    PARAMETERS,
    CalibratedItem,
    Certificate,
    CertifiedDecision,
    CertifiedQuantity,
    Environment,
    Equipment,
    Item,
    Laboratory,
    Party,
    SensorModel,
)
from tumble.laboratory.certificate.si_units import D_SI, FROM_D_SI, unit_of_product

LARGEST = 16 << 20
"""Bytes."""
_SPACES = {"dcc": DCC, "si": SI}
_BLANKS = " \t\r\n"
"""White space of XML."""
_MOST_ATTRIBUTES, _MOST_NAMESPACES = 32, 256
"""Attributes of an element, and declarations of namespaces: ten times as many as certificates have."""
_REMEDY = "give the XML of a certificate that Tumble wrote"


def read_dcc(content: bytes, about: str = "certificate") -> Certificate:
    """Return the certificate that XML states; raises `CalibrationFileError` in one line."""
    root = parse_xml(content, about)
    try:
        return _certificate(root)
    except _MissingPartError as error:
        raise CalibrationFileError(f"{error}; {_REMEDY}", about=about) from error
    except ValidationError as error:
        raise CalibrationFileError(f"{mistake_in(error, Certificate)}; {_REMEDY}", about=about) from error


def parse_xml(content: bytes, about: str) -> XmlElement:
    """Return the root of a certificate: elements, attributes and text alone, as canonical XML keeps them.

    No entity is resolved and nothing is fetched. Raises `CalibrationFileError` in one line where the file
    holds anything else: a signature does not cover a comment, and a reader would take the text before it.
    """
    _refuse_crowded(content, about)
    parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False)
    try:
        root = etree.fromstring(content, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CalibrationFileError(f"is no XML: {reason}; {_REMEDY}", about=about) from error
    if root.tag != f"{{{DCC}}}digitalCalibrationCertificate" or root.getroottree().docinfo.doctype:
        raise CalibrationFileError(f"is no Digital Calibration Certificate; {_REMEDY}", about=about)
    stray = next(_strays(root), None)
    if stray is not None:
        raise CalibrationFileError(f"{stray}, which no certificate has; {_REMEDY}", about=about)
    return root


def _refuse_crowded(content: bytes, about: str) -> None:
    """Refuse crowds of attributes and namespaces: canonical XML takes the square of their number."""
    namespaces = 0

    def begin(_name: str, attributes: dict[str, str]) -> None:
        nonlocal namespaces
        namespaces += sum(name.startswith("xmlns") for name in attributes)
        if len(attributes) > _MOST_ATTRIBUTES or namespaces > _MOST_NAMESPACES:
            line = f"line {reader.CurrentLineNumber}"
            raise CalibrationFileError(
                f"{line}: has more attributes than any certificate; {_REMEDY}", about=about
            )

    def declare(*_type: object) -> None:
        raise CalibrationFileError(f"is no Digital Calibration Certificate; {_REMEDY}", about=about)

    reader = expat.ParserCreate()
    reader.StartElementHandler = begin
    reader.StartDoctypeDeclHandler = declare
    # A file that is no XML is refused with the reason of the parser that reads it.
    with suppress(expat.ExpatError):
        reader.Parse(content, True)


def _strays(root: XmlElement) -> Iterator[str]:
    """Describe parts of a document that are neither elements nor their text."""
    for node in (*root.itersiblings(preceding=True), *root.iter(), *root.itersiblings()):
        if not isinstance(node.tag, str):
            yield f"line {node.sourceline}: holds a comment, an instruction or an entity"
    for node in root.iter():
        beside = node.tail if node is not root else None
        if (len(node) and _is_text(node.text)) or _is_text(beside):
            yield f"line {node.sourceline}: holds text between elements"


def _is_text(text: str | None) -> bool:
    return bool(text and text.strip(_BLANKS))


class _MissingPartError(Exception):
    """A certificate lacks a part, or holds it in another form."""


def _certificate(root: XmlElement) -> Certificate:
    administration = _one(root, "dcc:administrativeData")
    core = _one(administration, "dcc:coreData")
    laboratory = _one(administration, "dcc:calibrationLaboratory")
    item = _one(administration, "dcc:items/dcc:item")
    main = "dcc:respPersons/dcc:respPerson[dcc:mainSigner='true']/dcc:person/dcc:name"
    return Certificate(
        number=_text(core, "dcc:uniqueIdentifier"),
        issued=_text(core, "dcc:issueDate"),
        languages=tuple(_texts(core, "dcc:usedLangCodeISO639_1")),  # type: ignore[arg-type]
        laboratory=Laboratory(
            **_party(_one(laboratory, "dcc:contact")),
            accreditation=_text_or(laboratory, "dcc:calibrationLaboratoryCode"),
        ),
        customer=Party(**_party(_one(administration, "dcc:customer"))),
        item=Item(
            name=_plain(item, "dcc:name"),
            serial=_text(item, "dcc:identifications/dcc:identification/dcc:value"),
            manufacturer=_plain_or(item, "dcc:manufacturer/dcc:name"),
            model=_text_or(item, "dcc:model"),
        ),
        authorised_by=_plain(administration, main),
        remarks=tuple(
            _plain(each, "dcc:declaration")
            for each in administration.iterfind("dcc:statements/dcc:statement", _SPACES)
            if "tumble_remark" in _kinds(each)
        ),
        supersedes=_text_or(core, "dcc:reportAmendedSubstituted/dcc:replacedUniqueIdentifier"),
        calibrated=tuple(
            _calibrated(each)
            for each in root.iterfind("dcc:measurementResults/dcc:measurementResult", _SPACES)
        ),
    )


def _party(contact: XmlElement) -> dict[str, str]:
    return {
        "name": _plain(contact, "dcc:name"),
        "address": _plain(contact, "dcc:location/dcc:further"),
        "country": _text_or(contact, "dcc:location/dcc:countryCode"),
    }


def _calibrated(result: XmlElement) -> CalibratedItem:
    conditions = {written: condition for condition, written in CONDITIONS.items()}
    status = _text_or(result, "dcc:influenceConditions/dcc:influenceCondition/dcc:status")
    facts = {
        kind: each
        for each in result.iterfind("dcc:measurementMetaData/dcc:metaData", _SPACES)
        for kind in _kinds(each)
    }
    operator = _kind(facts, "tumble_operator")
    place = facts.get("tumble_place")
    software = _one(result, "dcc:usedSoftware/dcc:software")
    used = result.iterfind("dcc:usedMethods/dcc:usedMethod", _SPACES)
    equipment = result.find("dcc:measuringEquipments/dcc:measuringEquipment", _SPACES)
    triads = list(result.iterfind("dcc:results/dcc:result", _SPACES))
    return CalibratedItem(
        condition=conditions.get(status, ""),  # type: ignore[arg-type]
        result=_plain(_kind(facts, "tumble_result"), "dcc:declaration"),
        begun=_plain(_kind(facts, "tumble_begun"), "dcc:declaration"),
        day=_text(operator, "dcc:date"),
        operator=_plain(operator, "dcc:declaration"),
        station="" if place is None else _plain(place, "dcc:declaration"),
        procedures=tuple(_ending(_kinds(each), "tumble_") for each in used),
        software=f"{_plain(software, 'dcc:name')} {_text(software, 'dcc:release').removeprefix('v')}",
        environment=_environment(result),
        reference=None if equipment is None else _equipment(equipment),
        quantities=tuple(quantity for each in triads for quantity in _quantities(each)),
        models=tuple(model for each in triads for model in _models(each)),
        decision=_decision(facts),
    )


def _environment(result: XmlElement) -> Environment:
    found = {
        kind: each
        for each in result.iterfind(
            "dcc:influenceConditions/dcc:influenceCondition/dcc:data/dcc:quantity", _SPACES
        )
        for kind in _kinds(each)
    }
    names = ("basic_temperatureMin", "basic_temperature", "basic_temperatureMax")
    temperature = [_value_in("degC", found[name]) for name in names if name in found]
    gravity = found.get("tumble_gravity")
    return Environment(
        temperature=tuple(temperature) if len(temperature) == len(names) else None,  # type: ignore[arg-type]
        gravity=None if gravity is None else _value_in("m/s^2", gravity),
        gravity_source="" if gravity is None else _plain_or(gravity, "dcc:description"),
    )


def _equipment(found: XmlElement) -> Equipment:
    certificate = found.find("dcc:certificate", _SPACES)
    stated = {"name": _plain(found, "dcc:name")}
    if certificate is not None:
        stated["certificate"] = _text(certificate, "dcc:referralID")
        stated["laboratory"] = _plain(certificate, "dcc:referral")
        stated["sha256"] = _text(certificate, "dcc:value")
        described = _plain_or(certificate, "dcc:description")
        stated |= dict(part.split(" ", 1) for part in described.split("; ") if " " in part)
    stated["serial"] = _text_or(found, "dcc:identifications/dcc:identification/dcc:value")
    for quantity in found.iterfind(
        "dcc:measuringEquipmentQuantities/dcc:measuringEquipmentQuantity", _SPACES
    ):
        triad = _ending(_kinds(quantity), "tumble_uncertainty_")
        stated[triad] = _plain(quantity, "dcc:noQuantity")
    return Equipment.model_validate({name: "" if text == "-" else text for name, text in stated.items()})


def _quantities(triad: XmlElement) -> Iterator[CertifiedQuantity]:
    for each in triad.iterfind("dcc:data/dcc:quantity", _SPACES):
        if VALUE not in _kinds(each):
            continue
        parameter = _ending(_kinds(each), "tumble_").replace("_", " ")
        if each.find("dcc:noQuantity", _SPACES) is not None:
            yield CertifiedQuantity(
                parameter=parameter,
                unit=_plain(each, "dcc:description"),
                value=None,
                uncertainty=None,
                coverage_factor=None,
            )
            continue
        real = _one(each, "si:real")
        yield CertifiedQuantity(
            parameter=parameter,
            unit=_unit(_text(real, "si:unit")),
            value=_text(real, "si:value"),
            uncertainty=_text_or(real, "si:expandedUnc/si:uncertainty") or None,
            coverage_factor=_text_or(real, "si:expandedUnc/si:coverageFactor") or None,
        )


def _models(triad: XmlElement) -> Iterator[SensorModel]:
    name = _ending(_kinds(triad), "tumble_")
    values = np.full(len(PARAMETERS), np.nan)
    covariance: FloatArray | None = None
    for each in triad.iterfind("dcc:data/dcc:quantity", _SPACES):
        if not {"tumble_model", "tumble_fixed"} & set(_kinds(each)):
            continue
        column = _one(each, "si:realListXMLList")
        places = [_place(label) for label in _text(column, "si:labelXMLList").split()]
        numbers = [_number(text) for text in _text(column, "si:valueXMLList").split()]
        if len(places) != len(numbers):
            raise _MissingPartError(f"the model of the {name} has {len(numbers)} numbers for {len(places)}")
        if name in TRIADS:
            units = ["1"] * 9 + [UNITS[name]] * 3
            _check_units(column, [units[place] for place in places])
        values[places] = numbers
        if "tumble_model" in _kinds(each):
            covariance = np.full((len(PARAMETERS), len(PARAMETERS)), np.nan)
            covariance[np.ix_(places, places)] = _covariance(column, len(places))
    if np.isnan(values).all():
        return
    if name not in TRIADS or not np.isfinite(values).all():
        raise _MissingPartError(f"the model of the {name} lacks numbers of M or b")
    yield SensorModel(triad=name, M=values[:9].reshape(3, 3), b=values[9:], covariance=covariance)


def _check_units(column: XmlElement, units: Sequence[str]) -> None:
    """Raise `_MissingPartError` unless numbers of a model, and their covariance, are in the units read."""
    of_numbers = _text(column, "si:unitXMLList").split()
    cells = column.iterfind(
        "si:ellipsoidalRegionXMLList/si:covarianceMatrix/si:column/si:covariance/si:unit", _SPACES
    )
    of_products = [each.text or "" for each in cells]
    wanted = [D_SI[unit] for unit in units]
    products = [unit_of_product(first, second) for first in units for second in units]
    if len(of_numbers) != len(wanted) or len(of_products) not in (0, len(products)):
        raise _MissingPartError("a number of a model has no unit")
    for stated, read in (*zip(of_numbers, wanted, strict=True), *zip(of_products, products, strict=False)):
        if stated != read:
            raise _MissingPartError(f"a number of a model is in {stated[:40]!r}, where {read!r} is read")


def _value_in(unit: str, quantity: XmlElement) -> float:
    """Return the value of a quantity; raise `_MissingPartError` unless it is in that unit."""
    stated = _text(quantity, "si:real/si:unit")
    if stated != D_SI[unit]:
        raise _MissingPartError(f"a quantity is in {stated[:40]!r}, where {D_SI[unit]!r} is read")
    return _number(_text(quantity, "si:real/si:value"))


def _covariance(column: XmlElement, size: int) -> FloatArray:
    found = column.iterfind("si:ellipsoidalRegionXMLList/si:covarianceMatrix/si:column", _SPACES)
    rows = [[_number(text) for text in _texts(each, "si:covariance/si:value")] for each in found]
    if [len(row) for row in rows] != [size] * size:
        raise _MissingPartError(f"the covariance of a model is not {size} by {size}")
    return np.array(rows)


def _decision(facts: Mapping[str, XmlElement]) -> CertifiedDecision | None:
    stated = facts.get("basic_conformity")
    if stated is None:
        return None
    verdicts = {written: verdict for verdict, written in CONFORMITY.items()}
    kinds = _kinds(stated)
    return CertifiedDecision.model_validate(
        {
            "rule": "guarded" if "tumble_guarded" in kinds else "simple",
            "guard": _number(_ending(kinds, "tumble_guard_")),
            "verdict": verdicts.get(_text(stated, "dcc:conformity")),
        }
    )


# Elements and their text


def _one(parent: XmlElement, path: str) -> XmlElement:
    found = parent.find(path, _SPACES)
    if found is None:
        raise _MissingPartError(f"{path.rpartition(':')[2]} is missing")
    return found


def _text(parent: XmlElement, path: str) -> str:
    return _one(parent, path).text or ""


def _text_or(parent: XmlElement, path: str) -> str:
    return parent.findtext(path, "", _SPACES) or ""


def _texts(parent: XmlElement, path: str) -> list[str]:
    return [each.text or "" for each in parent.iterfind(path, _SPACES)]


def _plain(parent: XmlElement, path: str) -> str:
    return _text(parent, f"{path}/dcc:content")


def _plain_or(parent: XmlElement, path: str) -> str:
    return _text_or(parent, f"{path}/dcc:content")


def _kinds(element: XmlElement) -> list[str]:
    return str(element.get("refType", "")).split()


def _kind(facts: Mapping[str, XmlElement], kind: str) -> XmlElement:
    if kind not in facts:
        raise _MissingPartError(f"{kind} is missing")
    return facts[kind]


def _ending(kinds: list[str], beginning: str) -> str:
    """Return the rest of the kind that begins like that."""
    for kind in kinds:
        if kind.startswith(beginning):
            return kind.removeprefix(beginning)
    raise _MissingPartError(f"{beginning.rstrip('_')} is missing")


def _place(label: str) -> int:
    if label not in PARAMETERS:
        raise _MissingPartError(f"{label[:20]!r} is no parameter of a model")
    return PARAMETERS.index(label)


def _number(text: str) -> float:
    number = number_of(text)
    if number is None:
        raise _MissingPartError(f"{text[:20]!r} is no number")
    return number


def _unit(written: str) -> str:
    if written not in FROM_D_SI:
        raise _MissingPartError(f"{written[:40]!r} is no unit of a certificate")
    return FROM_D_SI[written]
