"""Files for Rerun, Foxglove and PlotJuggler, held against the results that they show."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import foxglove.layouts
import numpy as np
import pytest
import yaml
from rosbags.typesys import Stores, get_typestore

import tumble
from redundancy_sets import QUICK
from tumble.calibration.document import Calibration
from tumble.foundation.recording import Recording
from tumble.foundation.results import Rest
from tumble.procedures.magnetometer.earth_field import earth_field
from tumble.tools.simulate import simulate_magnetometer
from tumble.tools.viewers.content import ShownSegment, ShownUnit, ViewerContent, segments_of
from tumble.tools.viewers.mcap_file import quaternion_of
from tumble.tools.viewers.ros_messages import STATES, rotation_onto
from tumble.tools.viewers.writing import write_viewer_files
from turntable_sessions import one_line, typed
from viewer_files import column, mcap_messages, rerun_chunks, triads_of

pytestmark = pytest.mark.skipif(sys.version_info < (3, 11), reason="Rerun needs Python 3.11")


@pytest.fixture(scope="module")
def hand(tmp_path_factory):
    """A session with its result, written for viewers by the command."""
    folder = tmp_path_factory.mktemp("hand")
    assert typed("simulate", "multipose", "--seed", "7", "-o", folder).code == 0
    words = ("-o", folder / "results", "--rerun", folder / "a.rrd", "--mcap", folder / "a.mcap", "--json")
    done = typed("multipose", folder / "multipose.csv", *words)
    assert done.code == 0, done.err
    (folder / "result.json").write_text(done.out)
    return folder


def expected(folder):
    """Time, and both triads raw and calibrated."""
    recording = tumble.open_recording(folder / "multipose.csv")
    chunks = list(recording.chunks())
    raw = [
        np.concatenate([getattr(each, name) for each in chunks]) for name in ("accelerometer", "gyroscope")
    ]
    calibration = Calibration.load(folder / "results" / "multipose.yaml")
    time = np.concatenate([each.time for each in chunks])
    temperature = np.concatenate([each.temperature for each in chunks])
    return time, raw, calibration.correct(*raw, temperature)


def test_rerun_holds_every_reading_raw_and_calibrated(hand):
    chunks = rerun_chunks(hand / "a.rrd")
    time, *forms = expected(hand)
    for form, triads in zip(("raw", "calibrated"), forms, strict=True):
        for name, values in zip(("accelerometer", "gyroscope"), triads, strict=True):
            stamps, found = column(chunks[f"/multipose/{form}/{name}"], "Scalars:scalars")
            assert stamps == pytest.approx(time, abs=1e-9)
            assert np.array_equal(np.array(found), values)


def test_mcap_holds_every_reading_raw_and_calibrated(hand):
    messages = mcap_messages(hand / "a.mcap")
    time, *forms = expected(hand)
    for form, triads in zip(("raw", "calibrated"), forms, strict=True):
        of_form = messages[f"/multipose/{form}"]
        assert np.array([stamp for stamp, _ in of_form]) * 1e-9 == pytest.approx(time, abs=1e-9)
        for found, values in zip(triads_of(of_form), triads, strict=True):
            assert np.array_equal(found, values)


def test_states_are_the_rests_and_turns_of_the_result(hand):
    rests = json.loads((hand / "result.json").read_text())["rests"]
    used = [rest for rest in rests if rest["used"]]
    times, states = column(rerun_chunks(hand / "a.rrd")["/multipose/segments"], "StateChange:state")
    begun = [(time, state[0]) for time, state in zip(times, states, strict=True) if "rest" in state[0]]
    assert [state for _, state in begun] == [f"rest {number}" for number in range(1, len(used) + 1)]
    assert [time for time, _ in begun] == pytest.approx([rest["start"] for rest in used])
    assert states[-1] == [""]
    segments = mcap_messages(hand / "a.mcap")["/multipose/segments"]
    assert [STATES[message.state] for _, message in segments] == [
        state[0].split()[0] if state[0] else "none" for state in states
    ]


def test_arrows_point_where_gravity_shows_up(hand):
    messages = mcap_messages(hand / "a.mcap")["/multipose/up"]
    rests = [rest for rest in json.loads((hand / "result.json").read_text())["rests"] if rest["used"]]
    time, (readings, _), _ = expected(hand)
    for (_, message), rest in zip(messages, rests, strict=True):
        turn = message.entities[0].arrows[0].pose.orientation
        x, y, z, w = turn.x, turn.y, turn.z, turn.w
        tip = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)])
        force = readings[(time >= rest["start"]) & (time <= rest["end"])].mean(axis=0)
        assert tip == pytest.approx(force / np.linalg.norm(force), abs=1e-3)


def test_parameters_and_verdict_are_those_of_the_calibration(hand):
    ((_, message),) = mcap_messages(hand / "a.mcap")["/calibration"]
    (status,) = message.status
    values = {pair.key: pair.value for pair in status.values}
    calibration = Calibration.load(hand / "results" / "multipose.yaml")
    assert (status.level, status.message) == (0, "calibrated")
    accelerometer = calibration.accelerometer
    assert float(values["accelerometer bias y, m/s^2"]) == pytest.approx(accelerometer.b[1], rel=1e-8)
    sigma = values["accelerometer bias y, 1-sigma, m/s^2"]
    assert float(sigma) == pytest.approx(accelerometer.sigma.bias[1], rel=1e-2)
    assert float(values["accelerometer scale z"]) == pytest.approx(accelerometer.K[2, 2], rel=1e-8)
    assert values["accelerometer mounting x, deg"] == "not observable"


def test_field_is_shown_raw_and_calibrated_at_its_own_rate(tmp_path):
    made = simulate_magnetometer(seed=7, rate=50.0)
    track = made.track.chosen(slice(0, None, 5))
    recording = replace(made.recording, read_magnetic=lambda: track)
    calibration = tumble.multipose(recording, magnetometer=earth_field(48.0)).calibration
    content = ViewerContent("compass", (ShownUnit("imu", recording, calibration),))
    write_viewer_files(content, rerun=tmp_path / "a.rrd", mcap=tmp_path / "a.mcap")
    chunks, messages = rerun_chunks(tmp_path / "a.rrd"), mcap_messages(tmp_path / "a.mcap")
    corrected = calibration.correct_magnetic(track.field)
    for form, values in (("raw", track.field), ("calibrated", corrected)):
        stamps, found = column(chunks[f"/imu/{form}/magnetometer"], "Scalars:scalars")
        assert stamps == pytest.approx(track.time, abs=1e-9)
        assert np.array_equal(np.array(found), values)
        sent = [message.magnetic_field for _, message in messages[f"/imu/{form}/mag"]]
        assert np.array([[each.x, each.y, each.z] for each in sent]) == pytest.approx(1e-6 * values)
    layout = json.loads((tmp_path / "a-layout.json").read_text())
    paths = [path["value"] for path in layout["configById"]["Plot!field"]["paths"] if path["enabled"]]
    assert paths == [f"/imu/calibrated/mag.magnetic_field.{axis}" for axis in "xyz"]


def test_log_of_a_magnetometer_alone_is_shown_with_its_result(tmp_path):
    made = simulate_magnetometer(seed=7, orientations=40, still=0.0, rate=50.0)
    rows = np.column_stack([made.track.time, made.track.field])
    np.savetxt(tmp_path / "a.csv", rows, "%.9g", ",", header="time_s,mx_uT,my_uT,mz_uT", comments="")
    files = ("--rerun", tmp_path / "a.rrd", "--mcap", tmp_path / "a.mcap")
    assert (
        typed("magnetometer", tmp_path / "a.csv", "--field", "48", "-o", tmp_path / "out", *files).code == 3
    )
    messages = mcap_messages(tmp_path / "a.mcap")
    assert set(messages) == {"/a/raw/mag", "/a/calibrated/mag", "/calibration", "/events"}
    values = {pair.key: pair.value for pair in messages["/calibration"][0][1].status[0].values}
    assert (values["field strength, uT"], values["magnetic field dip, deg"]) == (*("48", "not observable"),)
    assert "/a/calibrated/magnetometer" in rerun_chunks(tmp_path / "a.rrd")


def fields_of(store, message_type, path):
    """Follows the fields of a path through the definitions of messages."""
    for name in path:
        fields = dict(store.fielddefs[message_type][1])
        kind = fields[name]
        message_type = kind[1] if isinstance(kind[1], str) else kind[1][0]
    return message_type


def test_the_layout_names_topics_fields_and_settings_that_exist(hand):
    layout = json.loads((hand / "a-layout.json").read_text())
    messages = mcap_messages(hand / "a.mcap")
    store = get_typestore(Stores.ROS2_HUMBLE)
    classes = {
        "StateTransitions": foxglove.layouts.StateTransitionsConfig(),
        "Plot": foxglove.layouts.PlotConfig(),
        "RosOut": foxglove.layouts.LogConfig(),
        "3D": foxglove.layouts.ThreeDeeConfig(),
        "DiagnosticStatusPanel": foxglove.layouts.DiagnosticsDetailConfig(),
    }
    for name, config in layout["configById"].items():
        kind = name.partition("!")[0]
        if kind in classes:
            assert set(config) <= set(classes[kind]._to_dict()), name
        for topic in (config.get("topicToRender"), *config.get("topics", {})):
            assert topic is None or topic in messages
        for path in config.get("paths", []):
            topic, *fields = path["value"].split(".")
            sample = messages[topic][0][1]
            if kind == "Plot":
                assert fields_of(store, sample.__msgtype__, fields) == "float64"
            else:
                assert hasattr(sample, fields[0])
    shown = json.dumps(layout["layout"]) + json.dumps(layout["configById"]["Tab!units"])
    assert all(name in shown for name in layout["configById"])


def test_units_of_an_alignment_are_on_one_clock(tmp_path):
    assert typed("simulate", "flight", "--seed", "3", "--duration", "30", "-o", tmp_path).code == 0
    logs = [tmp_path / f"{name}.csv" for name in ("primary", "secondary_1", "secondary_2")]
    roles = ("--primary", logs[0], "--secondary", logs[1], "--secondary", logs[2])
    written = ("--rerun", tmp_path / "a.rrd", "--mcap", tmp_path / "a.mcap")
    assert typed("align", *roles, "-o", tmp_path / "results", *written).code == 0
    units = yaml.safe_load((tmp_path / "results" / "align.yaml").read_text())["units"]
    chunks, messages = rerun_chunks(tmp_path / "a.rrd"), mcap_messages(tmp_path / "a.mcap", "/tf")
    for path in logs[1:]:
        first = next(tumble.open_recording(path).chunks()).time[0]
        times, _ = column(chunks[f"/{path.stem}/raw/gyroscope"], "Scalars:scalars")
        assert times[0] == pytest.approx(first + units[path.stem]["time_offset"], abs=1e-3)
    for _, message in messages["/tf"]:
        arm = units[message.child_frame_id]["lever_arm"]
        moved = message.translation
        assert (moved.x, moved.y, moved.z) == pytest.approx(arm)
        assert message.parent_frame_id == "primary"
    words = ("--settings", tmp_path / "units.yaml", *QUICK, "-o", tmp_path / "set")
    assert typed("redundancy", *roles, *words, "--mcap", tmp_path / "set.mcap").code in (0, 3)
    events = (tmp_path / "set" / "events.jsonl").read_text().splitlines()
    log = mcap_messages(tmp_path / "set.mcap", "/events")["/events"]
    # The verdict and warnings on logs come besides.
    assert len(log) > len(events)
    assert sum("verdict" in message.message for _, message in log) == 1


def test_files_of_a_recording_follow_one_another_and_dates_stay_dates(tmp_path):
    time, still = 1.7e9 + np.arange(50) / 100.0, np.zeros((50, 3))
    parts = tuple(Recording.from_arrays(name, time + 900.0 * n, still, still) for n, name in enumerate("ab"))
    whole = Recording(parts[0].metadata, lambda: iter(()), parts)
    segments = (ShownSegment("rest", 1.7e9, 1.7e9 + 0.3), ShownSegment("turn", 1.7e9 + 0.2, 1.7e9 + 0.4))
    content = ViewerContent("poses", (ShownUnit("a b", whole, lanes={"segments": segments, "none": ()}),))
    write_viewer_files(content, rerun=tmp_path / "a.rrd", mcap=tmp_path / "a.mcap")
    chunks = rerun_chunks(tmp_path / "a.rrd")
    times, _ = column(chunks["/a_b/raw/gyroscope"], "Scalars:scalars")
    # Second files begin a second after the end of the first, whatever their own clock is.
    assert times[50] - times[49] == pytest.approx(1.0, abs=1e-6)
    assert all(str(batch.schema.field("time").type) == "timestamp[ns]" for batch in chunks["/a_b/segments"])
    _, states = column(chunks["/a_b/segments"], "StateChange:state")
    assert states == [["rest"], ["turn"], [""]]
    assert set(mcap_messages(tmp_path / "a.mcap")) == {"/a_b/raw", "/a_b/segments", "/calibration"}


def test_logs_of_one_name_are_two_units_that_begin_together(tmp_path):
    rows = [f"{number / 100},0,0,9.8,0,0,0.1" for number in range(300)]
    for folder, begin in (("a", 0), ("b", 100)):
        (tmp_path / folder).mkdir()
        text = "\n".join(["time,ax,ay,az,gx,gy,gz", *rows[begin:]])
        (tmp_path / folder / "imu.csv").write_text(text)
    done = typed(
        "view", tmp_path / "a" / "imu.csv", tmp_path / "b" / "imu.csv", "--mcap", tmp_path / "c.mcap"
    )
    assert done.code == 0, done.err
    messages = mcap_messages(tmp_path / "c.mcap", "/imu/raw", "/imu_2/raw")
    assert [len(each) for each in messages.values()] == [300, 200]
    assert {each[0][0] for each in messages.values()} == {0}


def test_rests_that_are_not_used_interrupt_no_numbering():
    def rest(start, used):
        mean = np.array([0.0, 0.0, 9.8])
        return Rest(
            start, start + 1.0, 100, mean, mean, mean, mean, used=used, remark="" if used else "moved"
        )

    found = segments_of([rest(0.0, True), rest(2.0, False), rest(4.0, True), rest(6.0, True)])
    assert [(each.state, each.label) for each in found] == [
        *(("rest", "1"), ("left out", ""), ("rest", "2"), ("turn", "2-3"), ("rest", "3")),
    ]


def test_quaternions_turn_as_their_matrices_do():
    generator = np.random.default_rng(11)
    for _ in range(50):
        direction = generator.normal(size=3)
        direction /= np.linalg.norm(direction)
        for turn in (rotation_onto(direction), generator.normal(size=4)):
            turn = turn / np.linalg.norm(turn)
            x, y, z, w = turn
            matrix = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
                ]
            )
            found = quaternion_of(matrix)
            assert abs(float(found @ turn)) == pytest.approx(1.0)
        x, y, z, w = rotation_onto(direction)
        assert [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)] == pytest.approx(direction)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["view", "{log}", "--rerun", "{0}/a.txt"], "give a name that ends in .rrd"),
        (["view", "{log}", "--mcap", "{0}/absent/a.mcap"], "does not exist; create it first"),
        (["multipose", "{log}", "--raw", "--mcap", "{0}/a.mcap"], "counts are not shown in SI units"),
        (["multipose", "--live", "udp://:9", "--rerun", "{0}/a.rrd"], "--rerun is for recordings"),
        (["view", "{0}/gyroscope.csv", "--mcap", "{0}/b.mcap"], "gyroscope readings only; leave out --mcap"),
    ],
)
def test_a_file_that_cannot_be_written_is_one_line(hand, tmp_path, words, said):
    rows = "\n".join(f"{number / 100},0,0,0.1" for number in range(300))
    (tmp_path / "gyroscope.csv").write_text(f"time,gx,gy,gz\n{rows}\n")
    done = typed(*(word.format(tmp_path, log=hand / "multipose.csv") for word in words))
    assert done.code == 2
    assert said in one_line(done.err)
    assert not list(Path(tmp_path).glob("*.mcap"))
