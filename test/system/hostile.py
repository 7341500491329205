"""A program that floods a rack, run apart from the test: ``python hostile.py KIND``. It prints what it has sent."""

import os
import sys
import time

TEN_MB = 10_000_000
SET = "/types/common"
HEADER = b"\x00\x01\x00\x00"


def main(kind: str) -> None:
    from automax_ros.ros.setup.environment import prepare

    prepare()
    from rclpy.context import Context
    from rclpy.node import Node

    context = Context()
    context.init(args=["--ros-args", "--disable-stdout-logs"])
    node = Node(f"hostile_{os.getpid()}", context=context, enable_rosout=False)
    print(f"sent {KINDS[kind](node, context)}", flush=True)
    os._exit(0)  # without waiting for 10 MB messages to be acknowledged


def publisher(node, type_name, name, topic=None):
    import std_msgs.msg

    made = node.create_publisher(getattr(std_msgs.msg, type_name), topic or f"{SET}/{name}/set", 10)
    deadline = time.monotonic() + 240.0
    while not made.get_subscription_count():
        assert time.monotonic() < deadline, "no rack"
        time.sleep(0.02)
    return made


def large(node, _):
    """Ten messages of 10 MB on topics of six numbers and of twelve characters."""
    text = HEADER + TEN_MB.to_bytes(4, "little") + b"a" * (TEN_MB - 1) + b"\0"
    numbers = HEADER + bytes(4) * 2 + (TEN_MB // 2).to_bytes(4, "little") + bytes(TEN_MB)
    topics = [
        (publisher(node, "Int16MultiArray", "GRID"), numbers),
        (publisher(node, "String", "NOTE"), text),
    ]
    for number in range(10):
        topic, payload = topics[number % 2]
        topic.publish(payload)
        time.sleep(0.1)
    return 10


def fast(node, _):
    """10,000 messages per second for two seconds, 200 at a time: a busy host sends them later, but no slower."""
    from std_msgs.msg import Int16

    topic, message, sent = publisher(node, "Int16", "REF"), Int16(data=5), 0
    began = time.monotonic()
    while (passed := time.monotonic() - began) < 2.0:
        for _ in range(200 if sent <= passed * 10_000 else 0):
            topic.publish(message)
            sent += 1
        time.sleep(0.001)
    return sent


def malformed(node, _):
    """Bytes that are none of the topic's messages, and requests that are none of the service's."""
    from rcl_interfaces.srv import SetParameters
    from rclpy.qos import QoSProfile

    topics = [publisher(node, "String", "NOTE"), publisher(node, "Int16MultiArray", "GRID")]
    plain = QoSProfile(depth=10, avoid_ros_namespace_conventions=True)
    asking = node.create_publisher(SetParameters.Request, "rq/types/processor_1/set_parametersRequest", plain)
    bad = [b"", HEADER[:3], HEADER + b"\xff" * 40, b"\xff" * 80, HEADER + b"\x05\x00\x00\x00ab\xff\xfe\x00"]
    for number in range(2000):
        for topic in topics:
            topic.publish(bad[number % len(bad)])
        asking.publish(bad[number % len(bad)])
        time.sleep(0.0005)
    return 6000


def requests(node, context):
    """SetParameters with a text of 10 MB, with 100,000 parameters, of an unknown type; then 2,000 small requests."""
    from rcl_interfaces.msg import Parameter, ParameterValue
    from rcl_interfaces.srv import GetParameters, SetParameters
    from rclpy.executors import SingleThreadedExecutor

    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    asking = node.create_client(SetParameters, "/types/processor_1/set_parameters")
    getting = node.create_client(GetParameters, "/types/processor_2/get_parameters")
    while not (asking.service_is_ready() and getting.service_is_ready()):
        executor.spin_once(timeout_sec=0.05)
    many = [Parameter(name=f"P{number}", value=ParameterValue(type=2)) for number in range(100_000)]
    wanted = [
        [Parameter(name="FAST.TRIM", value=ParameterValue(type=4, string_value="a" * TEN_MB))],
        many,
        [Parameter(name="FAST.TRIM", value=ParameterValue(type=99))],
    ]
    answers = []
    for parameters in wanted:
        future = asking.call_async(SetParameters.Request(parameters=parameters))
        executor.spin_until_future_complete(future, timeout_sec=240.0)
        answers.append(future.result().results[0])
    assert not any(answer.successful for answer in answers), answers
    for _ in range(2000):
        getting.call_async(GetParameters.Request(names=["use_sim_time"]))
        time.sleep(0.0005)
    return 2003


KINDS = {"large": large, "fast": fast, "malformed": malformed, "requests": requests}

if __name__ == "__main__":
    main(sys.argv[1])
