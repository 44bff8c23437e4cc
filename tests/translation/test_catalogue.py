"""Lookup of texts: whole, by template, by parts; names and numbers pass through."""

from __future__ import annotations

import pytest

from tumble.foundation.catalogue import PART, SEAM, TERM, Catalogue, CatalogueText, read_catalogue

ENTRIES = (
    CatalogueText("Done.", "完成。"),
    CatalogueText("unit", "单位"),
    CatalogueText("unit", "单元", "redundancy"),
    CatalogueText("{count} rest", "{count} 个静止段", plural="{count} rests"),
    CatalogueText("{name} was recorded with {counted}", "{name}的记录中有{counted}"),
    CatalogueText("the {triad} of {name} turned by {angle} deg", "{name}的{triad}转了 {angle} deg"),
    CatalogueText("not looked at", "未看", fuzzy=True),
    CatalogueText("bias", "零偏", TERM),
    CatalogueText("gyroscope", "陀螺仪", TERM),
    CatalogueText("{distance} apart", "相差 {distance}", PART),
    *(
        CatalogueText(seam, own, SEAM)
        for seam, own in ((". ", "。"), (".", "。"), (", ", "，"), (" (", "（"), (")", "）"))
    ),
)


@pytest.fixture(scope="module")
def catalogue():
    return Catalogue(ENTRIES)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("done.", "完成。"),
        ("1 rest", "1 个静止段"),
        ("12 rests, 3 rests", "12 个静止段，3 个静止段"),
        ("gyroscope bias x", "陀螺仪零偏 x"),
        ("Gyroscope bias, rad/s", "陀螺仪零偏，rad/s"),
        ("imu_1 was recorded with 3 rests", "imu_1的记录中有3 个静止段"),
        ("bias was recorded with 3 rests", "bias的记录中有3 个静止段"),
        (
            "The gyroscope of left.csv turned by 2.5 deg (5 m apart).",
            "left.csv的陀螺仪转了 2.5 deg（相差 5 m）。",
        ),
        ("Nobody knows this. Done.", "Nobody knows this。完成。"),
        ("rests of nobody", "rests of nobody"),
        ("not looked at", "not looked at"),
        ("0.12 ± 0.03 m/s²", "0.12 ± 0.03 m/s²"),
        ("", ""),
    ],
)
def test_a_text_is_found_whole_by_template_or_by_parts(catalogue, text, found):
    assert catalogue.translated(text) == found


def test_a_context_tells_apart_what_is_alike_in_english(catalogue):
    assert (catalogue.translated("unit"), catalogue.translated("unit", "redundancy")) == ("单位", "单元")


def test_values_are_filled_into_a_text_with_places(catalogue):
    assert catalogue.translated("{count} rests", values={"count": 7}) == "7 个静止段"
    assert catalogue.translated("{count} unknown", values={"count": 7}) == "7 unknown"


def test_a_hostile_name_is_neither_a_pattern_nor_a_place(catalogue):
    for name in ("{count}", "a{0}b", r"\1", "(x|y)*", "\x1b[31m"):
        assert name in catalogue.translated(f"{name} was recorded with 3 rests")


def test_a_file_is_read_as_gettext_has_it(tmp_path):
    path = tmp_path / "tumble.po"
    path.write_text(
        'msgid ""\nmsgstr "Language: zh_CN\\n"\n\n#: a.py\n#, fuzzy\nmsgctxt "c"\nmsgid "a "\n"\\"b\\""\n'
        'msgstr "甲"\n\nmsgid "{count} x"\nmsgid_plural "{count} xs"\nmsgstr[0] "{count} 个"\n\n'
        '#~ msgid "old"\n#~ msgstr "旧"\n\n'
    )
    assert list(read_catalogue(path)) == [
        CatalogueText('a "b"', "甲", "c", fuzzy=True),
        CatalogueText("{count} x", "{count} 个", plural="{count} xs"),
    ]
