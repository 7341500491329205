"""The package as a whole: one version, its entry points, what it needs, its compiled messages."""

import ast
import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from xml.etree import ElementTree

import pytest
from packaging.requirements import Requirement
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import automax_ros
from automax_ros.ros.setup import environment
from automax_ros.ros.setup.environment import RosUnavailable, wheels_installed

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "automax_ros"
MESSAGES = sorted(path.stem for path in (ROOT / "msg_defs" / "msg").glob("*.msg"))

ROOMS_WITH_ROS = {"ros", "cli"}
JOINED = "panel/joined_rack.py"
"""The only part of the panel that needs ROS: a recording and a simulated run are shown without."""
ROS_PACKAGES = {
    "ament_index_python", "automax_msgs", "builtin_interfaces", "diagnostic_msgs", "geometry_msgs", "launch",
    "launch_ros", "lifecycle_msgs", "rcl_interfaces", "rclpy", "rosgraph_msgs", "rosidl_parser", "sensor_msgs",
    "std_msgs", "std_srvs",
}  # fmt: skip
ROSDEP_KEYS = {"lz4": "python3-lz4", "numpy": "python3-numpy", "yaml": "python3-yaml", "zstandard": "python3-zstandard"}
WITHOUT_KEY = {"automax_ros", "distributed", "librt", "matplotlib", "mcap", "mypy_extensions", "scipy", "websockets"}
"""Imported, but ours, wanted for pictures, clusters, the panel or types only, or without a key of rosdep."""


def imports_of(path: Path) -> Iterator[tuple[int, str]]:
    """Line and absolute name of everything that a source imports, wherever in the file the import stands."""
    package = list(path.relative_to(ROOT).parent.parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((node.lineno, f"{module}.{alias.name}") for alias in node.names)


def test_version_is_the_same_everywhere():
    versions = {
        "package.xml": ElementTree.parse(ROOT / "package.xml").findtext("version"),
        "msg_defs/package.xml": ElementTree.parse(ROOT / "msg_defs" / "package.xml").findtext("version"),
        "installed": metadata.version("automax_ros"),
    }
    assert versions == dict.fromkeys(versions, automax_ros.__version__)


def test_package_xml_names_the_messages_and_the_build_type():
    package = ElementTree.parse(ROOT / "package.xml")
    assert package.getroot().get("format") == "3"
    assert package.findtext("export/build_type") == "ament_python"
    assert "automax_msgs" in [element.text for element in package.findall("exec_depend")]
    messages = ElementTree.parse(ROOT / "msg_defs" / "package.xml")
    assert messages.findtext("member_of_group") == "rosidl_interface_packages"


def test_package_xml_names_what_is_imported_and_nothing_else():
    sources = [path for folder in ("automax_ros", "launch", "examples") for path in (ROOT / folder).rglob("*.py")]
    imported = {name.partition(".")[0] for path in sources for _, name in imports_of(path)}
    keys = {ROSDEP_KEYS.get(name, name) for name in imported - set(sys.stdlib_module_names) - WITHOUT_KEY}
    package = ElementTree.parse(ROOT / "package.xml")
    named = [element.text for element in package.findall("exec_depend")]
    assert sorted(named) == sorted({*keys, "rosgraph_msgs"})  # /clock's type is made by its name


def test_automax_is_the_console_script():
    scripts = metadata.entry_points(group="console_scripts", name="automax")
    assert [script.value for script in scripts] == ["automax_ros.cli.main:entry"]


@pytest.mark.parametrize("version", ["3.3.2", "3.3.4", "4.0"])
def test_empy_that_cannot_build_the_messages_is_not_installed(version):
    """Tried: 3.3 replaces sys.stdout, which the tools redirect; 4.0 lacks a setting that the generators ask for."""
    requirements = [Requirement(text) for text in metadata.requires("automax_ros") or ()]
    (empy,) = [item for item in requirements if item.name == "empy"]
    assert version not in empy.specifier
    assert {"4.0.1", "4.1", "4.2", "4.2.1"} == set(empy.specifier.filter(["4.0.1", "4.1", "4.2", "4.2.1"]))


def test_ament_index_marker_is_there_and_empty():
    assert (ROOT / "resource" / "automax_ros").read_bytes() == b""


def test_every_folder_with_sources_is_a_python_package():
    without = {path.parent for path in PACKAGE.rglob("*.py") if not (path.parent / "__init__.py").exists()}
    assert not without


def module_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def test_library_loads_without_ros():
    below = [path for path in sorted(PACKAGE.rglob("*.py")) if path.relative_to(PACKAGE).parts[0] not in ROOMS_WITH_ROS]
    below.remove(PACKAGE / JOINED)
    modules = [module_of(path) for path in below]
    program = (
        "import importlib, sys\n"
        f"for module in {modules}: importlib.import_module(module)\n"
        f"print(*sorted({{name.partition('.')[0] for name in sys.modules}} & {ROS_PACKAGES}))"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, cwd=ROOT)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == ""


def installed_hashes() -> dict[str, str]:
    """Type hash of every automax_msgs type as the build wrote it."""
    from ament_index_python import get_package_share_directory

    share = Path(get_package_share_directory("automax_msgs"))
    hashes = {}
    for message in MESSAGES:
        description = json.loads((share / "msg" / f"{message}.json").read_text())
        hashes.update({entry["type_name"]: entry["hash_string"] for entry in description["type_hashes"]})
    return hashes


@pytest.mark.parametrize("message", MESSAGES)
def test_type_hash_equals_an_independent_computation(message):
    store = get_typestore(Stores.ROS2_JAZZY)
    for name in MESSAGES:
        text = (ROOT / "msg_defs" / "msg" / f"{name}.msg").read_text()
        store.register(get_types_from_msg(text, f"automax_msgs/msg/{name}"))
    assert installed_hashes()[f"automax_msgs/msg/{message}"] == store.hash_rihs01(f"automax_msgs/msg/{message}")


def test_message_index_names_every_definition():
    from ament_index_python import get_resource

    content, _ = get_resource("rosidl_interfaces", "automax_msgs")
    assert {name for name in content.split() if name.endswith(".msg")} == {f"msg/{name}.msg" for name in MESSAGES}


@pytest.mark.parametrize("message", MESSAGES)
def test_empty_message_survives_serialization(message):
    from rclpy.serialization import deserialize_message, serialize_message

    kind = getattr(pytest.importorskip("automax_msgs.msg"), message)
    assert deserialize_message(serialize_message(kind()), kind) == kind()


def filled_scan():
    """A scan with nested messages, sequences of numbers, of strings and of messages, at the limits of their types."""
    from automax_msgs.msg import Scan, ScanError, Values
    from builtin_interfaces.msg import Time

    return Scan(
        stamp=Time(sec=2**31 - 1, nanosec=999_999_999),
        slot=255,
        task="SPEED_LOOP",
        scan=2**64 - 1,
        full=True,
        latched=Values(variable=[0, 2**16 - 1], element=[0, 2**32 - 1], value=[-0.1, 1e300], text=["", "Grüße"]),
        committed=Values(variable=list(range(1000)), element=[0] * 1000, value=[float(n) for n in range(1000)]),
        errors=[ScanError(line=line, code=7000 + line) for line in range(20)],
    )


def test_filled_message_survives_serialization():
    from automax_msgs.msg import Scan
    from rclpy.serialization import deserialize_message, serialize_message

    assert deserialize_message(serialize_message(filled_scan()), Scan) == filled_scan()


def test_serialized_message_is_the_cdr_that_rosbags_reads():
    from rclpy.serialization import serialize_message

    store = get_typestore(Stores.ROS2_JAZZY)
    for name in MESSAGES:
        text = (ROOT / "msg_defs" / "msg" / f"{name}.msg").read_text()
        store.register(get_types_from_msg(text, f"automax_msgs/msg/{name}"))
    scan = store.deserialize_cdr(serialize_message(filled_scan()), "automax_msgs/msg/Scan")
    assert scan.latched.text == ["", "Grüße"]
    assert scan.committed.value.tolist() == list(range(1000))
    assert [error.code for error in scan.errors] == list(range(7000, 7020))


PUBLISHER = """
import sys, time
sys.path[:0] = [sys.argv[1]]
from automax_ros.ros.setup.environment import prepare
prepare()
import rclpy
from automax_msgs.msg import Scan
from test_package import filled_scan
rclpy.init()
node = rclpy.create_node("publisher")
publisher = node.create_publisher(Scan, "scans", 10)
while publisher.get_subscription_count() == 0:
    time.sleep(0.01)
publisher.publish(filled_scan())
sys.stdin.readline()  # stay until the reader is done
rclpy.shutdown()
sys.exit(5)
"""


def test_message_crosses_to_another_process(ros_domain_id):
    import rclpy
    from automax_msgs.msg import Scan
    from rclpy.executors import SingleThreadedExecutor

    context = rclpy.Context()
    rclpy.init(context=context)
    received = []
    node = rclpy.create_node("reader", context=context)
    node.create_subscription(Scan, "scans", received.append, 10)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    command = [sys.executable, "-c", PUBLISHER, str(ROOT / "test")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, text=True) as publisher:
        try:
            while not received and publisher.poll() is None:
                executor.spin_once(timeout_sec=0.1)
            publisher.communicate("done\n", timeout=240)
        finally:
            publisher.kill()
            executor.shutdown()
            node.destroy_node()
            rclpy.shutdown(context=context)
    assert received == [filled_scan()]
    assert publisher.returncode == 5


RESTARTED_PROGRAM = """
import sys
from automax_ros.ros.setup.environment import prepare
prepare()
import os, rclpy
print(sys.argv[1:], sys.stdin.read(), os.getpid())
print(rclpy.__file__)
sys.exit(7)
"""


@pytest.mark.skipif(not wheels_installed(), reason="ROS 2 is installed from the distribution")
@pytest.mark.parametrize("trouble", ["none", "python_path", "library_path", "both"])
def test_prepare_keeps_the_program_in_a_shell_with_another_ros(tmp_path, trouble):
    """Whatever is sourced: the own rclpy, and the command line, input, process id and exit code as they were."""
    (tmp_path / "rclpy").mkdir()
    (tmp_path / "rclpy" / "__init__.py").write_text("raise RuntimeError('another rclpy')")
    variables = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    if trouble in {"python_path", "both"}:
        variables["PYTHONPATH"] = str(tmp_path)
    if trouble in {"library_path", "both"}:
        variables["LD_LIBRARY_PATH"] = str(tmp_path)
        variables["AMENT_PREFIX_PATH"] = str(tmp_path)
    command = [sys.executable, "-c", RESTARTED_PROGRAM, "one", "two words"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=variables, cwd=ROOT
    ) as process:
        output, _ = process.communicate("typed", timeout=240)
    first, second = output.splitlines()
    assert first == f"['one', 'two words'] typed {process.pid}"
    assert Path(second).is_relative_to(sys.prefix)
    assert process.returncode == 7


def test_prepare_refuses_to_restart_where_it_must_not(monkeypatch, tmp_path):
    (tmp_path / "rclpy").mkdir()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr(environment, "wheels_installed", lambda: True)
    with pytest.raises(RosUnavailable, match=r"unset .*PYTHONPATH"):
        environment.prepare(may_restart=False)


def test_missing_messages_name_the_command(monkeypatch):
    monkeypatch.setitem(sys.modules, "automax_msgs.msg", None)
    monkeypatch.setattr(environment, "wheels_installed", lambda: True)
    monkeypatch.setattr(environment, "_needed_changes", dict)
    with pytest.raises(RosUnavailable, match=r"cannot import automax_msgs .*`make setup`"):
        environment.prepare()


@pytest.mark.parametrize("trouble", ["absent", "other fields"])
def test_messages_of_another_version_name_the_command(monkeypatch, trouble):
    """As after an update without `make setup`."""
    messages = pytest.importorskip("automax_msgs.msg")
    if trouble == "absent":
        monkeypatch.delattr(messages, "TaskTable")
    else:
        monkeypatch.setattr(messages, "TaskTable", messages.TaskInfo)
    with pytest.raises(RosUnavailable, match=r"another version .*TaskTable.*`(make setup|colcon build .*)`"):
        environment.prepare(may_restart=False)


def test_message_definitions_of_cmake_and_setup_agree():
    """Both builds take all of msg/ and depend on the same packages."""
    cmake = (ROOT / "msg_defs" / "CMakeLists.txt").read_text()
    dependencies = re.search(r"DEPENDENCIES ([\w ]+)\)", cmake)
    tool = (ROOT / "tools" / "build_messages.py").read_text()
    assert dependencies is not None
    assert f"DEPENDENCIES = {tuple(dependencies[1].split())!r}".replace("'", '"') in tool
