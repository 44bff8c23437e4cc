"""Every word of the core has its message, and every message is about a word."""

from __future__ import annotations

from importlib import import_module
from typing import get_args

import pytest

from tumble._core import VOCABULARY
from tumble.acquisition.messages import REST_REJECTIONS
from tumble.foundation.procedures import PROCEDURES
from tumble.foundation.results import Verdict
from tumble.logs.aiding import AidingKind
from tumble.procedures.redundancy import messages as redundancy
from tumble.procedures.redundancy.report import text
from tumble.procedures.redundancy.result import FitModel, Sensor
from tumble.procedures.spin import messages as spin
from tumble.procedures.spin.failure import SpinFailureKind
from tumble.procedures.turntable import messages as turntable
from tumble.report.text import VERDICT_SIGNS

OF_PROCEDURES = {
    f"{row.word} error": import_module(f"{row.folder}.messages").MESSAGES
    for row in PROCEDURES
    if f"{row.word} error" in VOCABULARY and row.word != "turntable"
}
"""Messages of each procedure that the core has errors of; the turntable has two kinds, see below."""

STORE = {"corrupt", "against another primary"}
"""Why the store of a host, and not the monitor, rejects a record."""

ONLY_OF_A_LOG = {
    "no rest for long",
    "moved first",
    "bias changed",
    "pushed",
    "tipped",
    "drove",
    "drove a circle",
    "rested too shortly",
    "degrees for radians",
    "miscounted",
}
"""Why a log, and not a robot's stream, shows no spin."""

TABLES = {
    "event": text._EVENTS,
    "withheld": text.REMEDIES["withheld"],
    "refused": text.REMEDIES["refused"],
    "abandoned": text.REMEDIES["abandoned"],
    "record rejected": text.REMEDIES["record rejected"].keys() - STORE,
    "aiding": get_args(AidingKind),
    "aiding left out": text.REMEDIES["aiding left out"],
    "unhealthy": text.REMEDIES["unhealthy"],
    # Where no unit is fit, the title suffices.
    "selected": {*text._SELECTED, "none fit"},
    "sensor": get_args(Sensor),
    "fit_model": get_args(FitModel),
    "setting error": redundancy.MESSAGES,
    **OF_PROCEDURES,
    "spin failure": {kind.value for kind in spin.MESSAGES} - ONLY_OF_A_LOG - REST_REJECTIONS.keys(),
    "rejected rest": REST_REJECTIONS,
    "verdict": get_args(Verdict),
}


@pytest.mark.parametrize("kind", TABLES)
def test_a_table_has_a_message_for_every_word_and_no_other(kind):
    assert set(TABLES[kind]) == set(VOCABULARY[kind])


def test_turntable_errors_are_reported_with_and_without_pairs():
    words = {*VOCABULARY["turntable error"], *VOCABULARY["pairing error"]} - {"pairing"}
    assert set(turntable.MESSAGES) == words


def test_every_code_of_a_spin_has_its_message():
    assert set(spin.MESSAGES) == set(SpinFailureKind)


def test_events_that_carry_a_reason_have_words_for_it():
    assert text.REMEDIES.keys() < set(VOCABULARY["event"])


def test_every_verdict_and_every_state_of_a_unit_has_its_sign():
    assert VERDICT_SIGNS.keys() == set(VOCABULARY["verdict"])
    assert text.STATE_SIGNS.keys() < set(VOCABULARY["event"])


def test_a_word_stands_once_in_its_kind():
    for kind, words in VOCABULARY.items():
        assert len(set(words)) == len(words) > 1, kind
