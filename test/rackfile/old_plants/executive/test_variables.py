"""The types of $SWVAR's variables, where very many codes are none that the manual prints."""

from __future__ import annotations

from automax_ros.rackfile.old_plants.executive.fields import Record
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.sources import Declarations
from automax_ros.rackfile.old_plants.executive.variables import variables_of


def test_very_many_type_codes_are_found_in_one_pass():
    """Each code on its own would look at all records: hours of it."""
    records = [Record("$SWVAR.DBF", number, {"name": f"V{number}", "type": 1000 + number}) for number in range(60_000)]
    findings = Findings()
    found = variables_of(records, (), Declarations(), findings)
    assert [item.reason for item in found[:1]] == ["type '1000' is not known"]
    assert len(findings.items) + findings.left_out == 60_000
