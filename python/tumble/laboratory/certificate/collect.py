"""Makes the model of a certificate from results and from what the laboratory states.

A certificate shows nothing that neither the result nor the laboratory holds: what is missing is an error.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

from pydantic import ValidationError

from tumble.calibration.document import Calibration
from tumble.foundation.bounded_yaml import parse
from tumble.foundation.documents import mistake_in
from tumble.foundation.errors import TumbleError
from tumble.foundation.file_status import exists
from tumble.foundation.words import join
from tumble.laboratory.certificate.catalogue import METHODS
from tumble.laboratory.certificate.model import (
    CalibratedItem,
    Certificate,
    CertifiedDecision,
    Condition,
    Environment,
    Equipment,
    Item,
    Laboratory,
    Language,
    Party,
)
from tumble.laboratory.certificate.quantities import models_of, quantities_of
from tumble.laboratory.certificate.standing import standing_in
from tumble.laboratory.registry import SHORT, Registry, UnitFacts
from tumble.laboratory.results import SIMPLE, Result, read_results, runs_of

MODEL_NOT_MET = "model not met"


@dataclass(frozen=True, slots=True)
class Statement:
    """Statements of the laboratory, the same for all certificates that are issued at once."""

    laboratory: str
    address: str
    country: str
    accreditation: str
    customer: str
    customer_address: str
    authorised_by: str
    languages: tuple[Language, ...]
    remarks: tuple[str, ...]


_NEEDED = {
    "laboratory": "name of the laboratory",
    "address": "address of the laboratory",
    "country": "country of the laboratory, such as DE",
    "customer": "name of the customer",
    "customer_address": "address of the customer",
    "authorised_by": "person who authorises certificates",
}


@dataclass(frozen=True, slots=True)
class CollectedResult:
    """A result that is to be certified."""

    result: Result
    condition: Condition
    manufacturer: str
    model: str
    owner: str
    is_on_record: bool = False
    """True where a registry holds it, in which the same recording, calibrated again, is the same result."""


def results_in_files(
    places: Iterable[str], condition: Condition, facts: UnitFacts
) -> Iterator[CollectedResult]:
    """Read results from folders and files; raises `TumbleError`."""
    for place in places:
        found = list(read_results([_existing(place)]))
        if not found:
            raise TumbleError(f"{place}: holds no result of a procedure; give another folder")
        for result in found:
            yield CollectedResult(result, condition, facts.manufacturer, facts.model, facts.owner)


def results_in_registry(
    registry: Registry, places: Iterable[str], condition: Condition, facts: UnitFacts, who: str
) -> Iterator[CollectedResult]:
    """Read results from a registry, to which those in folders and files are added; raises `TumbleError`."""
    for each in _of_registry(registry, places, condition, facts, who):
        _check_reference(registry, each.result)
        yield each


def _of_registry(
    registry: Registry, places: Iterable[str], condition: Condition, facts: UnitFacts, who: str
) -> Iterator[CollectedResult]:
    for place in places:
        if exists(Path(place)):
            # A result on record stays as it is: one without what is needed must not get there.
            for each in read_results([place]):
                _check(each)
            added = registry.add(place, facts=facts, condition=condition, who=who)
            if not added:
                raise TumbleError(f"{place}: holds no result of a procedure; give another folder")
            yield from (_registered(registry, each.identity, condition) for each in added)
        else:
            yield _registered(registry, place, condition)


def _registered(registry: Registry, identity: str, condition: Condition) -> CollectedResult:
    shown = registry.show(identity)
    row, unit = shown.calibration, shown.unit
    name = str(row["calibration"])[:SHORT]
    if shown.superseded_by:
        raise TumbleError(f"result {name}: was superseded by {shown.superseded_by[0][:SHORT]}; give that")
    recorded = cast(Condition, row["condition"])
    if condition and recorded not in ("", condition):
        raise TumbleError(f"result {name}: is on record {recorded}, not {condition}; leave the option out")
    content = registry.document(str(row["document"]))
    calibration = Calibration.model_validate(parse(content.decode("utf-8-sig"))[1])
    result = Result(calibration, content, None, f"result {name}")
    return CollectedResult(
        result,
        recorded or condition,
        str(unit["manufacturer"]),
        str(unit["model"]),
        str(unit["owner"]),
        is_on_record=True,
    )


def certificates_of(
    found: Sequence[CollectedResult], stated: Statement, day: str, supersedes: str = ""
) -> list[Certificate]:
    """Return a certificate for each unit, without its number.

    Raises `TumbleError` where the results or the laboratory lack what a certificate needs.
    """
    missing = [meaning for name, meaning in _NEEDED.items() if not _known(stated, found, name)]
    if missing:
        option = next(name for name in _NEEDED if not _known(stated, found, name)).replace("_", "-")
        raise TumbleError(
            f"no certificate without the {join(missing)}; write it into tumble.toml, or give --{option}"
        )
    units: dict[str, list[CollectedResult]] = {}
    for each in found:
        _check(each.result, is_on_record=each.is_on_record)
        units.setdefault(each.result.calibration.serial, []).append(each)
    return [
        _certificate(serial, _ordered(serial, own), stated, day, supersedes) for serial, own in units.items()
    ]


def _known(stated: Statement, found: Sequence[CollectedResult], name: str) -> bool:
    """Return True if a statement is given; the owner of a unit is its customer."""
    return bool(getattr(stated, name)) or (name == "customer" and all(each.owner for each in found))


def _check(result: Result, *, is_on_record: bool = False) -> None:
    """Raise `TumbleError` where a result holds too little for a certificate, or nothing to certify."""
    run, calibration = result.run, result.calibration
    about = f"{result.source}: no certificate"
    if not all(each.operator for each in runs_of(result.content)):
        remedy = "calibrate a new recording" if is_on_record else "calibrate again"
        raise TumbleError(f"{about}: the result states no operator; {remedy} with --operator NAME")
    if not calibration.serial:
        raise TumbleError(
            f"{about}: the result states no serial, so the unit cannot be told from others; give --serial"
        )
    if not run.date or not run.software:
        raise TumbleError(f"{about}: the result states neither date nor software; calibrate again")
    result.refuse_false_dates()
    reference = calibration.reference and calibration.reference.certificate
    if reference and run.date[:10] < reference.date:
        raise TumbleError(
            f"{about}: the result is of {run.date[:10]}, and the certificate of its reference of "
            f"{reference.date}, after it; calibrate again with the certificate that held then"
        )
    if run.verdict == MODEL_NOT_MET:
        raise TumbleError(f"{about}: the model is not met by the recording; see the page of the result")
    if not any(each.u for each in result.parameters if each.value is not None):
        raise TumbleError(
            f"{about}: the result holds no value with an uncertainty; calibrate by turntable, multipose, "
            "spin or redundancy"
        )


def _check_reference(registry: Registry, result: Result) -> None:
    """Raise `TumbleError` where the certificate of its reference was withdrawn since."""
    reference = result.calibration.reference
    if reference is None or reference.certificate is None:
        return
    if fault := standing_in(registry, reference.certificate).fault:
        raise TumbleError(f"{result.source}: no certificate: of its reference, {fault}")


def _ordered(serial: str, own: Sequence[CollectedResult]) -> list[CollectedResult]:
    """Return the calibrations of a unit, as found and as left; raises `TumbleError` where there are more."""
    before = [each for each in own if each.condition == "as found"]
    after = [each for each in own if each.condition != "as found"]
    if len(before) > 1 or len(after) > 1:
        names = ", ".join(each.result.source for each in own)
        raise TumbleError(
            f"serial {serial}: {len(own)} results are given ({names}); give one, and that of the unit as "
            "found by --as-found"
        )
    if before and after and not after[0].condition:
        after = [replace(after[0], condition="as left")]
    return [*before, *after]


def _certificate(
    serial: str, own: Sequence[CollectedResult], stated: Statement, day: str, supersedes: str
) -> Certificate:
    last = own[-1]
    try:
        return Certificate(
            number="-",
            issued=day,
            languages=stated.languages,
            laboratory=Laboratory(
                name=stated.laboratory,
                address=stated.address,
                country=stated.country,
                accreditation=stated.accreditation,
            ),
            customer=Party(name=stated.customer or last.owner, address=stated.customer_address),
            item=Item(
                name=last.result.calibration.name,
                serial=serial,
                manufacturer=last.manufacturer,
                model=last.model,
            ),
            authorised_by=stated.authorised_by,
            remarks=stated.remarks,
            supersedes=supersedes,
            calibrated=tuple(_calibrated(each) for each in own),
        )
    except ValidationError as error:
        raise TumbleError(
            f"{last.result.source}: no certificate: {mistake_in(error, Certificate)}"
        ) from error


def _calibrated(found: CollectedResult) -> CalibratedItem:
    result, calibration = found.result, found.result.calibration
    temperature, gravity = calibration.temperature, calibration.gravity
    runs = [run for run in runs_of(result.content) if run.date]
    return CalibratedItem(
        condition=found.condition,
        result=result.identity,
        begun=min(run.date for run in runs)[:10],
        day=result.run.date[:10],
        operator=_each_once(run.operator for run in runs),
        station=_each_once(run.station for run in runs),
        procedures=tuple(dict.fromkeys(run.procedure for run in runs if run.procedure in METHODS)),
        software=result.run.software,
        environment=Environment(
            temperature=None
            if temperature is None
            else (temperature.low, temperature.mean, temperature.high),
            gravity=None if gravity is None else gravity.value,
            gravity_source="" if gravity is None else gravity.source,
        ),
        reference=_reference(calibration),
        quantities=tuple(quantities_of(result)),
        models=tuple(models_of(calibration)),
        decision=_decision(result),
    )


def _each_once(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(filter(None, names)))


def _reference(calibration: Calibration) -> Equipment | None:
    reference = calibration.reference
    if reference is None:
        return None
    uncertainty, certificate = reference.uncertainty, reference.certificate
    return Equipment(
        name=reference.name,
        serial=reference.serial,
        accelerometer="" if uncertainty is None else uncertainty.accelerometer,
        gyroscope="" if uncertainty is None else uncertainty.gyroscope,
        certificate="" if certificate is None else certificate.number,
        laboratory="" if certificate is None else certificate.laboratory,
        certified="" if certificate is None else certificate.date,
        due="" if certificate is None else certificate.due,
        sha256="" if certificate is None else certificate.sha256,
    )


def _decision(result: Result) -> CertifiedDecision | None:
    decision = result.calibration.decision
    if decision is not None:
        return CertifiedDecision(rule=decision.rule, guard=decision.guard, verdict=decision.verdict)
    if result.calibration.limits is None or result.run.verdict not in ("pass", "fail"):
        return None
    return CertifiedDecision.model_validate({"rule": SIMPLE, "guard": 0.0, "verdict": result.run.verdict})


def _existing(place: str) -> Path:
    path = Path(place)
    if not exists(path):
        raise TumbleError(f"{place}: no such folder or file; without a registry give one of results")
    return path
