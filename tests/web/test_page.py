"""The page, opened from the disk in a browser: a log goes in, its calibration comes out, nothing is sent."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import pytest

from bench_pages import chromium
from web_page import PAGE, built, downloaded, give, opened_page

DATA = Path(__file__).parents[3] / "shared" / "data"
LOG = DATA / "mpu9150" / "imu0.log"
PICTURE = Path(__file__).parents[2] / "docs" / "images" / "browser.png"
LARGEST_PAGE = 600 * 1024
"""Bytes of all of it, packed as a server sends it."""

pytestmark = pytest.mark.skipif(not DATA.exists(), reason=f"no recordings in {DATA}")


@pytest.fixture(scope="module")
def browser():
    """The system's browser, for all tests of this file."""
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def page(browser):
    """A page on a phone, which each test gives another log."""
    with opened_page(browser) as page:
        yield page


def test_page_is_small():
    assert len(gzip.compress(built(PAGE).read_bytes())) <= LARGEST_PAGE


def test_log_becomes_a_calibration_and_parameters(page):
    give(page, LOG)
    page.locator(".trouble", has_text="--rate").wait_for()
    page.get_by_label("Sample rate").fill("100")
    page.get_by_label("Sample rate").press("Enter")
    page.locator("#verdict", has_text="Calibrated").wait_for()
    if os.environ.get("TUMBLE_PICTURES"):
        page.locator("#verdict").evaluate(
            "each => scrollTo(0, each.getBoundingClientRect().top + scrollY - 90)"
        )
        page.screenshot(path=PICTURE)
    assert PICTURE.is_file()
    assert page.locator(".trouble").inner_text() == ""
    name, text = downloaded(page, "Save the calibration")
    assert name == "imu0.multipose.yaml"
    assert "schema: tumble-calibration/3" in text
    name, text = downloaded(page, "ArduPilot")
    assert (name, "INS_ACCOFFS_X,0.102526441" in text) == ("imu0.ardupilot.param", True)
    page.get_by_role("button", name="PX4").click()
    page.locator(".files .trouble", has_text="device id").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") == 360


def test_two_files_of_one_log_are_read_as_one(page):
    give(page, DATA / "xsens" / "xsens_gyro.mat", DATA / "xsens" / "xsens_acc.mat")
    page.locator(".trouble", has_text="neither m/s^2, g nor mg").wait_for()
    page.get_by_label("Sample rate").fill("")
    page.get_by_label("Readings are counts").check()
    page.locator("#verdict", has_text="Calibrated").wait_for()
    page.get_by_label("Readings are counts").uncheck()


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        (
            "torn.csv",
            "t,ax,ay,az\n0,1,2,3\n1,2\n2,1,2,3\n",
            "line 3 has 2 fields where 4 columns are named",
        ),
        ("short.csv", "t,ax,ay,az\n0,1,2,3\n1,2", "short.csv: line 3 breaks off after 2 of 4 fields"),
        ("letters.csv", "t,ax,ay,az\n0,1,2,3\n1,2,x<b>,3\n2,1,2,3\n", "holds 'x<b>' in column ay"),
        ("empty.csv", "", "empty.csv: not a log"),
        ("zeros.bin", "\0" * 4096, "zeros.bin: is no text"),
        ("damaged.csv.gz", b"\x1f\x8b\x08\0rubbish", "damaged.csv.gz: the gzip file is damaged"),
        ("page.html", "<script>alert(1)</script>", "page.html: not a log but JSON or XML"),
    ],
)
def test_damaged_files_are_refused_in_one_line(page, tmp_path, name, content, line):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    give(page, path)
    page.locator(".trouble", has_text=line).wait_for()
    assert "\n" not in page.locator(".trouble").inner_text()


def test_columns_without_known_names_are_chosen(page, tmp_path):
    lines = LOG.read_text(encoding="utf-8").splitlines()
    path = tmp_path / "strange.csv"
    rows = [f"{k / 100:.2f},{','.join(line.split())}" for k, line in enumerate(lines)]
    path.write_text("\n".join(["n,p,q,r,s,u,v", *rows]), encoding="utf-8")
    give(page, path)
    page.locator(".trouble", has_text="columns found: n, p, q, r, s, u, v").wait_for()
    assert page.locator(".table-columns td").first.inner_text() == "0.00"
    for name, channel in zip("npqrsuv", ("time", "ax", "ay", "az", "gx", "gy", "gz"), strict=True):
        page.get_by_label(f"Meaning of column {name}").select_option(channel)
    page.get_by_label("Unit of time").select_option("s")
    page.locator("#verdict", has_text="Calibrated").wait_for()


def test_page_speaks_chinese(browser):
    with opened_page(browser, locale="zh-CN") as page:
        give(page, LOG)
        page.locator(".trouble:not(:empty)").wait_for()
        page.get_by_label("采样率").fill("100")
        page.get_by_label("采样率").press("Enter")
        page.locator("#verdict", has_text="已校准").wait_for()
        assert page.evaluate("document.documentElement.lang") == "zh-CN"
        page.get_by_label("语言").select_option("en")
        page.get_by_label("Sample rate").wait_for()


@pytest.mark.parametrize(("width", "scheme"), [(360, "light"), (1400, "dark")])
def test_page_can_be_used_by_all(browser, width, scheme):
    # The policy of the page keeps out what examines it, too.
    with opened_page(browser, width=width, scheme=scheme, bypass_csp=True) as page:
        give(page, LOG)
        page.locator(".trouble:not(:empty)").wait_for()
        assert violations(page) == []
        page.get_by_label("Sample rate").fill("100")
        page.get_by_label("Sample rate").press("Enter")
        page.locator("#verdict").wait_for()
        assert violations(page) == []


def violations(page) -> list[str]:
    """Names the rules of axe-core that the page breaks."""
    from axe_playwright_python.sync_playwright import Axe

    results = Axe().run(page, options={"resultTypes": ["violations"]})
    return [f"{each['id']}: {each['nodes'][0]['html'][:120]}" for each in results.response["violations"]]
