"""A message in protocol buffers of nobody's package, made at run time."""

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory


def imu_message():
    """Class of a message with a time in us and both triads."""
    file = descriptor_pb2.FileDescriptorProto(name="board.proto", package="board", syntax="proto3")
    message = file.message_type.add(name="Imu")
    field = descriptor_pb2.FieldDescriptorProto
    names = ("time_us", "acc_x", "acc_y", "acc_z", "gyro_x", "gyro_y", "gyro_z")
    for number, name in enumerate(names, start=1):
        kind = field.TYPE_INT64 if name == "time_us" else field.TYPE_DOUBLE
        message.field.add(name=name, number=number, type=kind, label=field.LABEL_OPTIONAL)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("board.Imu"))
