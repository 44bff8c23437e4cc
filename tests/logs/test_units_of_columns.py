"""Any column of a triad states the unit of all, whoever wrote the table; two that differ are refused."""

from itertools import combinations, product

import numpy as np
import pytest

from log_fixtures import made_up, read, refusal
from tumble.foundation.errors import LogError
from tumble.logs import ReadOptions, open_recording

RADIANS = 180.0 / np.pi
NAMES = ("time", "ax", "ay", "az", "gx", "gy", "gz")
UNITS = {"deg/s": "dps", "rad/s": "rad"}


def rows_of(chunk):
    """Rows with the gyroscope in deg/s and the accelerometer in m/s^2."""
    return np.column_stack([chunk.time, chunk.accelerometer, chunk.gyroscope * RADIANS])


def write(path, lines, rows):
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join([*lines, *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n")
    return path


def behind(names, units, form):
    """Names, each with the unit that its column states."""
    return [form.format(name, unit) if unit else name for name, unit in zip(names, units, strict=True)]


def brackets(folder, rows, units):
    return write(folder / "log.csv", [",".join([*NAMES[:4], *behind(NAMES[4:], units, "{} [{}]")])], rows)


def endings(folder, rows, units):
    named = behind(("gyro_x", "gyro_y", "gyro_z"), [UNITS.get(unit, "") for unit in units], "{}_{}")
    return write(folder / "log.csv", [",".join([*NAMES[:4], *named])], rows)


def line_below(folder, rows, units):
    """The line of units below the names, as Consensys writes it."""
    return write(folder / "log.csv", [",".join(NAMES), ",".join(["s", *["m/s^2"] * 3, *units])], rows)


def physics_toolbox(folder, rows, units):
    names = ["time", "gFx", "gFy", "gFz", *behind(("wx", "wy", "wz"), units, "{} ({})")]
    scaled = rows / np.array([1.0, *[9.80665] * 3, *[1.0] * 3])
    return write(folder / "log.csv", [",".join(names)], scaled)


def phyphox(folder, rows, units):
    names = ["Time (s)", *behind("XYZ", units, "{} ({})")]
    force = ["Time (s)", *behind("XYZ", ["m/s^2"] * 3, "{} ({})")]
    write(folder / "poses" / "Accelerometer.csv", [",".join(force)], rows[:, :4])
    return write(folder / "poses" / "Gyroscope.csv", [",".join(names)], rows[:, [0, 4, 5, 6]]).parent


def table(folder, rows, units):
    named = [*NAMES[:4], *behind(NAMES[4:], units, "{} [{}]")]
    return dict(zip(named, rows.T, strict=True))


def named_by_user(folder, rows, units):
    """Names that mean nothing, which `--columns` explains."""
    return write(folder / "log.csv", [",".join([*NAMES[:4], *behind("uvw", units, "{} [{}]")])], rows)


READERS = (brackets, endings, line_below, physics_toolbox, phyphox, table, named_by_user)
STATING = [axes for count in (1, 2, 3) for axes in combinations(range(3), count)]


def options_of(reader, **stated):
    columns = {"gx": "u", "gy": "v", "gz": "w"} if reader is named_by_user else {}
    return ReadOptions(columns=columns, **stated)


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
def test_any_axis_states_the_unit_of_its_triad(tmp_path, reader):
    chunk = made_up(200, rate=100.0, temperature=False)
    for axes in STATING:
        units = ["deg/s" if axis in axes else "" for axis in range(3)]
        source = reader(tmp_path, rows_of(chunk), units)
        options = options_of(reader)
        assert open_recording(source, options).metadata.gyroscope_unit.name == "deg/s", axes
        assert np.allclose(read(source, options).gyroscope, chunk.gyroscope, atol=1e-8), axes


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
def test_axes_in_several_units_are_refused_in_one_line(tmp_path, reader):
    chunk = made_up(200, rate=100.0, temperature=False)
    for units in product(("deg/s", "rad/s", ""), repeat=3):
        if len(set(units) - {""}) < 2:
            continue
        source = reader(tmp_path, rows_of(chunk), units)
        line = refusal(source, options_of(reader))
        stated = ", ".join(dict.fromkeys(filter(None, units)))
        assert f"columns of one sensor, the gyroscope, are in several units: {stated}; convert" in line
        forced = options_of(reader, gyroscope_unit="deg/s")
        assert np.allclose(read(source, forced).gyroscope, chunk.gyroscope, atol=1e-8), units


@pytest.mark.parametrize(
    "unseen", ["\u200b", "\u200d", "\u2060", "\ufeff", "\u00ad", "\u202e", "\u034f", "\u3164", "\ufe0f"]
)
def test_letters_without_a_width_make_no_other_name(tmp_path, unseen):
    rows = rows_of(made_up(200, rate=100.0, temperature=False))
    hidden = [f"{unseen}{name[0]}{unseen}{name[1:]}{unseen}" for name in NAMES]
    assert open_recording(write(tmp_path / "log.csv", [",".join(hidden)], rows)).metadata.unread == ()
    doubled = write(tmp_path / "two.csv", [",".join([*NAMES, hidden[1]])], np.hstack([rows, rows[:, :1]]))
    assert "may each be ax; name one, as --columns ax=" in refusal(doubled)


@pytest.mark.parametrize("factor", [9.80665, 1000.0, 9806.65])
@pytest.mark.parametrize("grows", [True, False])
def test_a_unit_that_changes_in_a_log_never_passes(tmp_path, factor, grows):
    seed = 17
    draws = np.random.default_rng(seed)
    rows = np.zeros((2000, 7))
    rows[:, 0] = np.arange(2000) / 100.0
    rows[:, 1:4] = np.array([0.1, 0.2, 9.8]) + draws.normal(0.0, 0.02, (2000, 3))
    rows[:, 4:] = draws.normal(0.0, 1e-3, (2000, 3))
    stated = ReadOptions(gyroscope_unit="rad/s")
    assert not notices_of(write(tmp_path / "log.csv", [",".join(NAMES)], rows), stated), seed
    rows[1400:, 1:4] *= factor if grows else 1.0 / factor
    try:
        (notice,) = notices_of(write(tmp_path / "log.csv", [",".join(NAMES)], rows), stated)
    except LogError as error:  # the head shows two units, and none is its own
        notice = str(error)
        is_told = not grows and "at rest, which is neither m/s^2, g nor mg" in notice
    else:
        is_told = "at rest from 14.08 s on" in notice and "its unit seems to change there" in notice
    assert is_told, (seed, notice)


def notices_of(path, options):
    stream = open_recording(path, options).chunks()
    assert sum(map(len, stream)) == 2000
    return stream.counts.notices()
