"""`automax schema`: what it prints is a schema that judges files."""

import json

import jsonschema
import pytest

from automax_ros.rackfile.loader import schema as rack_schema
from automax_ros.scenario.stimuli.schema import schema as stimuli_schema


@pytest.mark.parametrize(("kind", "schema"), [("rack", rack_schema), ("stimuli", stimuli_schema)])
def test_it_prints_the_schema(automax, kind, schema):
    result = automax("schema", kind)
    assert (result.code, result.err) == (0, "")
    assert json.loads(result.out) == json.loads(json.dumps(schema()))
    jsonschema.Draft202012Validator.check_schema(json.loads(result.out))


def test_it_judges_files(automax):
    validator = jsonschema.Draft202012Validator(json.loads(automax("schema", "rack").out))
    good = {"rack": "A", "slots": {"0": {"module": "57C435", "tick_ms": 5.5}}}
    assert validator.is_valid(good)
    assert not validator.is_valid({**good, "slots": {"0": {"module": "57C435", "tick_ms": 5.4}}})
    assert not validator.is_valid({**good, "slots": {"16": {"module": "57C435"}}})


def test_another_kind_is_wrong_usage(automax):
    result = automax("schema", "bag")
    assert result.code == 2
    assert "'rack', 'stimuli'" in result.err
