"""The image holds no panic and no heap, and the check of that can fail."""

from __future__ import annotations

import re

import pytest

from firmware_images import FOLDER, ROOT, VECTORS, build, build_optimised, built_image, compare, run
from repetitions import only_soak

HEAP = re.compile(rb"__rust_alloc|__rust_dealloc|GlobalAlloc|\x00(malloc|calloc|realloc|free|_sbrk)\x00")
"""Names of functions of a heap, in Rust and in C."""

PANIC = re.compile(rb"panic_fmt|panic_bounds_check|slice_index_fail|unwrap_failed|tumble_panic_is_reachable")
"""Names of functions that a panic goes through."""


def names(image, pattern):
    """All matches in an image.

    Not only symbols are looked through but debugging information too, which also names what was inlined.
    """
    return {match[0] for match in pattern.finditer(image.read_bytes())}


def test_the_image_names_no_function_of_a_heap(image):
    assert names(image, HEAP) == set()


@only_soak("links all of it once more")
def test_an_image_with_a_heap_is_found_by_its_names(image):
    built = build("reach-the-heap")
    assert built.returncode == 0, built.stderr
    assert b"__rust_alloc" in names(built_image("reach-the-heap"), HEAP)


def test_the_image_names_no_function_of_a_panic(image):
    assert names(image, PANIC) == set()


@pytest.mark.parametrize(
    ("pattern", "name"), [(PANIC, b"panic_fmt"), (HEAP, b"__rust_alloc")], ids=["panic", "heap"]
)
def test_a_program_with_panics_and_a_heap_is_found(image, pattern, name):
    """The replay on the host has both, and is built anyway."""
    assert name in names(FOLDER / "mission", pattern)


@only_soak("compiles all of the core once more")
def test_images_for_other_processors_have_no_panic_and_no_heap(other_processor):
    _, other = other_processor
    assert names(other, PANIC) == names(other, HEAP) == set()


@only_soak("compiles all of it once more")
@pytest.mark.parametrize("level", ["z", "2", "3"])
def test_differently_built_image_has_no_panic_and_flies_the_mission(image, level, tmp_path):
    optimised = build_optimised(level, tmp_path)
    assert names(optimised, PANIC) == set()
    log = tmp_path / "said.txt"
    log.write_text(run(optimised, ROOT).stdout)
    compared = compare(VECTORS, log)
    assert compared.returncode == 0, compared.stdout[-2000:] + compared.stderr


@only_soak("links all of it once more")
def test_an_image_that_can_panic_does_not_link(image):
    built = build("reach-a-panic")
    assert built.returncode != 0
    assert "undefined symbol: tumble_panic_is_reachable" in built.stderr
