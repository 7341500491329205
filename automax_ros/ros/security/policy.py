"""The policy and the permissions of enclaves as XML, in the formats of SROS 2 and of DDS-Security.

`ros2 security generate_artifacts -p policy.xml` reads a policy (version 0.2.0). DDS reads permissions and governance
from a keystore: DDS-Security 1.1, sections 9.4.1.2 and 9.4.1.3. In DDS the name of a ROS topic has the prefix ``rt``,
and a service has one topic for its requests and one for its replies.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple
from xml.etree import ElementTree

from automax_ros.ros.security.profiles import Enclave, Profile

VERSION = "0.2.0"
"""Version of the format of policies."""
DISCOVERY = "ros_discovery_info"
"""The topic on which every process of ROS 2 publishes its nodes."""
_PARTS = (("topics", "topic", ("publish", "subscribe")), ("services", "service", ("reply", "request")))
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
_SCHEMAS = "http://www.omg.org/spec/DDS-SECURITY/20170901/omg_shared_ca_"
_YES = (
    ("allow_unauthenticated_participants", "false"),
    ("enable_join_access_control", "true"),
    ("discovery_protection_kind", "ENCRYPT"),
    ("liveliness_protection_kind", "ENCRYPT"),
    ("rtps_protection_kind", "SIGN"),
)
_TOPICS = (
    ("topic_expression", "*"),
    ("enable_discovery_protection", "true"),
    ("enable_liveliness_protection", "true"),
    ("enable_read_access_control", "true"),
    ("enable_write_access_control", "true"),
    ("metadata_protection_kind", "ENCRYPT"),
    ("data_protection_kind", "ENCRYPT"),
)


class Validity(NamedTuple):
    """Period in which permissions are valid: times such as ``2026-01-31T00:00:00``, UTC."""

    begins: str
    ends: str


def policy_text(enclaves: Iterable[Enclave]) -> str:
    """Return the policy of some enclaves."""
    root = ElementTree.Element("policy", version=VERSION)
    holder = ElementTree.SubElement(root, "enclaves")
    for enclave in enclaves:
        found = ElementTree.SubElement(holder, "enclave", path=enclave.path)
        profiles = ElementTree.SubElement(found, "profiles")
        for profile in enclave.profiles:
            _add_profile(profiles, profile)
    return _text(root)


def _add_profile(parent: ElementTree.Element, profile: Profile) -> None:
    found = ElementTree.SubElement(parent, "profile", ns=profile.namespace, node=profile.node)
    for group, entry, verbs in _PARTS:
        for verb in verbs:
            names: Sequence[str] = getattr(profile, verb)
            if names:
                _add_names(ElementTree.SubElement(found, group, {verb: "ALLOW"}), entry, names)


def permissions_text(enclave: Enclave, domain: int, validity: Validity) -> str:
    """Return the permissions of an enclave in a ROS domain: the topics of its profiles, and nothing else."""
    root = _dds("permissions")
    grant = ElementTree.SubElement(ElementTree.SubElement(root, "permissions"), "grant", name=enclave.path)
    ElementTree.SubElement(grant, "subject_name").text = f"CN={enclave.path}"
    times = ElementTree.SubElement(grant, "validity")
    ElementTree.SubElement(times, "not_before").text = validity.begins
    ElementTree.SubElement(times, "not_after").text = validity.ends
    rule = ElementTree.SubElement(grant, "allow_rule")
    _add_domain(rule, domain)
    for verb, names in (("publish", written_topics(enclave)), ("subscribe", read_topics(enclave))):
        topics = ElementTree.SubElement(ElementTree.SubElement(rule, verb), "topics")
        _add_names(topics, "topic", names)
    ElementTree.SubElement(grant, "default").text = "DENY"
    return _text(root)


def governance_text(domain: int) -> str:
    """Return the governance of a ROS domain: certificates are required, all topics encrypted and access-controlled."""
    root = _dds("governance")
    rule = ElementTree.SubElement(ElementTree.SubElement(root, "domain_access_rules"), "domain_rule")
    _add_domain(rule, domain)
    for name, value in _YES:
        ElementTree.SubElement(rule, name).text = value
    topic_rule = ElementTree.SubElement(ElementTree.SubElement(rule, "topic_access_rules"), "topic_rule")
    for name, value in _TOPICS:
        ElementTree.SubElement(topic_rule, name).text = value
    return _text(root)


def written_topics(enclave: Enclave) -> list[str]:
    """Return the DDS topics that an enclave may write."""
    return _dds_topics(enclave.names("publish"), enclave.names("request"), enclave.names("reply"))


def read_topics(enclave: Enclave) -> list[str]:
    """Return the DDS topics that an enclave may read."""
    return _dds_topics(enclave.names("subscribe"), enclave.names("reply"), enclave.names("request"))


def _dds_topics(topics: Iterable[str], requests: Iterable[str], replies: Iterable[str]) -> list[str]:
    named = [*(f"rt{name}" for name in topics), *(f"rq{name}Request" for name in requests)]
    return sorted([DISCOVERY, *named, *(f"rr{name}Reply" for name in replies)])


def _dds(schema: str) -> ElementTree.Element:
    place = {"xmlns:xsi": _XSI, "xsi:noNamespaceSchemaLocation": f"{_SCHEMAS}{schema}.xsd"}
    return ElementTree.Element("dds", place)


def _add_domain(parent: ElementTree.Element, domain: int) -> None:
    ElementTree.SubElement(ElementTree.SubElement(parent, "domains"), "id").text = str(domain)


def _add_names(parent: ElementTree.Element, entry: str, names: Iterable[str]) -> None:
    for name in names:
        ElementTree.SubElement(parent, entry).text = name


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root, "  ")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ElementTree.tostring(root, encoding="unicode")}\n'
