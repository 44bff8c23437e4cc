"""The language of a context: from the environment, from a browser, for a block."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from tumble.foundation.errors import TumbleError
from tumble.foundation.translation import (
    accepted_language,
    language,
    language_of_environment,
    speaking,
    translated,
)
from turntable_sessions import typed


@pytest.mark.parametrize(
    ("environment", "code"),
    [
        ({}, "en"),
        ({"LANG": "zh_CN.UTF-8"}, "zh-CN"),
        ({"LANG": "zh_CN.UTF-8", "LC_ALL": "C"}, "en"),
        ({"LANG": "C", "LC_MESSAGES": "zh_SG.GB2312"}, "zh-CN"),
        ({"LANG": "zh_TW.UTF-8"}, "en"),
        ({"LANG": "de_DE.UTF-8"}, "en"),
        ({"LANG": "en_US.UTF-8", "TUMBLE_LANG": "zh-Hans"}, "zh-CN"),
        ({"LANG": "zh_CN.UTF-8", "TUMBLE_LANG": "en"}, "en"),
    ],
)
def test_the_environment_chooses_the_language(environment, code):
    assert language_of_environment(environment) == code


@pytest.mark.parametrize(
    ("header", "code"),
    [
        ("", "en"),
        ("zh-CN,zh;q=0.9,en;q=0.8", "zh-CN"),
        ("en;q=0.3, zh;q=0.7", "zh-CN"),
        ("de, fr;q=0.9", "en"),
        ("zh;q=0, en;q=0.1", "en"),
        ("zh-TW, en;q=0.5", "en"),
        ("zh;q=much, ;;;", "en"),
    ],
)
def test_a_browser_chooses_the_language(header, code):
    assert accepted_language(header) == code


def test_a_language_that_is_none_is_a_mistake_of_one_line(monkeypatch):
    monkeypatch.setenv("TUMBLE_LANG", "klingon")
    done = typed("formats")
    assert done.code == 2
    assert done.err == "tumble: error: TUMBLE_LANG: no language 'klingon'; give en or zh-CN\n"


def test_a_language_holds_for_a_block_of_one_thread():
    with ThreadPoolExecutor(1) as other, speaking("zh-CN"):
        assert (language(), other.submit(language).result()) == ("zh-CN", "en")
        with pytest.raises(TumbleError), speaking("xx"):
            pass
        assert translated("bias") == "零偏"
    assert (language(), translated("bias")) == ("en", "bias")


def test_english_reads_no_catalogue():
    program = (
        "from tumble.foundation.translation import translated; assert translated('{n} m', n=1) == '1 m';"
        "assert not {'tumble.foundation.catalogue', 'json', 'typing'} & set(sys.modules)"
    )
    subprocess.run(
        [sys.executable, "-S", "-c", f"import sys; sys.path[:] = {sys.path!r}; {program}"], check=True
    )


def test_errors_are_translated_and_json_stays_english(monkeypatch):
    monkeypatch.setenv("TUMBLE_LANG", "zh-CN")
    done = typed("spin", "nothing.csv", "--json")
    assert done.err == "tumble: 错误: nothing.csv：没有这个文件或文件夹；请检查路径\n"
    assert '"message": "nothing.csv: no such file or folder; check the path"' in done.out
    assert language() == "en"
