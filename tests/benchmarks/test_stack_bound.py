"""The most stack of functions, out of listings of their instructions."""

from __future__ import annotations

import re

import pytest
from benchmarks.stack_bound import Function, StackBounds, disassembled, walked

LISTING = """
image:     file format elf32-littlearm

Disassembly of section .text:

00000400 <leaf>:
     400:\tb08c      \tsub\tsp, #48\t@ 0x30
     402:\tb00c      \tadd\tsp, #48\t@ 0x30
     404:\t4770      \tbx\tlr
     406:\td4d4      \tbmi.n\t3b2 <Reset+0x2>

00000408 <crate::caller<T>::push>:
     408:\tb5f0      \tpush\t{r4, r5, r6, r7, lr}
     40a:\ted2d 8b04 \tvpush\t{d8-d9}
     40e:\tf5ad 6da5 \tsub.w\tsp, sp, #1320\t@ 0x528
     412:\tb108      \tcbz\tr0, 418 <crate::caller<T>::push+0x10>
     414:\tf7ff fff4 \tbl\t400 <leaf>
     418:\tf50d 6da5 \tadd.w\tsp, sp, #1320\t@ 0x528
     41c:\tecbd 8b04 \tvpop\t{d8-d9}
     420:\te8bd 40f0 \tldmia.w\tsp!, {r4, r5, r6, r7, lr}
     424:\tf7ff bfec \tb.w\t500 <deeper>

00000500 <deeper>:
     500:\te8df f000 \ttbb\t[pc, r0]
     504:\t0402      \t.short\t0x0402
     506:\tb510      \tpush\t{r4, lr}
     508:\tbd10      \tpop\t{r4, pc}
     50a:\tf84d 8d04 \tstr.w\tr8, [sp, #-4]!
     50e:\tb082      \tsub\tsp, #8
     510:\t4798      \tblx\tr3
     512:\tb002      \tadd\tsp, #8
     514:\tf85d 8b04 \tldr.w\tr8, [sp], #4
     518:\t4770      \tbx\tlr

00000520 <{{closure}}>:
     520:\tb530      \tpush\t{r4, r5, lr}
     522:\tbd30      \tpop\t{r4, r5, pc}
"""
CALLER, LEAF, DEEPER, CLOSURE = 0x408, 0x400, 0x500, 0x520


@pytest.fixture
def functions():
    """Those of the listing; something holds the address of the closure."""
    found = {address: walked(name, code) for address, name, code in disassembled(LISTING)}
    found[CLOSURE].is_taken = True
    return found


def test_function_takes_the_stack_of_its_deepest_branch(functions):
    assert {function.name: function.depth for function in functions.values()} == {
        "leaf": 48,
        "crate::caller<T>::push": 20 + 16 + 1320,
        "deeper": 12,
        "{{closure}}": 12,
    }


def test_calls_add_up_and_a_call_in_place_of_a_return_keeps_nothing(functions):
    (first, last) = functions[CALLER].calls
    assert (first.depth, first.target) == (20 + 16 + 1320, LEAF)
    assert (last.depth, last.target) == (0, DEEPER)
    bound = StackBounds(functions, [("deeper", "closure")]).of(CALLER)
    assert bound.bytes == 20 + 16 + 1320 + 48
    assert bound.chain == ("crate::caller<T>::push", "leaf")


def test_call_by_register_counts_as_its_deepest_named_target(functions):
    bound = StackBounds(functions, [("deeper", "closure")]).of(DEEPER)
    assert (bound.bytes, bound.chain) == (12 + 12, ("deeper", "{{closure}}"))


@pytest.mark.parametrize("named", [[], [("deeper", "leaf")], [("leaf", "closure")]])
def test_a_call_by_a_register_that_nobody_names_is_refused(functions, named):
    with pytest.raises(ValueError, match="deeper calls by a register at 0x510, and nobody says whom"):
        StackBounds(functions, named).of(CALLER)


def test_a_function_that_may_come_to_call_itself_is_refused(functions):
    functions[DEEPER].is_taken = True
    with pytest.raises(ValueError, match="deeper calls deeper"):
        StackBounds(functions, [("deeper", "deeper")]).of(DEEPER)


def test_a_call_to_where_no_function_begins_is_refused(functions):
    del functions[LEAF]
    with pytest.raises(ValueError, match="no function begins at 0x400"):
        StackBounds(functions, []).of(CALLER)


@pytest.mark.parametrize("instruction", ["mov sp, r7", "sub.w sp, r7, #16", "add sp, r4", "ldr sp, [r0, #0]"])
def test_a_stack_pointer_that_goes_where_nobody_knows_is_refused(instruction):
    listing = f"00000400 <odd>:\n     400:\t46bd      \t{instruction.replace(' ', chr(9), 1)}\n"
    ((_, name, code),) = disassembled(listing)
    with pytest.raises(ValueError, match=re.escape(f"0x400: {instruction}")):
        walked(name, code)


@pytest.mark.parametrize("instruction", ["stmia.w sp, {r0, r1, ip}", "str.w sp, [r7, #-8]", "cmp sp, r0"])
def test_reading_the_stack_pointer_does_not_move_it(instruction):
    listing = f"00000400 <reads>:\n 400:\te88d 1003 \t{instruction.replace(' ', chr(9), 1)}\n"
    ((_, name, code),) = disassembled(listing)
    assert walked(name, code) == Function("reads")
