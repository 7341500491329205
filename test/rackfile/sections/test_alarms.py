"""`alarms` of a rack file: which booleans they are; what is wrong with one stands in ``faulty/racks/alarms*.yaml``."""

from automax_ros.rackfile.loader import load

HEAD = "rack: D\nslots: {0: {module: 57C413}, 1: {module: 57C435}, 5: {module: 57C419}}\n"
COMMON = "common: {RUN@: {}, LIMIT@(7): {}, FAULT@: {description: overload}, STOP@: {slot: 5, register: 0, bit: 1}}\n"


def alarms_of(folder, more):
    path = folder / "rack.yaml"
    path.write_text(HEAD + COMMON + more)
    result = load(path)
    assert result.diagnostics == []
    return result.config.alarms


def test_they_are_simple_booleans_elements_and_points_in_the_order_of_the_file(tmp_path):
    found = alarms_of(tmp_path, "alarms: [FAULT@, 'limit@[3]', STOP@]\n")
    assert [(item.label, item.index) for item in found] == [("FAULT@", 0), ("LIMIT@(3)", 3), ("STOP@", 0)]
    assert found[0].variable.description == "overload"


def test_a_rack_may_have_none(tmp_path):
    assert alarms_of(tmp_path, "") == ()
    assert alarms_of(tmp_path, "alarms: []\n") == ()


def test_what_is_watched_may_be_an_alarm_too(tmp_path):
    assert [item.label for item in alarms_of(tmp_path, "watch: [FAULT@]\nalarms: [FAULT@]\n")] == ["FAULT@"]
