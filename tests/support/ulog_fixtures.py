"""Logs of PX4, written by docs.px4.io/main/en/dev_log/ulog_file_format."""

import struct

import numpy as np

TYPES = {"uint64_t": "u8", "uint32_t": "u4", "int32_t": "i4", "uint8_t": "u1", "int16_t": "i2", "float": "f4"}
VECTOR = "float x;float y;float z;float temperature;"
HEAD = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;"
FORMATS = {
    "sensor_accel": HEAD + VECTOR + "uint8_t[3] clip_counter;uint8_t[5] _padding0;",
    "sensor_gyro": HEAD + VECTOR,
    "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;int32_t accelerometer_timestamp_relative;"
    "float[3] accelerometer_m_s2;",
    "vehicle_imu": "uint64_t timestamp;uint64_t timestamp_sample;uint32_t accel_device_id;"
    "uint32_t gyro_device_id;float[3] delta_angle;float[3] delta_velocity;uint32_t delta_angle_dt;"
    "uint32_t delta_velocity_dt;",
    "sensor_accel_fifo": HEAD
    + "float dt;float scale;uint8_t samples;int16_t[20] x;int16_t[20] y;int16_t[20] z;",
    "sensor_mag": HEAD + VECTOR,
    "vehicle_magnetometer": "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;"
    "float[3] magnetometer_ga;",
    "battery_status": "uint64_t timestamp;float voltage_v;float current_a;",
    "other": "uint64_t timestamp;float value;",
}
FORMATS["sensor_gyro_fifo"] = FORMATS["sensor_accel_fifo"]
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"


def layout(topic):
    fields = []
    for field in filter(None, FORMATS[topic].split(";")):
        kind, name = field.split(" ")
        kind, _, count = kind.partition("[")
        fields.append((name, "<" + TYPES[kind], (int(count[:-1]),)) if count else (name, "<" + TYPES[kind]))
    return np.dtype(fields)


def message(kind, body):
    return struct.pack("<HB", len(body), ord(kind)) + body


def parameter(name, value):
    kind = "int32_t" if isinstance(value, int) else "float"
    key = f"{kind} {name}".encode()
    return message("P", bytes([len(key)]) + key + struct.pack("<i" if kind == "int32_t" else "<f", value))


class ULogWriter:
    """Gathers data, and writes them in the order of time."""

    def __init__(self, parameters=None):
        self.parameters = parameters or {}
        self.topics = []
        self.data = []

    def add(self, topic, instance, time, **fields):
        """Logs records of a topic at (n,) s; a field is one value, or (n, ...)."""
        number = len(self.topics)
        self.topics.append((number, topic, instance))
        records = np.zeros(len(time), layout(topic))
        stamp = np.round(1e6 * np.asarray(time)).astype("u8")
        for name in ("timestamp", "timestamp_sample"):
            if name in records.dtype.names:
                records[name] = stamp
        for name, values in fields.items():
            records[name] = values
        for at, record in zip(stamp.tolist(), records, strict=True):
            self.data.append((at, message("D", struct.pack("<H", number) + record.tobytes())))
        return self

    def change(self, time, name, value):
        """Changes a parameter in flight."""
        self.data.append((round(1e6 * time), parameter(name, value)))
        return self

    def drop(self, time, duration):
        """Reports a dropout of so many ms."""
        self.data.append((round(1e6 * time), message("O", struct.pack("<H", duration))))
        return self

    def content(self):
        """Returns the bytes of the file."""
        definitions = b"".join(message("F", f"{name}:{text}".encode()) for name, text in FORMATS.items())
        definitions += b"".join(parameter(name, value) for name, value in self.parameters.items())
        data = b"".join(
            message("A", struct.pack("<BH", instance, number) + topic.encode())
            for number, topic, instance in self.topics
        )
        for index, (_, bytes_) in enumerate(sorted(self.data, key=lambda item: item[0])):
            data += bytes_ + (message("S", SYNC) if index % 50 == 0 else b"")
        head = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
        flags = struct.pack("<8B8B3Q", *[0] * 8, *[0] * 8, 0, 0, 0)
        return head + message("B", flags) + definitions + data

    def write(self, path):
        """Writes the file, and returns its path."""
        path.write_bytes(self.content())
        return path


def turning(generator, count, rate=200.0, start=2.0):
    """Draws times and what both triads of an IMU that is turned about read: gravity, whichever way is up."""
    time = start + np.arange(count) / rate
    up = np.cumsum(generator.normal(size=(count, 3)), axis=0)
    force = 9.8 * up / np.linalg.norm(up, axis=1, keepdims=True)
    turn = np.cumsum(generator.normal(size=(count, 3)), axis=0) / np.sqrt(count)
    return time, force.astype(np.float32).astype(np.float64), turn.astype(np.float32).astype(np.float64)


DEVICES = {"accelerometer": 2424842, "gyroscope": 2424843}
"""Ids of the devices of the first IMU."""


def sensors(writer, instance, time, force, turn, shift=0.0, added=None):
    """Logs an IMU as its sensors give it; to the ids of the first is `added`, by default its number."""
    ids = [device + (instance if added is None else added) for device in DEVICES.values()]
    axes = [dict(zip("xyz", values.T, strict=True)) for values in (force, turn)]
    writer.add("sensor_accel", instance, time, device_id=ids[0], temperature=31.5, **axes[0])
    writer.add("sensor_gyro", instance, time + shift, device_id=ids[1], temperature=32.5, **axes[1])
    return writer
