"""Files of text as streams of UTF-8: packed or not, in whatever encoding; nothing is unpacked on disk."""

from __future__ import annotations

import bz2
import codecs
import io
import lzma
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, cast

from tumble.foundation.errors import LogError
from tumble.foundation.log_formats import Packing, packing_of
from tumble.foundation.regular_files import open_regular

_PIECE = 1 << 18
_LARGEST_DICTIONARY = 1 << 27
"""Bytes that unpacking may keep; the head of an xz file can ask for any amount."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_LONGEST_MAGIC = 6


def open_text(path: Path, offset: int = 0) -> BinaryIO:
    """Opens a file of text as UTF-8, `offset` bytes of that behind its beginning.

    Reading raises `LogError` where a packed file is damaged or cut short.
    """
    file = open_regular(path)
    head = file.read(_LONGEST_MAGIC)
    file.seek(0)
    packing = packing_of(head)
    if packing is None and not head.startswith(_UTF_16):
        file.seek(offset)
        return file
    pieces = _pieces(file) if packing is None else _unpacked(path, file, packing)
    stream = cast("BinaryIO", io.BufferedReader(_Stream(_recoded(pieces), file), _PIECE))
    while offset > 0 and (skipped := len(stream.read(min(offset, _PIECE)))):
        offset -= skipped
    return stream


def text_size(path: Path) -> int | None:
    """Returns the number of bytes of a file of text; None where only unpacking it would show it."""
    with open_regular(path) as file:
        return None if packing_of(file.read(_LONGEST_MAGIC)) else path.stat().st_size


class _Stream(io.RawIOBase):
    """Bytes that come piece by piece."""

    def __init__(self, pieces: Iterator[bytes], file: BinaryIO) -> None:
        super().__init__()
        self._pieces = pieces
        self._file = file
        self._left = memoryview(b"")

    def readable(self) -> bool:
        """Returns True, as it can be read."""
        return True

    def readinto(self, buffer: bytearray | memoryview) -> int:  # type: ignore[override]
        """Fills as much of the buffer as one piece does; 0 at the end."""
        while not self._left:
            piece = next(self._pieces, None)
            if piece is None:
                return 0
            self._left = memoryview(piece)
        count = min(len(buffer), len(self._left))
        buffer[:count] = self._left[:count]
        self._left = self._left[count:]
        return count

    def close(self) -> None:
        """Closes the file."""
        self._file.close()
        super().close()


def _pieces(file: BinaryIO) -> Iterator[bytes]:
    while piece := file.read(_PIECE):
        yield piece


def _recoded(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """Converts UTF-16, which begins with its mark, to UTF-8; all else stays as it is."""
    first = next(pieces, b"")
    if not first.startswith(_UTF_16):
        yield first
        yield from pieces
        return
    decoder = codecs.getincrementaldecoder("utf-16")(errors="replace")
    yield decoder.decode(first).encode()
    for piece in pieces:
        yield decoder.decode(piece).encode()
    yield decoder.decode(b"", final=True).encode()


def _unpacked(path: Path, file: BinaryIO, packing: Packing) -> Iterator[bytes]:
    unpack = _unpacked_by_python if packing.name in _UNPACKERS else _unpacked_by_pyarrow
    given = 0
    try:
        for piece in unpack(file, packing.name):
            given += len(piece)
            yield piece
    except (OSError, EOFError, lzma.LZMAError) as error:
        raise LogError(
            f"{path}: the {packing.name} file is damaged or cut short, {given} bytes of it can be unpacked; "
            "copy it again"
        ) from error


def _unpacked_by_pyarrow(file: BinaryIO, name: str) -> Iterator[bytes]:
    import pyarrow as pa  # type: ignore[import-untyped]

    with pa.CompressedInputStream(file, name) as stream:
        while piece := stream.read(_PIECE):
            yield piece


_UNPACKERS: Mapping[str, Callable[[], lzma.LZMADecompressor | bz2.BZ2Decompressor]] = {
    "xz": lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_LARGEST_DICTIONARY),
    "bz2": bz2.BZ2Decompressor,
}
"""Packings of which pyarrow bounds no memory, or reads no empty stream before another."""


def _unpacked_by_python(file: BinaryIO, name: str) -> Iterator[bytes]:
    """Unpacks one stream after the other; zeros may stand between them."""
    unpacker, packed = _UNPACKERS[name](), file.read(_PIECE)
    while True:
        if piece := unpacker.decompress(packed, _PIECE):
            yield piece
        packed = b""
        if unpacker.eof:
            packed = unpacker.unused_data.lstrip(b"\x00") or file.read(_PIECE).lstrip(b"\x00")
            if not packed:
                return
            unpacker = _UNPACKERS[name]()
        elif unpacker.needs_input:
            packed = file.read(_PIECE)
            if not packed:
                raise EOFError
