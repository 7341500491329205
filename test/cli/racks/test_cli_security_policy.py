"""`automax security-policy`: what it prints and writes, and what ROS makes of the keys."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from system.support import ROOT, automax

LINE = ROOT / "config" / "two_racks" / "line"


def paths(text: str) -> list[str]:
    return [str(item.get("path")) for item in ElementTree.fromstring(text).iter("enclave")]


def test_without_a_folder_it_prints_the_policy(ros_domain_id):
    ended = automax("security-policy", LINE, "--ros-args", "-r", "__ns:=/plant")
    assert (ended.code, ended.err) == (0, "")
    assert paths(ended.out) == ["/plant/line1/rack", "/plant/line1/recorder", "/plant/line1/operator_desk"]


def test_with_keys_it_says_how_to_go_on_and_ros_reads_them(ros_domain_id, tmp_path: Path, monkeypatch):
    """Fast DDS of the wheels was built without security: it reads the keys' folder and refuses, without a traceback."""
    folder = tmp_path / "security"
    ended = automax("security-policy", LINE, "--distributed", "--output", folder, "--keystore")
    assert (ended.code, ended.err) == (0, "")
    wanted = ["/line1/common_memory", "/line1/processor_1", "/line1/network_5", "/line1/recorder"]
    assert paths((folder / "policy.xml").read_text()) == [*wanted, "/line1/operator_desk"]
    assert all(f"--enclave {path}\n" in ended.out for path in wanted)
    assert f"ROS domain {ros_domain_id}" in ended.out
    assert "<id>" + str(ros_domain_id) + "</id>" in (folder / "keystore" / "enclaves" / "governance.xml").read_text()
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(folder / "keystore"))
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    nobody = automax("run", LINE, "--duration", "0.5", "--ros-args", "--enclave", "/line1/nobody", "--")
    assert nobody.code == 2
    assert "enclaves/line1/nobody' does not exist" in nobody.err
    own = automax("run", LINE, "--duration", "0.5", "--ros-args", "--enclave", "/line1/processor_1", "--")
    assert "Traceback" not in own.err
    assert own.code == 0 or (own.code == 2 and "doesn't have the security libraries" in own.err)
    again = automax("security-policy", LINE, "--output", folder)
    assert (again.code, again.err) == (0, ""), "it needs no keys of its own"


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [(["--keystore"], 2, "--keystore needs a folder"), (["--output", "/dev/null/x"], 2, "cannot be written")],
)
def test_wrong_usage(ros_domain_id, words, code, text):
    ended = automax("security-policy", LINE, *words)
    assert ended.code == code
    assert text in ended.err
