"""Each benchmark runs, on next to nothing; no times are judged here."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fleet_jobs import SerialEngine
from repetitions import SOAK

ROOT = Path(__file__).parents[2]

from benchmarks import (  # noqa: E402
    accuracy,
    bound,
    disturbed,
    footprint,
    goals,
    memory,
    noise,
    production,
    redundancy,
    redundancy_adoptions,
    redundancy_campaign,
    redundancy_precision,
    report,
    results,
    seeds,
    speed,
    spin,
    spin_live,
    truths,
)
from benchmarks.settings import cells  # noqa: E402


class OneThread(ThreadPoolExecutor):
    """Takes the place of processes, each of which would import all libraries for next to no work."""

    def __init__(self, _processes, mp_context=None):
        super().__init__(1)


POOLED = (accuracy, truths, spin, spin_live, redundancy_adoptions)

CELLS = [4, 13, 22, 31] if SOAK else [4, 31]
"""Numbers of the cells of accuracy that are measured, some of white noise and some with bias instability."""

MISSIONS = (3, 4) if SOAK else (1, 1)
"""Number of missions that are flown with errors, and with faults."""

LINKED = (footprint.BASELINE, "apply", "instructions")
"""Images of which the size, or what instructions they take, is measured anew."""


def shorten(keep, kept):
    """Makes benchmarks shorter than their smallest setting; what is not measured has its figures of `kept`.

    Rows that a table has by the dozen come from a few cases. No processes are timed that do next to nothing,
    and no images linked for the size of one part each: `make soak` does that.
    """
    for name, rows in (
        ("SHAKINGS", (0, 3, 7)),
        ("ROCKINGS", (0, 3, 7)),
        ("BUMPS", (0, 4)),
        ("SHARES", (0, 2)),
    ):
        keep.setattr(disturbed, name, tuple(getattr(disturbed, name)[row] for row in rows))
    times = results.load("speed", kept)
    for part in ("start_up", "help"):
        keep.setitem(speed.PARTS, part, lambda *_, part=part: times[part])
    keep.setattr(production, "main", lambda _: None)
    keep.setattr(memory, "TINY", ("ROS 1 bag",))
    keep.setattr(footprint, "build", partial(footprint.build, *LINKED))
    measured, figures = footprint.flash, results.load("footprint", kept)
    taken = {part: figures["empty_bytes"] + size for part, size in figures["flash_bytes"].items()}
    keep.setattr(footprint, "flash", lambda image: measured(image) if image in LINKED else taken[image])


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """Figures of benchmarks on their smallest setting, or as they are kept, in a folder of their own."""
    folder = tmp_path_factory.mktemp("results")
    shutil.copytree(results.RESULTS, folder, dirs_exist_ok=True)
    keep = pytest.MonkeyPatch()
    keep.setattr(results.save, "__defaults__", (folder,))
    keep.setattr(results.load, "__defaults__", (folder,))
    for module in POOLED:
        keep.setattr(module, "ProcessPoolExecutor", OneThread)
    keep.setattr(seeds, "engine_of", lambda *_: SerialEngine())
    keep.setattr(redundancy_campaign, "FLOWN", folder / "flown")
    if not SOAK:
        shorten(keep, folder)
    errors, faults = map(str, MISSIONS)
    accuracy.main(["--sessions", "2", "--cells", ",".join(map(str, CELLS))])
    disturbed.main(["--sessions", "1"])
    truths.main(["--sessions", "2"])
    spin.main(["--sessions", "2"])
    spin_live.main(["--sessions", "2"])
    speed.main(["--tiny"])
    production.main(["--tiny"])
    memory.main(["--tiny"])
    redundancy.main(["--runs", "2", "--no-push"])
    redundancy_adoptions.main(["--missions", errors, "--cores", "1"])
    keep.setattr(redundancy_campaign, "MISSIONS", MISSIONS[1])
    redundancy_campaign.main(["--missions", faults, "--jobs", "1"])
    keep.setattr(redundancy_precision, "MISSIONS", 1)
    redundancy_precision.main(["--missions", "1", "--jobs", "1"])
    footprint.main([])
    yield folder
    keep.undo()


def test_every_cell_is_measured_and_every_figure_is_a_number(measured):
    content = results.load("accuracy", measured)
    assert [cell["cell"] for cell in content["cells"]] == CELLS
    for cell in content["cells"]:
        assert 0.0 < cell["largest"]["ratio"] < 10.0
        assert 0 <= cell["above"] <= cell["parameters"] == 24
        assert set(cell["coverage"]) == set(bound.TRIADS)
    for pooled in content["pooled"].values():
        for triad in bound.TRIADS:
            for figures in pooled[triad]["groups"].values():
                assert np.isfinite(list(figures.values())).all()
                assert 0.0 < figures["ratio"] < 10.0


def test_the_pages_show_a_table_for_each_benchmark(measured, tmp_path):
    for page, tables in report.PAGES.items():
        (tmp_path / page).parent.mkdir(parents=True, exist_ok=True)
        markers = [f"<!-- benchmark:{name} -->\n<!-- /benchmark:{name} -->\n" for name in tables]
        (tmp_path / page).write_text("before\n" + "".join(markers) + "after\n", encoding="utf-8")
    assert report.main(["--root", str(tmp_path), "--check"]) == 1
    report.main(["--root", str(tmp_path)])
    pages = sorted((tmp_path / "docs" / "benchmarks").glob("*.md"))
    texts = [page.read_text(encoding="utf-8") for page in pages]
    assert all(text.startswith("before\n") and text.endswith("after\n") for text in texts)
    text = "".join(texts)
    assert "| accelerometer | bias |" in text
    assert "| `rotate-truth` |" in text
    assert "| gyroscope bias |" in text
    assert "| 10 cm |" in text
    assert "| wrongly adopted |" in text
    assert "| fault; N = 2 |" in text
    assert "| N >= 3, shaken |" in text
    assert "| fault | missions | decisions | missions decided differently |" in text
    assert "| instructions: applying a calibration to both triads |" in text
    assert "`numpy.copyto`" in text
    assert "| ROS 1 bag |" in text
    assert (tmp_path / "README.md").read_text(encoding="utf-8").count("\n| ") == 6
    device = (tmp_path / "docs" / "how-to" / "firmware.md").read_text(encoding="utf-8")
    assert "| instructions: most of any one sample |" in device
    assert "| stack: saving a record |" not in device, "no goal is set for it"
    assert report.main(["--root", str(tmp_path), "--check"]) == 0


def test_missed_goal_is_named_and_a_reached_one_is_not(measured):
    found = results.measured(report.TABLES)
    named = [goal.what for goal in goals.all_goals(found) if not goal.is_met]
    flash, apply = "Cortex-M4F: flash: all together", "Cortex-M4F: instructions of applying"
    assert flash in named
    assert not [what for what in named if what.startswith(apply)]
    told = "\n".join(report.missed(found))
    assert [what for what in named if what not in told] == []
    found["footprint"]["flash_bytes"]["everything"] = footprint.FLASH_GOALS["everything"]
    assert flash not in "\n".join(report.missed(found))


def test_cost_of_a_spin_sample_is_counted_to_its_end_and_no_further(measured):
    vectors = json.loads((ROOT / "vectors" / "spin.json").read_text(encoding="utf-8"))
    instructions = results.load("footprint", measured)["instructions"]
    pushes, slices = instructions["SpinPush"], instructions["SpinSlice"]
    assert 3 < slices["times"] < 20
    assert 500 < pushes["times"] + slices["times"] < len(vectors["cases"]["counts"])
    assert slices["largest"] <= slices["sum"] <= footprint.WHOLE_GOALS["SpinSlice"]


def test_a_page_without_its_markers_is_refused():
    with pytest.raises(ValueError, match="benchmark:speed"):
        report.placed("no markers here", "speed", "table")


def test_seeds_of_no_two_sessions_are_the_same():
    seeds = [cell.seed(session) for cell in cells() for session in (0, 999)]
    assert len(set(seeds)) == len(seeds) == 72


def test_the_covariance_of_means_is_that_of_drawn_noise():
    seed = 20_254
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    first, last, samples, runs = np.array([0, 40, 70]), np.array([30, 60, 100]), 100, 20_000
    white, instability = 0.3, 2.0
    lags = np.abs(np.subtract.outer(np.arange(samples), np.arange(samples)))
    times = 4.0 ** np.arange(1, 40)
    process = sum(instability**2 * np.log(4) / np.pi * np.exp(-lags / t) for t in times[times < 16 * samples])
    flicker = random.standard_normal((runs, samples)) @ np.linalg.cholesky(process).T
    drawn = flicker + np.sqrt(white) * random.standard_normal((runs, samples))
    means = np.column_stack([drawn[:, a:b].mean(axis=1) for a, b in zip(first, last, strict=True)])
    found = np.cov((means - flicker.mean(axis=1)[:, None]).T)
    expected = noise.covariance_of_means(first, last, samples, white, instability)
    spread = np.sqrt((np.outer(np.diag(expected), np.diag(expected)) + expected**2) / runs)
    assert (np.abs(found - expected) < 5.0 * spread).all()


def test_bound_of_one_axis_without_nuisance_is_that_of_least_squares():
    """With a perfect reference every row of M and b is a linear fit of its own."""
    ups = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], dtype=float)
    covariance = bound.NoiseCovariance(1e-14 * np.eye(6), 1e-4 * np.eye(6))
    found = bound.accelerometer_bound(np.eye(3), np.zeros(3), 9.8 * ups, covariance)
    np.testing.assert_allclose(found.sigma[:3], 1e-2 / np.sqrt(6), rtol=1e-4)
    np.testing.assert_allclose(found.sigma[3:6], 1e-2 / (9.8 * np.sqrt(2)), rtol=1e-4)


def test_angles_in_numpy_are_those_of_the_simulator():
    from tumble.tools.simulate import simulate_turntable

    unit = simulate_turntable(seed=3, rest_seconds=1.0).target_units[0]
    for true in (unit.accelerometer, unit.gyroscope):
        stated = np.concatenate([true.b, np.diag(true.K), true.non_orthogonality, true.mounting])
        np.testing.assert_allclose(bound.parts(true.M, true.b), stated, atol=1e-12)
