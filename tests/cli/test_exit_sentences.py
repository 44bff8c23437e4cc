"""Exit codes other than 0: the screen, the JSON and the page have one sentence that states why."""

from __future__ import annotations

import html
import json
import re
from pathlib import Path

import numpy as np
import pytest

from repetitions import repetitions
from tumble.foundation.recording import Chunk
from tumble.logs import open_writer
from tumble.tools.simulate import (
    simulate_flight,
    simulate_magnetometer,
    simulate_multipose,
    simulate_spin,
    simulate_static,
    simulate_thermal,
    simulate_turntable,
)
from tumble.tools.simulate.magnetometer.files import write_magnetometer
from typed_commands import typed

SEED = 46
FEWEST_WORDS = 4
"""Words of a sentence at least."""
OF_REASONS = ("reason", "warning", "failure", "why", "fault", "message", "objection")
"""Parts of the names under which JSON has sentences."""


def cut(chunk, random):
    """The beginning of a log."""
    return slice(0, max(40, int(len(chunk.time) * random.uniform(0.02, 0.6))))


def altered(chunk, random):
    """A log as a bad session, or a bad unit, leaves it."""
    time, force, rate = chunk.time, chunk.accelerometer.copy(), chunk.gyroscope.copy()
    temperature = chunk.temperature
    for kind in random.choice(["cut", "slow", "loud", "shaken", "drifts", "steps", "skewed", "clipped"], 2):
        if kind == "cut":
            kept = cut(Chunk(time, force, rate, temperature), random)
        elif kind == "slow":
            kept = slice(None, None, int(random.integers(2, 60)))
        else:
            kept = slice(None)
        time, force, rate = time[kept], force[kept], rate[kept]
        temperature = None if temperature is None else temperature[kept]
        if kind == "loud":
            force += random.uniform(0.1, 3.0) * random.normal(size=force.shape)
        elif kind == "shaken":
            rate += 0.3 * np.sin(60.0 * time)[:, None] * random.uniform(0.0, 1.0, 3)
        elif kind == "drifts":
            force += np.linspace(0.0, random.uniform(0.0, 1.0), len(time))[:, None] * random.normal(size=3)
        elif kind == "steps":
            rate[len(rate) // 2 :] += random.normal(0.0, 0.05, 3)
            force[len(force) // 3 :] += random.normal(0.0, 0.2, 3)
        elif kind == "skewed":
            force = force @ (np.eye(3) + random.normal(0.0, 0.05, (3, 3)))
        elif kind == "clipped":
            rate = np.clip(rate, -0.5, 0.5)
    return Chunk(time, force, rate, temperature)


def written(recordings, random, folder):
    """Logs of units, altered, in the order given."""
    paths = []
    for name, recording in recordings:
        chunks = list(recording.chunks())
        warm = [chunk.temperature for chunk in chunks if chunk.temperature is not None]
        whole = Chunk(
            np.concatenate([chunk.time for chunk in chunks]),
            np.concatenate([chunk.accelerometer for chunk in chunks]),
            np.concatenate([chunk.gyroscope for chunk in chunks]),
            np.concatenate(warm) if warm else None,
        )
        paths.append(folder / f"{name}.parquet")
        with open_writer(paths[-1]) as writer:
            writer.write(altered(whole, random))
    return paths


def _turntable(random, folder):
    session = simulate_turntable(seed=SEED, grades=("consumer",), rest_seconds=5.0, rate_hz=50.0)
    units = [("reference", session.reference), ("target", session.targets[0])]
    reference, target = written(units, random, folder)
    return ["turntable", reference, target]


def _of_one(procedure, make):
    def command(random, folder):
        (path,) = written([("unit", make().recording)], random, folder)
        return [procedure, path]

    return command


def _of_set(procedure, *options):
    def command(random, folder):
        flight = simulate_flight(seed=SEED, rest_seconds=5.0, motion_seconds=20.0)
        names = [("primary", flight.units[0].recording), ("secondary", flight.units[1].recording)]
        primary, secondary = written(names, random, folder)
        return [procedure, "--primary", primary, "--secondary", secondary, *options]

    return command


def _magnetometer(random, folder):
    count, noise = int(random.integers(1, 16)), random.uniform(0.0, 4.0)
    made = simulate_magnetometer(seed=SEED, orientations=count, rate=25.0, noise=noise)
    return ["magnetometer", write_magnetometer(made, folder)["log"], "--field", random.choice(["48", "30"])]


def live(recorded):
    """The procedure of logs that arrive."""

    def command(random, folder):
        procedure, *words = recorded(random, folder)
        replayed = [f"replay:{word}?speed=max" if isinstance(word, Path) else word for word in words]
        if procedure in ("turntable", "redundancy"):
            names = ("reference", "target") if procedure == "turntable" else ("primary", "secondary")
            logs = [word for word in replayed if word.startswith("replay:")]
            replayed = [f"{name}={log}" for name, log in zip(names, logs, strict=True)]
        return [procedure, "--live", *replayed]

    return command


PROCEDURES = {
    "turntable": _turntable,
    "multipose": _of_one("multipose", lambda: simulate_multipose(seed=SEED)),
    "spin": _of_one("spin", lambda: simulate_spin(seed=SEED)),
    "noise": _of_one("noise", lambda: simulate_static(seed=SEED, duration=600.0, rate_hz=50.0)),
    "thermal": _of_one("thermal", lambda: simulate_thermal(seed=SEED)),
    "align": _of_set("align"),
    "redundancy": _of_set("redundancy"),
    "magnetometer": _magnetometer,
}
LIVE = ("turntable", "multipose", "spin", "redundancy")
COMMANDS = PROCEDURES | {f"{name} --live": live(PROCEDURES[name]) for name in LIVE}


def document(text, words):
    """The document of a command, which is the last of the events of a live session."""
    return json.loads(text.splitlines()[-1] if "--live" in words else text)


def sentences(content, name=""):
    """Texts of several words that JSON has under names of reasons."""
    if isinstance(content, dict):
        for key, value in content.items():
            yield from sentences(value, key)
    elif isinstance(content, list):
        for value in content:
            yield from sentences(value, name)
    elif is_reason(name, content):
        yield content


def is_reason(name, content):
    """Tests whether a text under a name of JSON is a sentence on a reason."""
    named = any(part in name for part in OF_REASONS)
    return named and isinstance(content, str) and len(content.split()) >= FEWEST_WORDS


def plain(text):
    """Words of a text alone, as screen, page and JSON break and mark them otherwise."""
    without_tags = html.unescape(re.sub(r"<[^>]*>", " ", text)).replace("\N{MINUS SIGN}", "-")
    return re.sub(r"[\W_]+", "", without_tags.replace("^2", "²").replace("m/s2", "m/s²").lower())


@pytest.mark.parametrize("command", COMMANDS)
def test_exit_other_than_0_has_its_sentence_everywhere(command, tmp_path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    ends = set()
    for number in range(repetitions(12)):
        folder = tmp_path / str(number)
        folder.mkdir()
        words = [*COMMANDS[command](random, folder), "-o", folder / "out"]
        shown = typed(*words)
        # A live session of that name would be there already.
        words[-1] = folder / "stated"
        stated = typed(*words, "--json")
        assert shown.code == stated.code
        ends.add(shown.code)
        if shown.code == 2:
            # A live session reports its progress above the error.
            *above, line = shown.err.strip().splitlines()
            assert line.startswith("tumble: error: ")
            assert not above or "--live" in words
            message = document(stated.out, words)["error"]["message"]
            assert message.replace(str(folder / "stated"), str(folder / "out")) in line
        elif shown.code != 0:
            assert shown.code == 3
            _assert_one_sentence_everywhere(shown, document(stated.out, words), folder / "out")
    assert ends & {2, 3}, "no draw was bad"


def _assert_one_sentence_everywhere(shown, content, out: Path):
    screen = plain(shown.out + shown.err)
    pages = plain(" ".join(page.read_text(encoding="utf-8") for page in out.glob("*.html")))
    found = [plain(sentence) for sentence in sentences(content)]
    assert any(sentence in screen and sentence in pages for sentence in found), shown.out + shown.err
