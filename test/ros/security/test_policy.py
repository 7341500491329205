"""Policies, permissions and governance: their form, and what they allow racks, recorders and operators."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from automax_ros.ros.security.policy import (
    Validity,
    governance_text,
    permissions_text,
    policy_text,
    read_topics,
    written_topics,
)
from automax_ros.ros.security.profiles import Enclave, Profile, operator_of, recorder_of

RACK = Enclave(
    "/pm1/rack",
    (
        Profile(
            "/pm1",
            "common_memory",
            publish=("/parameter_events", "/pm1/common/REF", "/pm1/variables", "/rosout"),
            subscribe=("/pm1/common/REF/set",),
            reply=("/pm1/common_memory/get_parameters",),
        ),
        Profile(
            "/pm1",
            "network_5",
            publish=("/dcsnet/PAPER", "/diagnostics", "/parameter_events", "/rosout"),
            subscribe=("/dcsnet/PAPER", "/pm1/bus"),
            reply=("/pm1/network_5/get_parameters",),
        ),
    ),
)
RECORDER, OPERATOR = recorder_of("/pm1", [RACK]), operator_of("/pm1", [RACK])
VALID = Validity("2026-01-01T00:00:00", "2036-01-01T00:00:00")

CHILDREN = {
    "policy": {"enclaves"},
    "enclaves": {"enclave"},
    "enclave": {"profiles"},
    "profiles": {"profile"},
    "profile": {"topics", "services"},
    "topics": {"topic"},
    "services": {"service"},
    "topic": set(),
    "service": set(),
}
ATTRIBUTES = {
    "policy": {"version"},
    "enclave": {"path"},
    "profile": {"ns", "node"},
    "topics": {"publish", "subscribe"},
    "services": {"reply", "request"},
}
"""The form of a policy as SROS 2 reads it, version 0.2.0, as far as we write it."""


def problems(element: ElementTree.Element) -> list[str]:
    """What is wrong with a policy's form, from an element on."""
    found = [f"{element.tag}/{child.tag}" for child in element if child.tag not in CHILDREN[element.tag]]
    found += [f"{element.tag} {name}" for name in element.attrib if name not in ATTRIBUTES.get(element.tag, set())]
    if CHILDREN[element.tag] and not len(element):
        found.append(f"{element.tag} is empty")
    if element.tag in ("topics", "services") and list(element.attrib.values()) != ["ALLOW"]:
        found.append(f"{element.tag} {element.attrib}")
    if element.tag in ("topic", "service") and not re.fullmatch(r"(/[A-Za-z_][A-Za-z0-9_]*)+", element.text or ""):
        found.append(f"{element.tag} {element.text!r}")
    return found + [problem for child in element for problem in problems(child)]


def test_a_policy_has_the_form_that_sros_2_reads():
    root = ElementTree.fromstring(policy_text([RACK, RECORDER, OPERATOR]))
    assert (root.tag, root.get("version")) == ("policy", "0.2.0")
    assert problems(root) == []
    assert [item.get("path") for item in root.iter("enclave")] == ["/pm1/rack", "/pm1/recorder", "/pm1/operator_desk"]


def allowed(root: ElementTree.Element, path: str) -> dict[tuple[str, str], set[str]]:
    """What a policy allows an enclave: names by kind and verb."""
    found: dict[tuple[str, str], set[str]] = {}
    for enclave in root.iter("enclave"):
        for group in enclave.iter() if enclave.get("path") == path else ():
            for verb in group.attrib if group.tag in ("topics", "services") else ():
                found.setdefault((group.tag, verb), set()).update(item.text or "" for item in group)
    return found


def test_recorders_hear_and_say_nothing():
    assert allowed(ElementTree.fromstring(policy_text([RECORDER])), "/pm1/recorder") == {
        ("topics", "subscribe"): {"/dcsnet/PAPER", "/diagnostics", "/pm1/common/REF", "/pm1/variables", "/rosout"}
    }


def test_operators_write_what_the_rack_takes_in_its_namespace_and_call_what_it_serves():
    found = allowed(ElementTree.fromstring(policy_text([OPERATOR])), "/pm1/operator_desk")
    assert found["services", "request"] == {"/pm1/common_memory/get_parameters", "/pm1/network_5/get_parameters"}
    assert "/pm1/common/REF/set" in found["topics", "publish"]
    assert "/dcsnet/PAPER" not in found["topics", "publish"], "nobody at a desk is a rack"
    assert ("services", "reply") not in found


def test_in_dds_services_are_two_topics():
    assert "rq/pm1/common_memory/get_parametersRequest" in read_topics(RACK)
    assert "rr/pm1/common_memory/get_parametersReply" in written_topics(RACK)
    assert "rq/pm1/common_memory/get_parametersRequest" in written_topics(OPERATOR)
    assert "rr/pm1/common_memory/get_parametersReply" in read_topics(OPERATOR)
    assert "rt/pm1/common/REF/set" in read_topics(RACK)
    assert "rt/pm1/common/REF" not in read_topics(RACK)
    assert written_topics(RECORDER) == ["ros_discovery_info"]


@pytest.mark.parametrize("enclave", [RACK, RECORDER, OPERATOR], ids=lambda item: item.path)
def test_permissions_allow_this_and_deny_the_rest(enclave):
    root = ElementTree.fromstring(permissions_text(enclave, 42, VALID))
    grant = root.find("permissions/grant")
    assert grant is not None
    assert [child.tag for child in grant] == ["subject_name", "validity", "allow_rule", "default"]
    assert grant.findtext("subject_name") == f"CN={enclave.path}"
    assert grant.findtext("default") == "DENY"
    rule = grant.find("allow_rule")
    assert rule is not None
    assert [child.tag for child in rule] == ["domains", "publish", "subscribe"]
    assert rule.findtext("domains/id") == "42"
    assert [item.text for item in rule.findall("publish/topics/topic")] == written_topics(enclave)
    assert [item.text for item in rule.findall("subscribe/topics/topic")] == read_topics(enclave)


def test_governance_lets_nobody_in_without_a_certificate():
    root = ElementTree.fromstring(governance_text(7))
    rule = root.find("domain_access_rules/domain_rule")
    assert rule is not None
    assert rule.findtext("domains/id") == "7"
    assert rule.findtext("allow_unauthenticated_participants") == "false"
    assert rule.findtext("enable_join_access_control") == "true"
    topic = rule.find("topic_access_rules/topic_rule")
    assert topic is not None
    assert {topic.findtext(f"enable_{what}_access_control") for what in ("read", "write")} == {"true"}
    assert topic.findtext("data_protection_kind") == "ENCRYPT"
