"""The page of a recording in a real browser: zoom, select, spectrum, pictures; names of files are text."""

import json
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager
from xml.etree import ElementTree

import pytest

from bench_pages import chromium, violations, waited
from log_fixtures import made_up, write
from patience import PATIENCE
from turntable_sessions import typed

EVIL = "<img src=x onerror=document.title='owned'>"


@contextmanager
def served(*arguments, cwd):
    """Serves a page by the command in a process of its own; gives its address."""
    command = [sys.executable, "-m", "tumble", "view", *map(str, arguments), "--no-browser", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd)
    try:
        yield json.loads(process.stdout.readline())["address"]
    finally:
        process.terminate()
        _, problems = process.communicate(timeout=PATIENCE)
        assert "Traceback" not in problems


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A unit held in many orientations with its results, and a log whose name is markup."""
    folder = tmp_path_factory.mktemp("view")
    assert typed("simulate", "multipose", "-o", folder / "hand").code == 0
    typed("multipose", folder / "hand" / "multipose.csv", "-o", folder / "hand" / "results", "--quiet")
    write(folder / f"{EVIL}.csv", made_up(4000))
    return folder


@contextmanager
def opened(browser, address, **options):
    problems = []
    page = browser.new_page(viewport={"width": 1400, "height": 900}, **options)
    page.set_default_timeout(1000.0 * PATIENCE)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto(address)
    page.wait_for_selector(".tumble-plot[data-drawn]")
    yield page
    page.close()
    assert not problems


def window(page):
    return [float(end) for end in page.locator(".tumble-plot").first.get_attribute("data-drawn").split()]


def saved(page, name, path):
    with page.expect_download() as download:
        page.get_by_role("button", name=name, exact=True).first.click()
    download.value.save_as(path)
    return path.read_bytes()


def test_a_result_is_zoomed_selected_analysed_and_saved(browser, folder, tmp_path):
    with served(folder / "hand" / "results", cwd=folder) as address, opened(browser, address) as page:
        page.get_by_text("Procedures that it suits").wait_for()
        assert window(page) == [0.0, 106.36]
        plot = page.locator(".tumble-plot").first
        plot.focus()
        for _ in range(2):
            page.keyboard.press("ArrowUp")
        waited(page, lambda: window(page)[1] - window(page)[0] == pytest.approx(106.36 / 4, rel=0.01))
        before = window(page)
        page.keyboard.press("ArrowRight")
        waited(page, lambda: window(page)[0] > before[0])
        page.keyboard.press("n")
        waited(page, lambda: page.get_by_label("from, s").input_value() == "0.100")
        page.get_by_role("button", name="Spectrum").click()
        page.get_by_role("heading", name="Amplitude spectral density: multipose").wait_for()
        page.get_by_role("button", name="Residuals").click()
        page.get_by_role("heading", name="Residuals of multipose").wait_for()
        page.keyboard.press("Escape")
        box = plot.bounding_box()
        page.mouse.move(box["x"] + 300, box["y"] + 200)
        page.mouse.wheel(0, -300)
        page.mouse.down()
        page.mouse.move(box["x"] + 500, box["y"] + 200, steps=3)
        page.mouse.up()
        waited(page, lambda: window(page)[1] - window(page)[0] < 10.0)
        png = saved(page, "Save as PNG", tmp_path / "chart.png")
        assert png.startswith(b"\x89PNG\r\n\x1a\n")
        assert png.endswith(b"IEND\xaeB`\x82")
        svg = saved(page, "Save as SVG", tmp_path / "chart.svg").decode()
        assert ElementTree.fromstring(svg).tag == "{http://www.w3.org/2000/svg}svg"
        for text in ("results", "specific force, m/s²", "angular rate, rad/s", "time, s", "x calibrated"):
            assert text in svg
        assert violations(page) == []


def test_names_are_text_and_a_section_is_run(browser, folder):
    with served(folder / f"{EVIL}.csv", cwd=folder) as address, opened(browser, address) as page:
        page.get_by_role("button", name="Noise", exact=True).wait_for()
        assert page.get_by_role("heading", level=1).inner_text() == f"{EVIL}.csv"
        assert page.evaluate("document.querySelectorAll('img').length") == 0
        assert page.title() != "owned"
        page.get_by_label("from, s").fill("0.5")
        page.get_by_label("to, s").fill("8")
        page.get_by_label("to, s").press("Enter")
        page.get_by_role("button", name="Add section").click()
        page.get_by_text("0.500 to 8.000 s", exact=True).wait_for()
        page.get_by_label("Folder for results").fill("out")
        page.get_by_role("button", name="Noise", exact=True).click()
        with page.expect_popup() as link:
            page.get_by_role("link", name="Page of the result").click()
        link.value.get_by_text("only from 0.500 to 8.000 s").first.wait_for()
        assert len(list((folder / "out").glob("*.noise.yaml"))) == 1


def test_samples_and_page_are_for_who_has_the_token(folder):
    with served(folder / "hand" / "multipose.csv", cwd=folder) as address:
        base = address.partition("?")[0]
        for path, headers in (("", {}), ("?token=wrong", {}), ("tumble-log/x/samples", {})):
            assert status(base + path, headers) == 403
        with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
            cookie = {"Cookie": answer.headers["Set-Cookie"].partition(";")[0]}
        assert status(base, cookie) == 200
        assert status(base, cookie | {"Origin": "http://elsewhere.example"}) == 403
        assert status(base, cookie | {"Host": "elsewhere.example"}) == 403
        assert status(f"{base}tumble-log/x/samples?start=0&end=1&bins=10", cookie) == 404
        assert status(f"{base}made-here/1", cookie) == 404


def status(address, headers):
    try:
        with urllib.request.urlopen(
            urllib.request.Request(address, headers=headers), timeout=PATIENCE
        ) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code
