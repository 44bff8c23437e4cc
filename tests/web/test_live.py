"""The page records a phone and a board: events and bytes go in, a calibration comes out, no line is lost."""

from __future__ import annotations

import numpy as np
import pytest

from bench_pages import chromium
from repetitions import drawn_seed
from web_page import downloaded, opened_page

RATE = 60.0
FORCE_BIAS, RATE_BIAS = np.array([0.2, -0.1, 0.3]), np.array([0.01, -0.02, 0.005])
"""m/s^2 and rad/s."""

MOTION = """samples => {
    for (const [time, ax, ay, az, gx, gy, gz] of samples) {
        const event = new DeviceMotionEvent("devicemotion", {
            accelerationIncludingGravity: { x: ax, y: ay, z: az },
            rotationRate: { alpha: gx, beta: gy, gamma: gz },
        });
        Object.defineProperty(event, "timeStamp", { value: 1000 * time });
        dispatchEvent(event);
    }
}"""
"""Dispatches events as a browser does, with times of their own."""

PORT = """({ text, baudRate }) => {
    const port = {
        open: async (options) => {
            const right = options.baudRate === baudRate;
            const bytes = new TextEncoder().encode(right ? text : "\\u0000\\u00ff~\\u0001x".repeat(400));
            let at = 0;
            port.readable = new ReadableStream({
                pull: (controller) => {
                    if (at >= bytes.length) return right ? new Promise(() => {}) : controller.close();
                    controller.enqueue(bytes.slice(at, at += 4096));
                },
            });
        },
        close: async () => { window.portClosed = true; },
    };
    const serial = { requestPort: async () => port };
    Object.defineProperty(navigator, "serial", { value: serial, configurable: true });
}"""
"""Puts a port in the place of those of the computer: it replays bytes at one rate, and rubbish at others."""


@pytest.fixture(scope="module")
def browser():
    """The system's browser, for all tests of this file."""
    with chromium() as browser:
        yield browser


def session(rng) -> np.ndarray:
    """Returns (n, 7) samples of a unit in sixteen orientations: s, m/s^2, rad/s."""
    up, time, rows = np.array([0.0, 0.0, 1.0]), 100.0, []
    for _ in range(16):
        axis = rng.normal(size=3)
        turn = axis / np.linalg.norm(axis) * rng.uniform(0.8, 2.2)
        for speed, samples in ((np.zeros(3), int(3.0 * RATE)), (turn, int(RATE))):
            for _ in range(samples):
                angle = np.linalg.norm(speed) / RATE
                if angle:
                    along = speed / np.linalg.norm(speed)
                    up = (
                        np.cos(angle) * up
                        - np.sin(angle) * np.cross(along, up)
                        + (1.0 - np.cos(angle)) * along * (along @ up)
                    )
                force = 9.80665 * up + FORCE_BIAS + rng.normal(0.0, 5e-3, 3)
                rows.append([time, *force, *(speed + RATE_BIAS + rng.normal(0.0, 1e-3, 3))])
                time += 1.0 / RATE
    return np.array(rows)


def test_sensors_of_a_phone_become_a_calibration(browser):
    samples = session(np.random.default_rng(drawn_seed()))
    events = samples.copy()
    events[:, 4:] = np.degrees(events[:, 4:])
    with opened_page(browser, has_touch=True) as page:
        page.get_by_role("button", name="Use the sensors of this device").click()
        page.get_by_role("button", name="Finish").wait_for()
        page.evaluate(MOTION, events.tolist())
        # It ends by itself once no orientation to add is worth it, else when the person ends it.
        page.evaluate(
            "[...document.querySelectorAll('button')].find(e => e.textContent === 'Finish')?.click()"
        )
        page.locator("#verdict", has_text="Calibrated").wait_for()
        _, text = downloaded(page, "Save the calibration")
        _, log = downloaded(page, "Save the log")
        assert page.locator(".trouble").first.inner_text() == ""
    bias = [float(each) for each in text.partition("\n  b: [")[2].partition("]")[0].split(", ")]
    assert np.allclose(bias, FORCE_BIAS, atol=0.02)
    assert len(log.splitlines()) == 1 + len(samples)


@pytest.mark.parametrize(
    ("line", "baud"),
    [
        ("{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f}", 115200),
        ("AccX:{:.4f},AccY:{:.4f},AccZ:{:.4f},GyroX:{:.5f},GyroY:{:.5f},GyroZ:{:.5f}", 57600),
    ],
)
def test_no_line_of_a_board_is_lost(browser, line, baud):
    samples = session(np.random.default_rng(drawn_seed()))
    text = "".join(line.format(*row[1:]) + "\r\n" for row in samples)
    with opened_page(browser) as page:
        page.evaluate(PORT, {"text": f"torn\r\n{text}", "baudRate": baud})
        page.get_by_label("Language").select_option("zh-CN")
        page.get_by_label("语言").select_option("en")
        page.get_by_role("button", name="Connect a board").click()
        page.locator(".live .help", has_text="samples a second").wait_for()
        page.get_by_role("button", name="Stop").wait_for()
        recorded = page.evaluate("document.querySelector('.live .instruction') !== null")
        page.get_by_role("button", name="Finish").click()
        _, log = downloaded(page, "Save the log")
        assert page.evaluate("window.portClosed") is True
    assert recorded
    rows = [row.split(",")[1:] for row in log.splitlines()[1:]]
    values = [[value.rpartition(":")[2] for value in row.split(",")] for row in text.split()]
    assert rows == values


def test_a_board_without_numbers_is_refused_in_one_line(browser):
    with opened_page(browser) as page:
        page.evaluate(PORT, {"text": "hello\r\n" * 200, "baudRate": 9600})
        page.get_by_label("Language").select_option("zh-CN")
        page.get_by_label("语言").select_option("en")
        page.get_by_role("button", name="Connect a board").click()
        page.locator(".trouble", has_text="no lines of numbers").wait_for()
