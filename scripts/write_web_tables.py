"""Write the tables that readers of logs and the page in a browser share, as JSON for its bundler.

Names of columns, spellings of units, the evidence for units and words of messages stand in the package;
nothing of them is written twice.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pyarrow.csv  # type: ignore[import-untyped]
from babel.messages.catalog import Message
from babel.messages.pofile import read_po

from tumble import _core
from tumble.acquisition import acquire, messages
from tumble.calibration import document
from tumble.foundation import sample_rates
from tumble.foundation.catalogue import PART, SEAM, catalogue_path
from tumble.foundation.constants import STANDARD_GRAVITY
from tumble.foundation.firmware import ardupilot as firmware_ardupilot
from tumble.foundation.firmware import px4 as px4_firmware
from tumble.foundation.log_time import DATES
from tumble.foundation.results import INTERVAL, LARGEST_ANGLE_OF_SENSORS, LARGEST_WIDENING, SCALES_OF_SENSORS
from tumble.foundation.units import CALIBRATED_UNITS, CHANNELS, TRIADS
from tumble.logs import checks, columns, csv, row_labels, stated_units, text, unit_evidence, units
from tumble.logs.options import COUNTS
from tumble.poses import triads
from tumble.procedures.multipose import messages as of_multipose
from tumble.procedures.multipose import procedure
from tumble.tools.exchange import ardupilot, betaflight, calibration_parts, px4
from tumble.tools.exchange.ardupilot import ARDUPILOT
from tumble.tools.exchange.betaflight import BETAFLIGHT
from tumble.tools.exchange.c_source import C_SOURCE
from tumble.tools.exchange.px4 import PX4


def tables() -> dict[str, Any]:
    """Returns all tables by the part of a reader, or of a procedure, that uses them."""
    return {
        "columns": _columns(),
        "labels": _labels(),
        "text": _text(),
        "units": _units(),
        "checks": _checks(),
        "multipose": _multipose(),
        "exports": _exports(),
        "catalogue": _catalogue(),
        "calibration": {
            "schema": document.SCHEMA,
            "header": document._HEADER,
            "software": f"tumble {_core.__version__}",
        },
    }


def _columns() -> dict[str, Any]:
    def spelled(spellings: Sequence[columns._Spelling]) -> list[dict[str, Any]]:
        return [{"words": list(each.words), "pattern": each.pattern} for each in spellings]

    return {
        "channels": CHANNELS,
        "triads": {name: spelled(each) for name, each in columns._TRIADS.items()},
        "magnetic": spelled(columns._MAGNETIC),
        "scalars": {name: spelled(each) for name, each in columns._SCALARS.items()},
        "counter": columns._COUNTER,
        "ignored": columns._IGNORED.pattern,
        "brackets": columns._BRACKETS.pattern,
        "state": columns._STATE.pattern,
        "leftOut": columns._LEFT_OUT.pattern,
        "axis": columns._AXIS,
        "descriptors": columns._DESCRIPTORS,
        "degrees": columns._DEGREES,
        "longestName": columns._LONGEST_NAME,
        "triadWords": {triad: sorted(words) for triad, words in columns._TRIAD_WORDS.items()},
        "otherWords": sorted(columns._OTHER_WORDS),
    }


def _labels() -> dict[str, Any]:
    return {
        "names": row_labels._SPELLED,
        "most": row_labels.MOST_LABELS,
        "mostWords": row_labels._MOST_WORDS,
        "few": row_labels._FEW,
        "whole": row_labels._WHOLE.pattern,
        "fraction": row_labels._FRACTION.pattern,
        "none": row_labels._NONE,
    }


def _text() -> dict[str, Any]:
    return {
        "headBytes": text._HEAD_BYTES,
        "linesSearched": text._LINES_SEARCHED,
        "rowsSearched": text._ROWS_SEARCHED,
        "rowsCompared": text._ROWS_COMPARED,
        "delimiters": text._DELIMITERS,
        "plainNames": text.PLAIN_NAMES,
        "afterLast": text.AFTER_LAST,
        "timeStamp": text._TIME_STAMP.pattern,
        "nulls": pyarrow.csv.ConvertOptions().null_values,
        "rateKeys": csv.RATE_KEYS,
        "rateFromLine": csv.RATE_FROM_LINE,
        "longestShown": csv._LONGEST_SHOWN,
    }


def _units() -> dict[str, Any]:
    usual = ("IMU_RATE", "DURATION", "RATE_NOISE", "RATE_BIAS", "OPTICAL_NOISE", "OPTICAL_BIAS")
    return {
        "values": units.UNITS,
        "spellings": {each: {**units.IN_WORDS[each], **found} for each, found in units.SPELLINGS.items()},
        "signs": units.SIGNS,
        "shownAtRest": units.SHOWN_AT_REST,
        "since": units.SINCE,
        "noUnit": sorted(stated_units.NO_UNIT),
        "noUnitOfTime": stated_units.NO_UNIT_OF_TIME,
        "longUnitsOfTime": stated_units.LONG_UNITS_OF_TIME,
        "longestUnit": stated_units.LONGEST,
        "descriptor": stated_units.DESCRIPTOR,
        "countsStated": stated_units.COUNTS,
        "likeAUnit": stated_units.LIKE_A_UNIT,
        "temperatureZero": units.TEMPERATURE_ZERO,
        "possibleTemperature": units.POSSIBLE_TEMPERATURE,
        "gravity": STANDARD_GRAVITY,
        "dates": DATES,
        "rates": [units.SLOWEST_HZ, units.FASTEST_HZ],
        "burstsWithin": units._BURSTS_WITHIN,
        "inBurst": units._IN_BURST,
        "window": units._WINDOW,
        "samplesPerSpike": units._SAMPLES_PER_SPIKE,
        "fewSamples": units._FEW_SAMPLES,
        "impossibleRadians": units.IMPOSSIBLE_RAD_PER_S,
        "impossibleDegrees": units._IMPOSSIBLE_DEG_PER_S,
        "largestBiasDegrees": units._LARGEST_BIAS_DEG_PER_S,
        "largestReading": units.LARGEST_READING,
        "largestSi": units.LARGEST_SI,
        "largestTime": units.LARGEST_TIME,
        "ranges": units._RANGES_G,
        "counts": COUNTS,
        "asked": unit_evidence.ASKED,
        "certain": unit_evidence.CERTAIN,
        "usual": {name: asdict(getattr(unit_evidence, name)) for name in usual},
        "optical": unit_evidence.OPTICAL,
        "rateUnits": unit_evidence.RATE_UNITS,
        "countedInFractions": unit_evidence.COUNTED_IN_FRACTIONS,
        "stillNoise": unit_evidence.STILL_NOISE,
        "stillTurn": unit_evidence.STILL_TURN,
        "stretch": unit_evidence._STRETCH,
        "fewest": unit_evidence._FEWEST,
    }


def _checks() -> dict[str, Any]:
    return {
        "shareWithoutNumber": checks._LARGEST_SHARE_WITHOUT_NUMBER,
        "shareOfBadLines": checks._LARGEST_SHARE_OF_BAD_LINES,
        "shareOfClashes": checks._LARGEST_SHARE_OF_CLASHES,
        "spike": checks._SPIKE,
        "smallestSpike": checks._SMALLEST_SPIKE,
        "fewestForSpikes": checks._FEWEST_FOR_SPIKES,
        "shareNotFinite": acquire.LARGEST_SHARE_NOT_FINITE,
        "slowest": sample_rates.SLOWEST,
        "noGravityRatio": acquire.NO_GRAVITY_RATIO,
        "largestGravityRatio": acquire.LARGEST_GRAVITY_RATIO,
        "withoutGravity": acquire.WITHOUT_GRAVITY,
        "surrounding": units._SURROUNDING,
        "restRejections": messages.REST_REJECTIONS,
        "messages": _messages(),
    }


def _messages() -> dict[str, Any]:
    """Returns the texts on recordings, by the names that the page has for them."""
    return {
        "stuck": messages.STUCK,
        "saturatedAtRest": messages.SATURATED_AT_REST,
        "takeTurns": messages.TAKE_TURNS,
        "places": messages.PLACES,
        "stoodStill": messages.STOOD_STILL,
        "notRecorded": messages.NOT_RECORDED,
        "slowRate": sample_rates.TOO_SLOW,
        "corrected": messages.CORRECTED,
        "holds": messages.HOLDS,
        "noRest": messages.NO_REST,
        "atRangeEnd": messages.AT_RANGE_END,
        "firstAt": messages.FIRST_AT,
        "turnsUsed": messages.TURNS_USED,
        "turnsLeftOut": messages.TURNS_LEFT_OUT,
        "andMore": messages.AND_MORE,
        "mostNamed": messages.MOST_NAMED,
        "coarse": messages.COARSE,
        "deadBand": messages.DEAD_BAND,
        "gap": messages.GAP,
        "missing": messages.MISSING,
    }


def _multipose() -> dict[str, Any]:
    return {
        "ownAxes": procedure.OWN_AXES,
        "fewToCheck": procedure.FEW_TO_CHECK,
        "standsOut": procedure.STANDS_OUT,
        "decisive": procedure.DECISIVE,
        "largestNonLinearity": procedure.LARGEST_NON_LINEARITY,
        "notLinear": procedure.NOT_LINEAR,
        "unknowns": procedure._UNKNOWNS,
        "shares": of_multipose._UNKNOWNS,
        "notableShare": of_multipose.NOTABLE_SHARE,
        "sixFaces": of_multipose.SIX_FACES,
        "noSensorHas": of_multipose.NO_SENSOR_HAS,
        "notRandom": of_multipose.NOT_RANDOM,
        "refusals": _refusals(),
        "units": CALIBRATED_UNITS,
        "stimuli": triads._STIMULI,
        "upper": triads.UPPER,
        "veryMany": triads.VERY_MANY,
        "interval": INTERVAL,
        "largestAngle": LARGEST_ANGLE_OF_SENSORS,
        "scales": SCALES_OF_SENSORS,
        "largestWidening": LARGEST_WIDENING,
    }


def _exports() -> dict[str, Any]:
    """Returns what the formats that the page writes state of themselves."""
    return {
        "targets": {
            each.word: {
                "title": each.title,
                "ending": each.ending,
                "axes": each.axes,
                "axesInWords": each.axes_in_words,
                "body": each.body,
                "holds": {triad: list(parts) for triad, parts in each.holds.items() if triad in TRIADS},
                "remarks": each.remarks,
            }
            for each in (C_SOURCE, ARDUPILOT, BETAFLIGHT, PX4)
        },
        "parts": calibration_parts.PARTS[:4],
        "ardupilot": {
            "names": {triad: asdict(firmware_ardupilot.names_of(triad, 1)) for triad in TRIADS},
            "offsetLimit": ardupilot.OFFSET_LIMIT,
            "scaleLimits": ardupilot.SCALE_LIMITS,
            "notZero": ardupilot.NOT_ZERO,
        },
        "px4": {
            "prefixes": {triad: px4_firmware.prefix(triad, 0) for triad in TRIADS},
            "types": {"whole": px4.INT32, "number": px4.FLOAT},
            "scaleLimits": px4.SCALE_LIMITS,
            "largestId": px4.LARGEST_ID,
        },
        "betaflight": {
            "countsPerG": float(BETAFLIGHT.own_settings[0].default or 0),
            "largest": betaflight.LARGEST,
        },
    }


SOURCES = (
    "web/",
    "acquisition/",
    "logs/",
    "procedures/multipose/",
    "poses/",
    "tools/exchange/",
    "foundation/",
)
"""Beginnings of the paths of sources whose texts the page may show, within the package."""


def _catalogue() -> dict[str, dict[str, str]]:
    """Returns the Chinese of texts that the page shows, by text, and of the seams between parts."""
    entries = list(read_po(catalogue_path("zh-CN").open("rb")))
    shown = {
        str(text): str(entry.string)
        for entry in entries
        if entry.id
        and entry.string
        and not entry.fuzzy
        and entry.context in (None, PART)
        and _is_shown(entry)
        for text in (entry.id if isinstance(entry.id, tuple) else (entry.id,))
    }
    seams = {str(entry.id): str(entry.string) for entry in entries if entry.context == SEAM and entry.string}
    return {"texts": shown, "seams": seams}


def _is_shown(entry: Message) -> bool:
    paths = [path.removeprefix("python/tumble/") for path, _ in entry.locations]
    return not paths or any(
        path.startswith(SOURCES) or path.startswith("crates/tumble-lab") for path in paths
    )


def _refusals() -> dict[str, str]:
    """Returns the messages whose text is the same whatever the figures."""
    constant = ("no rests", "no turns", "left-handed gyroscope", "axes coincide", "unsolvable")
    return {word: of_multipose.MESSAGES[word]({}) for word in constant}


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    place = parser.parse_args().file
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps(tables(), ensure_ascii=False, indent=1) + "\n", encoding="utf-8")
