"""Certificates with any content, and the settings of a laboratory that issues them."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tumble.calibration.document import Calibration
from tumble.foundation.error_decomposition import factor_jacobian
from tumble.laboratory.certificate.model import (
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
from tumble.laboratory.certificate.si_units import D_SI

SETTINGS = {
    "laboratory": "Inertial laboratory",
    "address": "1 Gyro Street, 12345 Town",
    "country": "DE",
    "accreditation": "D-K-00000-01-00",
    "authorised_by": "Dr. Bob",
    "customer": "Acme Robotics",
    "customer_address": "2 Wheel Road, 54321 City",
    "certificate_number": "IMU-{year}-{n:04}",
}
"""Settings of tumble.toml that a certificate needs."""
HOSTILE = ("#{evil}", "<x>&amp;</x>", "$x$ *bold* `raw`", '#read("/etc/passwd")', "]]>", "\\#eval", "@label")
"""Text that typst or XML would run, if it were no text."""
PARAMETERS = ("bias x", "scale y", "non-orthogonality xy", "mounting z", "noise-density x")


def options(**changed) -> list[str]:
    """Settings as options of the command."""
    stated = SETTINGS | changed
    return [
        word for name, value in stated.items() if value for word in (f"--{name.replace('_', '-')}", value)
    ]


def project_file(**changed) -> str:
    """Settings as a tumble.toml."""
    return "".join(f"{name} = '{value}'\n" for name, value in (SETTINGS | changed).items())


def sigmas_of(sigma):
    """(12,) sigmas of bias, scale, non-orthogonality and mounting, rad."""
    pairs = [sigma.non_orthogonality.xy, sigma.non_orthogonality.yz, sigma.non_orthogonality.zx]
    return np.concatenate([sigma.bias, sigma.scale, np.radians([*pairs, *sigma.mounting])])


def with_covariance(calibration: Calibration, seed: int = 1) -> Calibration:
    """The same calibration with a full covariance of M and b, of the sigmas that it states."""
    triad = calibration.accelerometer
    assert triad is not None
    assert triad.sigma is not None
    assert triad.inherited is not None
    own = np.sqrt(sigmas_of(triad.sigma) ** 2 - sigmas_of(triad.inherited.sigma) ** 2)
    root = np.random.default_rng(seed).normal(size=(12, 12))
    root *= (own / np.linalg.norm(root, axis=1))[:, None]
    by_parameters = np.zeros((12, 12))
    by_parameters[:9, 3:] = np.linalg.inv(factor_jacobian(triad.M))
    by_parameters[9:, :3] = np.eye(3)
    covariance = by_parameters @ root @ root.T @ by_parameters.T
    changed = triad.model_copy(update={"covariance": (covariance + covariance.T) / 2.0})
    return calibration.model_copy(update={"accelerometer": changed})


_letters = st.characters(codec="utf-8", exclude_categories=("Cs",))
_text = st.one_of(st.sampled_from(HOSTILE), st.text(_letters, min_size=1, max_size=12)).filter(
    lambda text: text.strip() and text.strip() != "-"
)
_maybe = st.one_of(st.just(""), _text)
_decimal = st.from_regex(r"-?[1-9][0-9]{0,4}(\.[0-9]{1,6})?", fullmatch=True)
_positive = st.from_regex(r"[1-9][0-9]{0,2}\.[0-9]{1,6}", fullmatch=True)
_numbers = st.floats(-1e3, 1e3, allow_nan=False)


@st.composite
def quantities(draw, triad):
    """A number of a triad, with or without uncertainty, or not observable."""
    value = draw(st.one_of(st.none(), _decimal))
    is_uncertain = value is not None and draw(st.booleans())
    return CertifiedQuantity(
        parameter=f"{triad} {draw(st.sampled_from(PARAMETERS))}",
        unit=draw(st.sampled_from(sorted(D_SI))),
        value=value,
        uncertainty=draw(_positive) if is_uncertain else None,
        coverage_factor=draw(st.sampled_from(("1.96", "2.00", "2.45"))) if is_uncertain else None,
    )


@st.composite
def models(draw, triad):
    """M and b of a triad; the covariance is missing, whole, or has gaps."""
    covariance = draw(st.one_of(st.none(), arrays(float, (12, 12), elements=_numbers)))
    if covariance is not None:
        hidden = draw(st.sets(st.integers(0, 11), max_size=11))
        covariance[list(hidden), :] = covariance[:, list(hidden)] = np.nan
    return SensorModel(
        triad=triad,
        M=draw(arrays(float, (3, 3), elements=_numbers)),
        b=draw(arrays(float, (3,), elements=_numbers)),
        covariance=covariance,
    )


@st.composite
def calibrated(draw, condition):
    """One calibration."""
    triads = draw(st.sampled_from((("accelerometer",), ("gyroscope",), ("accelerometer", "gyroscope"))))
    found = [draw(st.lists(quantities(triad), min_size=1, max_size=3)) for triad in triads]
    certificate = draw(_maybe)
    return CalibratedItem(
        condition=condition,
        result="ab" * 32,
        begun="2026-01-05",
        day=draw(st.sampled_from(("2026-01-05", "2026-11-26"))),
        operator=draw(_text),
        station=draw(_maybe),
        procedures=draw(st.sampled_from((("turntable",), ("multipose", "noise"), ("spin", "thermal")))),
        software="tumble 0.1.0",
        environment=Environment(
            temperature=draw(st.one_of(st.none(), st.tuples(_numbers, _numbers, _numbers))),
            gravity=draw(st.one_of(st.none(), st.floats(9.7, 9.9))),
            gravity_source="",
        ),
        reference=draw(
            st.one_of(
                st.none(),
                st.builds(
                    Equipment,
                    name=_text,
                    serial=_maybe,
                    accelerometer=st.sampled_from(("calibration", "grade tactical", "not stated", "")),
                    gyroscope=st.sampled_from(("calibration", "not stated", "")),
                    certificate=st.just(certificate),
                    laboratory=_text if certificate else st.just(""),
                    certified=st.sampled_from(("2026-01-01", "")) if certificate else st.just(""),
                    due=st.sampled_from(("2027-01-01", "")) if certificate else st.just(""),
                    sha256=st.just("cd" * 32 if certificate else ""),
                ),
            )
        ),
        quantities=tuple(quantity for own in found for quantity in own),
        models=tuple(draw(models(triad)) for triad in triads),
        decision=draw(
            st.one_of(
                st.none(),
                st.just(CertifiedDecision(rule="simple", guard=0.0, verdict="pass")),
                st.just(CertifiedDecision(rule="guarded", guard=1.25, verdict="conditional fail")),
            )
        ),
    )


@st.composite
def certificates(draw):
    """Any certificate."""
    conditions = draw(st.sampled_from((("",), ("as left",), ("as found", "as left"))))
    return Certificate(
        number=draw(_text),
        issued="2026-11-27",
        languages=draw(st.sampled_from((("en",), ("en", "zh")))),
        laboratory=Laboratory(
            name=draw(_text), address=draw(_text), country="DE", accreditation=draw(_maybe)
        ),
        customer=Party(name=draw(_text), address=draw(_text), country=draw(st.sampled_from(("", "CN")))),
        item=Item(name=draw(_text), serial=draw(_text), manufacturer=draw(_maybe), model=draw(_maybe)),
        authorised_by=draw(_text),
        remarks=tuple(draw(st.lists(_text, max_size=2))),
        supersedes=draw(_maybe),
        calibrated=tuple(draw(calibrated(condition)) for condition in conditions),
    )


def certificate(languages=("en", "zh"), text="plain", **changed) -> Certificate:
    """A certificate of few numbers, with a text in every place that holds text from outside."""
    whole = CalibratedItem(
        condition="as left",
        result="ab" * 32,
        begun="2026-11-25",
        day="2026-11-26",
        operator=text,
        station=text,
        procedures=("turntable",),
        software="tumble 0.1.0",
        environment=Environment(temperature=(24.5, 25.0, 25.5), gravity=9.81, gravity_source=text),
        reference=Equipment(
            name=text, serial=text, accelerometer="calibration", gyroscope="calibration",
            certificate=text, laboratory=text, certified="2026-01-01", due="2027-01-01", sha256="cd" * 32,
        ),
        quantities=(
            CertifiedQuantity(
                parameter="accelerometer bias x", unit="m/s^2", value="-0.0385", uncertainty="0.0012",
                coverage_factor="2.10",
            ),
            CertifiedQuantity(
                parameter="gyroscope g-sensitivity xy", unit="rad/s per m/s^2", value="0.000117",
                uncertainty="0.000006", coverage_factor="1.96",
            ),
            CertifiedQuantity(
                parameter="gyroscope bias z", unit="rad/s", value=None, uncertainty=None, coverage_factor=None
            ),
        ),
        models=(
            SensorModel(triad="accelerometer", M=np.eye(3), b=np.array([-0.0385, 0.0, 0.0]), covariance=None),
        ),
        decision=CertifiedDecision(rule="guarded", guard=1.0, verdict="conditional pass"),
    )  # fmt: skip
    return Certificate(
        number="IMU-2026-0007",
        issued="2026-11-27",
        languages=languages,
        laboratory=Laboratory(name=text, address=text, country="DE", accreditation=text),
        customer=Party(name=text, address=text),
        item=Item(name=text, serial=text, manufacturer=text, model=text),
        authorised_by=text,
        remarks=(text,),
        supersedes="IMU-2026-0003",
        calibrated=(whole,),
    ).model_copy(update=changed)
