"""Writes a certificate as a Digital Calibration Certificate (DCC 3.2.1) with units in D-SI 2.1.

Sources: schemas https://ptb.de/dcc and https://ptb.de/si. Behind its first line the file is canonical XML
(C14N), so that the same certificate is the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from lxml import etree

from tumble.foundation.units import TRIADS, UNITS
from tumble.foundation.units import Triad as TriadName
from tumble.laboratory.certificate import statements
from tumble.laboratory.certificate.catalogue import LABELS, TERMS, Texts, label, parameter_name, texts
from tumble.laboratory.certificate.model import (
    PARAMETERS,
    CalibratedItem,
    Certificate,
    CertifiedQuantity,
    Equipment,
    Language,
    Party,
    SensorModel,
)
from tumble.laboratory.certificate.si_units import D_SI, unit_of_product

DCC = "https://ptb.de/dcc"
SI = "https://ptb.de/si"
NAMESPACES = {"dcc": DCC, "si": SI}
"""Namespaces by prefix, all declared at the root."""
VERSION = "3.2.1"
DECLARATION = b'<?xml version="1.0" encoding="UTF-8"?>\n'
PROBABILITY = "0.95"
REGION_FACTORS = (
    *("1.960", "2.448", "2.795", "3.080", "3.327", "3.548", "3.751", "3.938", "4.113", "4.279"),
    *("4.436", "4.585"),
)
"""Coverage factors of ellipsoids that hold 95 % in 1 to 12 dimensions: roots of quantiles of chi-square."""
VALUE = "basic_measuredValue"
CONDITIONS = {"as found": "beforeAdjustment", "as left": "afterAdjustment"}
CONFORMITY = {
    "pass": "pass",
    "conditional pass": "conditionalPass",
    "conditional fail": "conditionalFail",
    "fail": "fail",
}

XmlElement: TypeAlias = Any
"""Element of lxml, whose type has no public name."""


def dcc_of(certificate: Certificate) -> bytes:
    """Return a certificate as XML."""
    return serialized(_Writer(certificate).whole())


def serialized(root: XmlElement) -> bytes:
    """Return a document as the bytes that are written: canonical XML behind its declaration."""
    written: bytes = etree.tostring(root, method="c14n")
    return DECLARATION + written


class _Writer:
    def __init__(self, certificate: Certificate) -> None:
        self.certificate = certificate
        self.languages: tuple[Language, ...] = certificate.languages

    def whole(self) -> XmlElement:
        root = etree.Element(
            f"{{{DCC}}}digitalCalibrationCertificate",
            {"schemaVersion": VERSION},
            nsmap=NAMESPACES,
        )
        self._administration(_add(root, "administrativeData"))
        results = _add(root, "measurementResults")
        for each in self.certificate.calibrated:
            self._calibration(_add(results, "measurementResult"), each)
        return root

    # Administrative data

    def _administration(self, parent: XmlElement) -> None:
        certificate = self.certificate
        self._software(parent, "dccSoftware", certificate.calibrated[-1].software)
        definition = _add(_add(parent, "refTypeDefinitions"), "refTypeDefinition")
        self._plain(_add(definition, "name"), "Tumble")
        _add(definition, "namespace", "tumble")
        _add(definition, "link", "https://ptb.de/dcc")
        self._core(_add(parent, "coreData"))
        item = _add(_add(parent, "items"), "item")
        self._plain(_add(item, "name"), certificate.item.name)
        self._texts(_add(item, "description"), label("inertial unit", self.languages))
        if certificate.item.manufacturer:
            self._plain(_add(_add(item, "manufacturer"), "name"), certificate.item.manufacturer)
        if certificate.item.model:
            _add(item, "model", certificate.item.model)
        self._serial(item, certificate.item.serial)
        laboratory = _add(parent, "calibrationLaboratory")
        if certificate.laboratory.accreditation:
            _add(laboratory, "calibrationLaboratoryCode", certificate.laboratory.accreditation)
        self._contact(_add(laboratory, "contact"), certificate.laboratory)
        people = _add(parent, "respPersons")
        self._person(people, certificate.authorised_by, "authorised", is_main=True)
        for name in dict.fromkeys(each.operator for each in certificate.calibrated):
            self._person(people, name, "operator", is_main=False)
        self._contact(_add(parent, "customer"), certificate.customer)
        stated = _add(parent, "statements")
        for key, sentence in statements.general(certificate):
            self._statement(stated, key, sentence)
        for remark in certificate.remarks:
            self._plain(_add(_add(stated, "statement", refType="tumble_remark"), "declaration"), remark)

    def _core(self, parent: XmlElement) -> None:
        certificate = self.certificate
        _add(parent, "countryCodeISO3166_1", certificate.laboratory.country)
        for language in self.languages:
            _add(parent, "usedLangCodeISO639_1", language)
        _add(parent, "mandatoryLangCodeISO639_1", self.languages[0])
        _add(parent, "uniqueIdentifier", certificate.number)
        _add(parent, "beginPerformanceDate", min(each.begun for each in certificate.calibrated))
        _add(parent, "endPerformanceDate", max(each.day for each in certificate.calibrated))
        _add(parent, "performanceLocation", "laboratory")
        _add(parent, "issueDate", certificate.issued)
        if certificate.supersedes:
            replaced = _add(parent, "reportAmendedSubstituted")
            _add(replaced, "typeOfChange", "substituted")
            _add(replaced, "replacedUniqueIdentifier", certificate.supersedes)

    def _contact(self, parent: XmlElement, party: Party) -> None:
        self._plain(_add(parent, "name"), party.name)
        place = _add(parent, "location")
        if party.country:
            _add(place, "countryCode", party.country)
        self._plain(_add(place, "further"), party.address)

    def _person(self, parent: XmlElement, name: str, role: str, *, is_main: bool) -> None:
        person = _add(parent, "respPerson")
        self._plain(_add(_add(person, "person"), "name"), name)
        _add(person, "role", role)
        if is_main:
            _add(person, "mainSigner", "true")

    def _serial(self, parent: XmlElement, serial: str) -> None:
        found = _add(_add(parent, "identifications"), "identification")
        _add(found, "issuer", "manufacturer")
        _add(found, "value", serial)
        self._texts(_add(found, "name"), label("serial", self.languages))

    def _software(self, parent: XmlElement, name: str, text: str) -> None:
        software = _add(_add(parent, name), "software")
        program, _, version = text.partition(" ")
        self._plain(_add(software, "name"), program)
        _add(software, "release", f"v{version}")

    # Results

    def _calibration(self, parent: XmlElement, each: CalibratedItem) -> None:
        title = f"result {each.condition}" if each.condition else "results"
        self._texts(_add(parent, "name"), label(title, self.languages))
        methods = _add(parent, "usedMethods")
        for procedure, sentence in statements.methods(self.certificate, each).items():
            used = _add(methods, "usedMethod", refType=f"tumble_{procedure}")
            self._texts(_add(used, "name"), label("method", self.languages))
            self._texts(_add(used, "description"), sentence)
        self._software(parent, "usedSoftware", each.software)
        if each.reference is not None:
            self._reference(_add(parent, "measuringEquipments"), each.reference)
        self._conditions(_add(parent, "influenceConditions"), each)
        found = _add(parent, "results")
        for triad in TRIADS:
            quantities = [one for one in each.quantities if one.parameter.startswith(f"{triad} ")]
            models = [model for model in each.models if model.triad == triad]
            if quantities or models:
                self._triad(_add(found, "result", refType=f"tumble_{triad}"), triad, quantities, models)
        self._facts(_add(parent, "measurementMetaData"), each)

    def _reference(self, parent: XmlElement, reference: Equipment) -> None:
        found = _add(parent, "measuringEquipment", refType="basic_normalUsed")
        self._plain(_add(found, "name"), reference.name)
        if reference.certificate:
            certificate = _add(found, "certificate")
            self._plain(_add(certificate, "referral"), reference.laboratory or "-")
            _add(certificate, "referralID", reference.certificate)
            _add(certificate, "procedure", "SHA-256")
            _add(certificate, "value", reference.sha256 or "-")
            stated = {"certified": reference.certified, "due": reference.due}
            if any(stated.values()):
                self._plain(_add(certificate, "description"), _packed(stated))
        if reference.serial:
            self._serial(found, reference.serial)
        quantities = _add(found, "measuringEquipmentQuantities")
        for triad in TRIADS:
            quantity = _add(quantities, "measuringEquipmentQuantity", refType=f"tumble_uncertainty_{triad}")
            self._texts(_add(quantity, "name"), texts(TERMS[triad], self.languages))
            self._plain(_add(quantity, "noQuantity"), getattr(reference, triad) or "-")

    def _conditions(self, parent: XmlElement, each: CalibratedItem) -> None:
        environment = each.environment
        data = self._condition(parent, "condition", each, "tumble_condition")
        self._texts(_add(data, "text"), label(each.condition or "no condition", self.languages))
        if environment.temperature is not None:
            data = self._condition(parent, "temperature", each, "basic_temperature")
            for name, value in zip(
                ("temperatureMin", "temperature", "temperatureMax"), environment.temperature, strict=True
            ):
                self._real(_add(data, "quantity", refType=f"basic_{name}"), "temperature", value, "degC")
        if environment.gravity is not None:
            data = self._condition(parent, "gravity", each, "tumble_gravity")
            quantity = _add(data, "quantity", refType="tumble_gravity")
            self._real(quantity, "gravity", environment.gravity, "m/s^2", environment.gravity_source)

    def _condition(self, parent: XmlElement, key: str, each: CalibratedItem, kind: str) -> XmlElement:
        found = _add(parent, "influenceCondition", refType=kind)
        self._texts(_add(found, "name"), label(key, self.languages))
        if each.condition:
            _add(found, "status", CONDITIONS[each.condition])
        return _add(found, "data")

    def _real(self, parent: XmlElement, key: str, value: float, unit: str, remark: str = "") -> None:
        self._texts(_add(parent, "name"), label(key, self.languages))
        if remark:
            self._plain(_add(parent, "description"), remark)
        real = _add_si(parent, "real")
        _add_si(real, "value", number(value))
        _add_si(real, "unit", D_SI[unit])

    def _triad(
        self,
        parent: XmlElement,
        triad: TriadName,
        found: Iterable[CertifiedQuantity],
        models: Iterable[SensorModel],
    ) -> None:
        self._texts(_add(parent, "name"), texts(TERMS[triad], self.languages))
        data = _add(parent, "data")
        for each in found:
            self._quantity(data, each)
        for model in models:
            places = model.shown
            rest = tuple(place for place in range(len(PARAMETERS)) if place not in places)
            if places:
                self._model(data, "sensor model", "tumble_model", model, places, with_covariance=True)
            if rest:
                self._model(data, "fixed parameters", "tumble_fixed", model, rest, with_covariance=False)

    def _quantity(self, parent: XmlElement, each: CertifiedQuantity) -> None:
        kind = "tumble_" + each.parameter.replace(" ", "_")
        found = _add(parent, "quantity", refType=f"{VALUE} {kind}")
        self._texts(_add(found, "name"), parameter_name(each.parameter, self.languages))
        if each.value is None:
            self._plain(_add(found, "description"), each.unit)
            self._texts(_add(found, "noQuantity"), label("not observable", self.languages))
            return
        real = _add_si(found, "real")
        _add_si(real, "value", each.value)
        _add_si(real, "unit", D_SI[each.unit])
        if each.uncertainty is not None:
            expanded = _add_si(real, "expandedUnc")
            _add_si(expanded, "uncertainty", each.uncertainty)
            _add_si(expanded, "coverageFactor", str(each.coverage_factor))
            _add_si(expanded, "coverageProbability", PROBABILITY)
            _add_si(expanded, "distribution", "normal")

    def _model(
        self,
        parent: XmlElement,
        key: str,
        kind: str,
        model: SensorModel,
        places: tuple[int, ...],
        *,
        with_covariance: bool,
    ) -> None:
        values = [*model.M.ravel(), *model.b]
        units = ["1"] * 9 + [UNITS[model.triad]] * 3
        found = _add(parent, "quantity", refType=kind)
        self._texts(_add(found, "name"), label(key, self.languages))
        column = _add_si(found, "realListXMLList")
        _add_si(column, "labelXMLList", " ".join(PARAMETERS[place] for place in places))
        _add_si(column, "valueXMLList", " ".join(number(values[place]) for place in places))
        _add_si(column, "unitXMLList", " ".join(D_SI[units[place]] for place in places))
        if with_covariance and model.covariance is not None:
            region = _add_si(column, "ellipsoidalRegionXMLList")
            matrix = _add_si(region, "covarianceMatrix")
            for first in places:
                line = _add_si(matrix, "column")
                for second in places:
                    cell = _add_si(line, "covariance")
                    _add_si(cell, "value", number(model.covariance[first, second]))
                    _add_si(cell, "unit", unit_of_product(units[first], units[second]))
            _add_si(region, "coverageFactor", REGION_FACTORS[len(places) - 1])
            _add_si(region, "coverageProbability", PROBABILITY)
            _add_si(region, "distribution", "normal")

    def _facts(self, parent: XmlElement, each: CalibratedItem) -> None:
        self._fact(parent, "result", each.result)
        self._fact(parent, "begun", each.begun)
        self._fact(parent, "operator", each.operator, day=each.day)
        if each.station:
            self._fact(parent, "place", each.station)
        found = _add(parent, "metaData", refType="tumble_traceability")
        self._texts(_add(found, "name"), label("traceability", self.languages))
        _add(found, "traceable", "true" if statements.is_traceable(each.reference) else "false")
        self._texts(_add(found, "declaration"), statements.traceability(self.certificate, each))
        rule = statements.rule(self.certificate, each)
        if each.decision is not None and rule is not None:
            kind = f"basic_conformity tumble_{each.decision.rule} tumble_guard_{each.decision.guard!r}"
            found = _add(parent, "metaData", refType=kind)
            self._texts(_add(found, "name"), label("conformity", self.languages))
            self._texts(_add(found, "declaration"), rule)
            _add(found, "conformity", CONFORMITY[each.decision.verdict])

    def _fact(self, parent: XmlElement, key: str, text: str, day: str = "") -> None:
        found = _add(parent, "metaData", refType=f"tumble_{key}")
        self._texts(_add(found, "name"), label(key, self.languages))
        self._plain(_add(found, "declaration"), text)
        if day:
            _add(found, "date", day)

    def _statement(self, parent: XmlElement, key: str, sentence: Texts) -> None:
        found = _add(parent, "statement", refType="tumble_" + key.replace(" ", "_"))
        if key in LABELS:
            self._texts(_add(found, "name"), label(key, self.languages))
        self._texts(_add(found, "declaration"), sentence)

    # Text

    def _texts(self, parent: XmlElement, found: Mapping[str, str]) -> None:
        for language, text in found.items():
            _add(parent, "content", text, lang=language)

    def _plain(self, parent: XmlElement, text: str) -> None:
        _add(parent, "content", text)


def number(value: float) -> str:
    """Return a number so that it reads back bit by bit, as D-SI writes it."""
    if not math.isfinite(value):
        raise ValueError("a certificate shows finite numbers only")
    return repr(float(value))


def _packed(stated: Mapping[str, str]) -> str:
    return "; ".join(f"{name} {value}" for name, value in stated.items() if value)


def _add(parent: XmlElement, name: str, text: str | None = None, **attributes: str) -> XmlElement:
    return _child(parent, DCC, name, text, attributes)


def _add_si(parent: XmlElement, name: str, text: str | None = None) -> XmlElement:
    return _child(parent, SI, name, text, {})


def _child(
    parent: XmlElement, space: str, name: str, text: str | None, attributes: Mapping[str, str]
) -> XmlElement:
    found = etree.SubElement(parent, f"{{{space}}}{name}", dict(attributes))
    found.text = text
    return found
