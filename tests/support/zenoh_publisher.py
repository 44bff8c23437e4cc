"""A node of rmw_zenoh as its design describes it: a token, and messages of `sensor_msgs/Imu` in CDR.

python zenoh_publisher.py END_POINT TOPIC RATE [--silent] [--field TOPIC]
python zenoh_publisher.py END_POINT --router
"""

import os
import signal
import sys

import zenoh

import ros2_publisher
from paced import numbers_at

HASH = "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"


def opened(**settings):
    """A session without multicast, as those of rmw_zenoh are."""
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    for name, value in settings.items():
        config.insert_json5(name.replace("__", "/"), value)
    return zenoh.open(config)


def main():
    end_point = sys.argv[1]
    if sys.argv[2] == "--router":
        session = opened(mode='"router"', listen__endpoints=f'["{end_point}"]')
        print("routing", session.zid(), flush=True)
        signal.pause()
    topic, rate = sys.argv[2:4]
    connect = {"connect__endpoints": f'["{end_point}"]', "listen__endpoints": '["tcp/localhost:0"]'}
    session = opened(mode='"peer"', **connect)
    domain, kind = os.environ["ROS_DOMAIN_ID"], "sensor_msgs::msg::dds_::Imu_"
    name = topic.replace("/", "%")
    # Best effort, all else by default.
    place = f"@ros2_lv/{domain}/{session.zid()}/0/10/MP/%/%/imu_driver/{name}/{kind}/{HASH}/2::,7:,:,:,,"
    tokens = [] if "--silent" in sys.argv else [session.liveliness().declare_token(place)]
    publisher = session.declare_publisher(f"{domain}{topic}/{kind}/{HASH}")
    field = None
    if "--field" in sys.argv:
        beside = sys.argv[sys.argv.index("--field") + 1]
        field = session.declare_publisher(f"{domain}{beside}/sensor_msgs::msg::dds_::MagneticField_/{HASH}")
    print("sending", len(tokens), flush=True)
    for number in numbers_at(float(rate)):
        if field is not None and number % 5 == 0:
            field.put(bytes(ros2_publisher.magnetic(number, float(rate)).serialize()))
        publisher.put(bytes(ros2_publisher.message(number, float(rate), False).serialize()))


if __name__ == "__main__":
    main()
