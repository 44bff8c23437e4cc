"""Units of Tumble in D-SI, the notation of units in a Digital Calibration Certificate.

Source: D-SI (SmartCom), doi 10.5281/zenodo.3366901: names of units and their powers, joined.
"""

from __future__ import annotations

ONE = r"\one"
D_SI = {
    "1": ONE,
    "deg": r"\degree",
    "degC": r"\degreecelsius",
    "m/s^2": r"\metre\second\tothe{-2}",
    "rad/s": r"\radian\second\tothe{-1}",
    "rad/s per m/s^2": r"\radian\second\metre\tothe{-1}",
    "m/s^2/sqrt(Hz)": r"\metre\second\tothe{-1.5}",
    "rad/s/sqrt(Hz)": r"\radian\second\tothe{-0.5}",
    "m/s^2/s/sqrt(Hz)": r"\metre\second\tothe{-2.5}",
    "rad/s/s/sqrt(Hz)": r"\radian\second\tothe{-1.5}",
}
"""D-SI of each unit that a certificate shows; sqrt(Hz) is s to the power of -1/2."""
FROM_D_SI = {written: unit for unit, written in D_SI.items()}

_PRODUCTS = {
    ("m/s^2", "m/s^2"): r"\metre\tothe{2}\second\tothe{-4}",
    ("rad/s", "rad/s"): r"\radian\tothe{2}\second\tothe{-2}",
}


def unit_of_product(first: str, second: str) -> str:
    """Return the D-SI unit of a covariance of two numbers of a triad's model, each in its own unit."""
    if "1" in (first, second):
        return D_SI[second if first == "1" else first]
    return _PRODUCTS[first, second]
