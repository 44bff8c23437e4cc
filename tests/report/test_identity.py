"""Every page carries whose result it is, when and by whom: on the first screen, and at the foot of prints."""

from __future__ import annotations

import os
import re
import shutil
import subprocess

import pytest

from dated_logs import QUICK
from patience import PATIENCE
from tumble.foundation.provenance import Provenance
from tumble.report.identity import Identity, css_string
from turntable_sessions import typed

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Pages of procedures as they are typed, of one operator."""
    folder = tmp_path_factory.mktemp("pages")
    options = ("--operator", "J. Doe", "--serial", "SN-5", "-o", folder)
    for kind, words in {
        "spin": ("spin",),
        "multipose": ("multipose",),
        "static": ("noise",),
        "thermal": ("thermal",),
    }.items():
        assert typed("simulate", kind, "--seed", "7", *QUICK.get(kind, ()), "-o", folder / "logs").code == 0
        assert typed(*words, folder / "logs" / f"{kind}.csv", *options).code in (0, 3)
    both = (folder / "spin.yaml", folder / "multipose.yaml")
    assert typed("compare", *both, "--operator", "J. Doe", "-o", folder).code in (0, 3)
    return {path.name: path for path in folder.glob("*.html")}


def test_the_first_screen_has_date_serial_and_operator(pages):
    assert len(pages) == 5
    for name, path in pages.items():
        head = path.read_text().split("<main>")[1].split("<h1>")[0]
        words = " ".join(re.sub("<[^>]*>", " ", head).split())
        assert re.search(r"date \d{4}-\d\d-\d\d \d\d:\d\d UTC", words), name
        assert "SN-5" in words, name
        assert "operator J. Doe" in words, name


@pytest.mark.skipif(BROWSER is None and "CI" not in os.environ, reason="chromium is not installed")
def test_each_printed_page_has_its_number_of_how_many(pages, tmp_path):
    path = pages["multipose.html"]
    quiet = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking")
    out = tmp_path / "page.pdf"
    words = [BROWSER, *quiet, "--no-pdf-header-footer", f"--print-to-pdf={out}", path.as_uri()]
    subprocess.run(words, check=True, capture_output=True, timeout=PATIENCE)
    text = subprocess.run(["pdftotext", out, "-"], check=True, capture_output=True, text=True).stdout
    numbers = re.findall(r"page (\d+) of (\d+)", text)
    assert len(numbers) > 1
    assert numbers == [(str(k), str(len(numbers))) for k in range(1, len(numbers) + 1)]
    assert text.count("operator J. Doe") == len(numbers) + 1 or "operator J. Doe" in text


def test_no_name_of_others_ends_the_style_sheet():
    odd = '"; } </style><script>alert(1)</script>\\ \n'
    footer = Identity("Spin", odd, odd, Provenance("", odd), "tumble").footer
    assert footer == str(footer)
    inside = footer[1:-1]
    for sign in ('"', "<", ">", "\n", ";", "}"):
        assert sign not in inside
    assert css_string("drive 1") == '"drive 1"'
