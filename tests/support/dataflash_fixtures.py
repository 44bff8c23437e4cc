"""Logs of ArduPilot, as bytes and as text (ardupilot.org/dev/docs/code-overview-adding-a-new-log-message)."""

import struct

import numpy as np

LAYOUTS = {
    "FMT": (0x80, "BBnNZ", "Type,Length,Name,Format,Columns"),
    "PARM": (0x81, "QNff", "TimeUS,Name,Value,Default"),
    "IMU": (0x82, "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"),
    "ACC": (0x83, "QBQfff", "TimeUS,I,SampleUS,AccX,AccY,AccZ"),
    "GYR": (0x84, "QBQfff", "TimeUS,I,SampleUS,GyrX,GyrY,GyrZ"),
    "ISBH": (0x85, "QHBBHHQf", "TimeUS,N,type,instance,mul,smp_cnt,SampleUS,smp_rate"),
    "ISBD": (0x86, "QHHaaa", "TimeUS,N,seqno,x,y,z"),
    "IMU2": (0x87, "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    "MAG": (0x89, "QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S"),
    "BAT": (0x8A, "QBff", "TimeUS,Inst,Volt,Curr"),
    "MODE": (0x88, "QMB", "TimeUS,Mode,ModeNum"),
}
CODES = {"n": "4s", "N": "16s", "Z": "64s", "a": "64s", "M": "b"}


def coded(letters):
    return "<" + "".join(CODES.get(letter, letter) for letter in letters)


def as_bytes(value):
    return value if isinstance(value, bytes) else value.encode() if isinstance(value, str) else value


def definition(kind, name, letters, columns):
    """Returns the message that lays out those of a type."""
    length = 3 + struct.calcsize(coded(letters))
    return b"\xa3\x95\x80" + struct.pack(
        "<BB4s16s64s", kind, length, name.encode(), letters.encode(), columns.encode()
    )


class DataFlashWriter:
    """Gathers messages in the order in which they are written."""

    def __init__(self, parameters=None):
        self.messages = []
        for name, value in (parameters or {}).items():
            self.add("PARM", 0, name, float(value), 0.0)

    def add(self, name, *values):
        """Logs a message."""
        self.messages.append((name, values))
        return self

    def triads(self, kind, time, force, turn, instance=0, temperature=31.5):
        """Logs what an IMU reads at (n,) s: kind IMU, IMU2, or ACC, which brings GYR."""
        for at, f, w in zip(np.round(1e6 * time).astype(int).tolist(), force, turn, strict=True):
            if kind == "IMU":
                self.add("IMU", at, instance, *w, *f, 0, 0, temperature, 1, 1, 1000, 1000)
            elif kind == "IMU2":
                self.add("IMU2", at, *w, *f)
            else:
                self.add("ACC", at + 40, instance, at, *f)
                self.add("GYR", at + 60, instance, at + 10, *w)
        return self

    def batch(self, number, triad, instance, start, rate, multiplier, counts):
        """Logs a batch of (n, 3) counts."""
        now = len(self.messages)  # us, as of when a message is written
        self.add("ISBH", now, number, triad, instance, multiplier, len(counts), round(1e6 * start), rate)
        for piece in range(0, len(counts), 32):
            rows = np.zeros((32, 3), "<i2")
            part = counts[piece : piece + 32]
            rows[: len(part)] = part
            self.add("ISBD", now, number, piece // 32, *(rows[:, axis].tobytes() for axis in range(3)))
        return self

    def content(self):
        """Returns the bytes of a .bin file."""
        head = b"".join(
            definition(kind, name, letters, columns) for name, (kind, letters, columns) in LAYOUTS.items()
        )
        return head + b"".join(
            bytes((0xA3, 0x95, LAYOUTS[name][0]))
            + struct.pack(coded(LAYOUTS[name][1]), *map(as_bytes, values))
            for name, values in self.messages
        )

    def text(self):
        """Returns the text of a .log file."""
        lines = []
        for name, (kind, letters, columns) in LAYOUTS.items():
            length = 3 + struct.calcsize(coded(letters))
            lines.append(f"FMT, {kind}, {length}, {name}, {letters}, {columns}")
        for name, values in self.messages:
            if name != "ISBD":
                lines.append(
                    ", ".join([name, *(f"{v:.9g}" if isinstance(v, float) else str(v) for v in values)])
                )
        return "\n".join(lines) + "\n"

    def write(self, path):
        """Writes the file, text where its name ends with .log, and returns its path."""
        path.write_bytes(self.text().encode() if path.suffix == ".log" else self.content())
        return path
