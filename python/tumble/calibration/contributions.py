"""Which procedure gave what of a calibration that was built up.

`method` gave all that no contribution gave. A procedure that is started from a calibration replaces parts of
it; what it leaves keeps its origin.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from tumble.foundation.plain import plain
from tumble.foundation.provenance import LogFacts
from tumble.foundation.results import Addition, Verdict
from tumble.foundation.units import CALIBRATED_TRIADS, CALIBRATED_UNITS, CalibratedTriad, Triad

NOISE = ("noise_density", "bias_instability", "random_walk")
"""Terms of noise, as keys of a triad."""
NOISE_FOR_FILTERS = ("noise_density_for_filters", "random_walk_for_filters")
"""The same as filters need them, as keys of a triad."""
TEMPERATURE_DRIFT = "temperature_drift"

_KEYS: Mapping[str, Sequence[str]] = {
    "bias": (),
    "matrix": (),
    "g-sensitivity": ("g_sensitivity",),
    "current": ("current",),
    "noise": (*NOISE, *NOISE_FOR_FILTERS),
    "temperature drift": (TEMPERATURE_DRIFT,),
}
"""Parts of a triad by the keys that hold them; bias and matrix are named where they were estimated."""
_OF_THE_MODEL = ("bias", "matrix", "g-sensitivity", "current")
_Sections: TypeAlias = Mapping[Triad, Mapping[str, Any]] | Mapping[CalibratedTriad, Mapping[str, Any]]
_OF_A_CONTRIBUTION = ("method", "software", "date", "operator", "station", "verdict")


def part(triad: CalibratedTriad, name: str) -> str:
    """Names a part of a calibration: `gyroscope noise`."""
    assert name in _KEYS, name
    return f"{triad} {name}"


def added(result: Addition, verdict: Verdict, procedure: str, group: str, found: _Sections) -> dict[str, Any]:
    """Content of the calibration file that a result adds to, with the `group` of parts found of each triad.

    `verdict` is that of the result.
    A triad without a section is given one that leaves its readings as they are.
    """
    options = {key: plain(value) for key, value in result.options.items()}
    run = {
        "gave": tuple(part(triad, group) for triad in found),
        "method": {"procedure": procedure, "options": options},
        "software": result.software,
        "date": result.provenance.date,
        **({"operator": result.provenance.operator} if result.provenance.operator else {}),
        **({"station": result.provenance.station} if result.provenance.station else {}),
        "verdict": verdict,
        "logs": tuple(
            log_content(file, facts) for file, facts in zip(result.sources, result.logs, strict=True)
        ),
    }
    axes = {facts.axes for facts in result.logs if facts.axes}
    before = result.start or {
        "name": result.name,
        "serial": result.serial,
        "axes": axes.pop() if len(axes) == 1 else None,
        "reading": result.logs[0].reading or None if result.logs else None,
    }
    content = _contributed(before, run)
    for triad, new in found.items():
        nothing = {"unit": CALIBRATED_UNITS[triad], "M": np.eye(3), "b": np.zeros(3), "estimated": ()}
        content[triad] = {**content.get(triad, nothing), **new}
    return content


def log_content(file: str, facts: LogFacts) -> dict[str, Any]:
    """Describes a log as calibration files do."""
    return {"file": file, "sha256": facts.sha256, "duration": facts.duration}


def _contributed(before: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """Content of a calibration file, `before`, as one of this version to which a run contributed."""
    kept = {key: value for key, value in before.items() if key not in ("schema", "contributions")}
    return kept | {"contributions": (*_without(before.get("contributions", ()), new["gave"]), new)}


def taken_over(before: Mapping[str, Any], replaced: Sequence[str]) -> dict[str, Any]:
    """Returns the contributors of the part of `before` that the new `method` leaves in place."""
    whole = [*before.get("contributions", ())]
    if "method" in before:
        own = {key: before[key] for key in _OF_A_CONTRIBUTION if key in before}
        logs = [before["log"]] if "log" in before else []
        whole.append({"gave": tuple(_gave(before)), **own, "logs": logs})
    left = tuple(_without(whole, replaced))
    return {"contributions": left} if left else {}


def built_on(before: Mapping[str, Any], found: Mapping[str, Any]) -> dict[str, Any]:
    """Content of the file of a procedure that found M and b, beside noise and temperature drift of `before`.

    A triad that it did not find stays as `before` has it.
    """
    content = dict(found)
    replaced = [part(triad, name) for triad in CALIBRATED_TRIADS if triad in found for name in _OF_THE_MODEL]
    for triad in CALIBRATED_TRIADS:
        kept = before.get(triad, {})
        if triad not in found and kept:
            content[triad] = kept
        for keys in ((*NOISE, *NOISE_FOR_FILTERS), (TEMPERATURE_DRIFT,)):
            if triad in found and any(key in kept for key in keys):
                content[triad] = {**content[triad], **{key: _kept(kept, key) for key in keys}}
    return content | taken_over(before, replaced)


def _kept(section: Mapping[str, Any], key: str) -> Any:  # noqa: ANN401 - what a file holds
    """Returns a part of a section; the covariance of a drift with M and b ends with these."""
    value = section.get(key)
    if key == TEMPERATURE_DRIFT and value is not None:
        return {name: each for name, each in value.items() if name != "covariance"}
    return value


def _gave(content: Mapping[str, Any]) -> Iterator[str]:
    """Lists the parts that `method` gave."""
    by_others = {name for each in content.get("contributions", ()) for name in each["gave"]}
    for triad in CALIBRATED_TRIADS:
        section = content.get(triad, {})
        for name, keys in _KEYS.items():
            found = name in section.get("estimated", ()) or any(key in section for key in keys)
            if found and part(triad, name) not in by_others:
                yield part(triad, name)


def _without(contributions: Sequence[Mapping[str, Any]], replaced: Sequence[str]) -> Iterator[dict[str, Any]]:
    for each in contributions:
        left = tuple(name for name in each["gave"] if name not in replaced)
        if left:
            yield {**each, "gave": left}
