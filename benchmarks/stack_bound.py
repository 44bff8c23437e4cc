"""Most stack that a function of a Cortex-M image can take, from its instructions.

Each function is walked from its start, along all branches, with the depth of the stack at each instruction; a
call adds the depth there to what the callee takes. An unknown instruction is a `ValueError`, never a guess.
"""

from __future__ import annotations

import re
import struct
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

WORD = 4
CONDITIONS = ("eq", "ne", "cs", "cc", "mi", "pl", "vs", "vc", "hi", "ls", "ge", "lt", "gt", "le")
TABLE_BRANCHES = ("tbb", "tbh")
FILL = "d4d4"
"""Padding that the linker puts between functions; objdump takes it for the last instruction of the one
before."""

_HEADING = re.compile(r"^([0-9a-f]+) <(.+)>:$")
_LINE = re.compile(r"^\s*([0-9a-f]+):\t([0-9a-f ]+)\t(\S+)(?:\t([^@;]*))?")
_TARGET = re.compile(r"(?:^|, )([0-9a-f]+) <")
_CONTENT = re.compile(r"^ [0-9a-f]+ ((?:[0-9a-f]{8} ){1,4})")


@dataclass(frozen=True)
class Instruction:
    """One, as objdump writes it."""

    address: int
    code: str
    operation: str
    operands: str


@dataclass(frozen=True)
class Call:
    """A call out of a function: bytes of stack taken there, its place, its target if no register holds it."""

    depth: int
    place: int
    target: int | None


@dataclass
class Function:
    """Stack that a function takes by itself, bytes, and the functions that it calls."""

    name: str
    depth: int = 0
    calls: list[Call] = field(default_factory=list)
    is_taken: bool = False
    """Indicates whether the image holds its address as a constant, so that a register may lead to it."""


@dataclass(frozen=True)
class StackBound:
    """Most bytes of stack, and the functions in which they are taken, each called by the one before it."""

    bytes: int
    chain: tuple[str, ...]


class StackBounds:
    """Bounds of the functions of an image."""

    def __init__(self, functions: Mapping[int, Function], by_register: Sequence[tuple[str, str]]) -> None:
        """`by_register`: patterns of names of callers and of whom registers lead to; the first counts."""
        self._functions = functions
        self._by_register = by_register
        self._known: dict[int, StackBound] = {}
        self._under_way: list[int] = []

    def of(self, address: int) -> StackBound:
        """Bounds of the function at an address.

        Raises `ValueError` where it may come to call itself, or calls an unknown function by a register.
        """
        if address not in self._known:
            if address in self._under_way:
                around = self._under_way[self._under_way.index(address) :]
                raise ValueError(" calls ".join(self._functions[each].name for each in [*around, address]))
            self._under_way.append(address)
            self._known[address] = self._worked_out(address)
            self._under_way.pop()
        return self._known[address]

    def _worked_out(self, address: int) -> StackBound:
        function = self._functions.get(address)
        if function is None:
            raise ValueError(f"no function begins at {address:#x}, which is called")
        most = StackBound(function.depth, (function.name,))
        for call in function.calls:
            for target in self._targets(function, call):
                below = self.of(target)
                if call.depth + below.bytes > most.bytes:
                    most = StackBound(call.depth + below.bytes, (function.name, *below.chain))
        return most

    def _targets(self, caller: Function, call: Call) -> Sequence[int]:
        if call.target is not None:
            return [call.target]
        named = next((callee for name, callee in self._by_register if re.search(name, caller.name)), None)
        taken = [at for at, function in self._functions.items() if function.is_taken]
        found = [at for at in taken if named and re.search(named, self._functions[at].name)]
        if not found:
            raise ValueError(f"{caller.name} calls by a register at {call.place:#x}, and nobody says whom")
        return found


def functions(image: Path) -> dict[int, Function]:
    """All functions of an image, by address."""
    listed = list(disassembled(_said("arm-none-eabi-objdump", "--disassemble", "--demangle", str(image))))
    constants = set(_words(_said("arm-none-eabi-objdump", "--full-contents", str(image))))
    # The lower half of an address that code puts together of two halves.
    halves = {_immediate(each) for _, _, code in listed for each in code if each.operation == "movw"}
    found = {address: walked(name, code) for address, name, code in listed}
    for address, function in found.items():
        pointer = address | 1
        function.is_taken = pointer in constants or pointer & 0xFFFF in halves
    return found


def disassembled(listing: str) -> Iterator[tuple[int, str, list[Instruction]]]:
    """Address, name and instructions of each function, of what objdump printed."""
    address, name, code = 0, "", list[Instruction]()
    for line in listing.splitlines():
        if heading := _HEADING.match(line):
            if code:
                yield address, name, _without_fill(code)
            address, name, code = int(heading[1], 16), heading[2], []
        elif found := _LINE.match(line):
            code.append(Instruction(int(found[1], 16), found[2].strip(), found[3], (found[4] or "").strip()))
    if code:
        yield address, name, _without_fill(code)


def _without_fill(code: list[Instruction]) -> list[Instruction]:
    while code and code[-1].code == FILL:
        code = code[:-1]
    return code


def walked(name: str, code: list[Instruction]) -> Function:
    """Analysis of a function's stack, by the depth at each of its instructions that is reached."""
    found = Function(name)
    place = {instruction.address: number for number, instruction in enumerate(code)}
    reached: set[int] = set()
    # A table's targets are not in the listing: behind it, what nothing else leads to is one.
    tables: list[tuple[int, int]] = []
    waiting = [(0, 0)]
    while waiting:
        number, depth = waiting.pop()
        if number < len(code) and number not in reached and _is_code(code[number]):
            reached.add(number)
            instruction = code[number]
            after = depth + _pushed(instruction)
            found.depth = max(found.depth, after)
            target = _target(instruction)
            if target in place:
                waiting.append((place[target], after))
            elif target is not None or _is_by_register(instruction):
                found.calls.append(Call(after, instruction.address, target))
            if instruction.operation in TABLE_BRANCHES:
                tables.append((number, after))
            if not _ends(instruction):
                waiting.append((number + 1, after))
        if not waiting:
            waiting.extend(_behind_tables(code, tables, reached))
    return found


def _behind_tables(
    code: list[Instruction], tables: list[tuple[int, int]], reached: set[int]
) -> Iterator[tuple[int, int]]:
    """The first instruction behind a table that was not reached, and the depth there."""
    for table, depth in tables:
        for number in range(table + 1, len(code)):
            if number not in reached and _is_code(code[number]):
                yield number, depth
                return


def _is_code(instruction: Instruction) -> bool:
    return not instruction.operation.startswith(".")


def _branch(instruction: Instruction) -> str | None:
    """Which branch it is, without its condition and width; none where it is none."""
    operation = instruction.operation.partition(".")[0]
    for condition in CONDITIONS:
        if operation in (f"b{condition}", f"bl{condition}", f"bx{condition}", f"blx{condition}"):
            return operation.removesuffix(condition)
    return operation if operation in ("b", "bl", "bx", "blx", "cbz", "cbnz") else None


def _target(instruction: Instruction) -> int | None:
    if _branch(instruction) is None:
        return None
    found = _TARGET.search(instruction.operands)
    return int(found[1], 16) if found else None


def _is_by_register(instruction: Instruction) -> bool:
    return _branch(instruction) in ("bx", "blx") and instruction.operands != "lr"


def _is_conditional(instruction: Instruction) -> bool:
    return instruction.operation.partition(".")[0].endswith(CONDITIONS)


def _ends(instruction: Instruction) -> bool:
    """Returns whether nothing behind it is reached from it."""
    if instruction.operation in (*TABLE_BRANCHES, "udf"):
        return True
    leaves = _branch(instruction) in ("b", "bx") or _returns(instruction)
    return leaves and not _is_conditional(instruction)


def _returns(instruction: Instruction) -> bool:
    return instruction.operation.startswith(("pop", "ldm")) and "pc}" in instruction.operands


def _pushed(instruction: Instruction) -> int:
    """Bytes by which an instruction makes the stack deeper.

    Raises `ValueError` where it changes the pointer in a way that is not known.
    """
    operation, operands = instruction.operation.partition(".")[0], instruction.operands
    if _returns(instruction):
        return 0
    if found := re.fullmatch(r"(?:sp!, )?{(.+)}", operands):
        moved = sum(_registers(found[1]))
        if operation in ("push", "vpush", "stmdb", "vstmdb"):
            return moved
        if operation in ("pop", "vpop", "ldmia", "vldmia"):
            return -moved
    if found := re.fullmatch(r"(?:sp, )?sp, #(\d+)", operands):
        if operation in ("sub", "subw"):
            return int(found[1])
        if operation in ("add", "addw"):
            return -int(found[1])
    if found := re.search(r"\[sp, #-(\d+)\]!$", operands):
        return int(found[1])
    if found := re.search(r"\[sp\], #(\d+)$", operands):
        return -int(found[1])
    only_reads = operation in ("cmp", "cmn", "tst") or operation.startswith("str")
    if re.match(r"sp!|sp, (?!{)", operands) and not only_reads:
        raise ValueError(f"{instruction.address:#x}: {instruction.operation} {operands} is not understood")
    return 0


def _registers(operands: str) -> Iterator[int]:
    """Bytes of each register of a list, or of each range."""
    for part in operands.split(", "):
        first, _, last = part.partition("-")
        size = 2 * WORD if first.startswith("d") else WORD
        yield size * (int(last[1:]) - int(first[1:]) + 1 if last else 1)


def _immediate(instruction: Instruction) -> int:
    return int(instruction.operands.partition("#")[2], 0)


def _words(contents: str) -> Iterator[int]:
    """The words in what objdump printed of the contents of an image."""
    for line in contents.splitlines():
        if found := _CONTENT.match(line):
            for (word,) in struct.iter_unpack("<I", bytes.fromhex(found[1].replace(" ", ""))):
                yield word


def _said(*command: str) -> str:
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
