"""Counts of a campaign: silent wrong numbers, refusals in vain, imperfections that are named, by row."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.flights.wilson import wilson
from benchmarks.honesty.catalogue import CATALOGUE, Imperfection
from benchmarks.honesty.law import MOST_SIGMAS, Judgement
from benchmarks.results import Content


def summary(judgements: Sequence[Judgement]) -> Content:
    """Returns the counts of one procedure."""
    plain = [each for each in judgements if not each.rows]
    silent = [each for each in judgements if each.is_silent_wrong]
    in_vain = sum(each.is_refused_in_vain for each in judgements)
    return {
        "draws": len(judgements),
        "silent": len(silent),
        "silent_interval": list(wilson(len(silent), len(judgements))),
        "silent_seeds": [each.seed for each in silent],
        "refused_in_vain": in_vain,
        "undisturbed": {
            "draws": len(plain),
            "stated": sum(each.stated for each in plain),
            "held": sum(each.held for each in plain),
            "refused": sum(each.code != 0 for each in plain),
        },
        "rows": [
            _row(row, judgements) for row in CATALOGUE if any(row.name in each.rows for each in judgements)
        ],
    }


def _row(row: Imperfection, judgements: Sequence[Judgement]) -> Content:
    drawn = [each for each in judgements if row.name in each.rows]
    size = {each.seed: each.sizes[each.rows.index(row.name)] for each in drawn}
    matters = [each for each in drawn if each.worst > MOST_SIGMAS or each.code]
    named = [each for each in drawn if each.named]
    silent = [each for each in drawn if each.is_silent_wrong]
    return {
        "name": row.name,
        "kind": row.kind,
        "unit": row.unit,
        "draws": len(drawn),
        "silent": len(silent),
        "worst": max((each.worst for each in silent), default=0.0),
        "refused_in_vain": sum(each.is_refused_in_vain for each in drawn),
        "matters": len(matters),
        "named": sum(each.named for each in matters),
        "first_wrong": min((size[each.seed] for each in drawn if each.worst > MOST_SIGMAS), default=None),
        "first_named": min((size[each.seed] for each in named), default=None),
    }
