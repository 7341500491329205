"""The picture and the data of a diagram: whole, escaped, the same every time."""

from __future__ import annotations

import json
import re
from collections import Counter
from dataclasses import replace
from xml.etree import ElementTree

from hypothesis import given

from automax_ros.diagram.model import diagram_of
from automax_ros.diagram.placed import diagram_facts, placed
from automax_ros.diagram.svg import svg_of
from diagram.drawing import EXAMPLES, checked, drawn, example, scan, tasks

SVG = "{http://www.w3.org/2000/svg}"


def elements(text: str, kind: str) -> list[ElementTree.Element]:
    return list(ElementTree.fromstring(text).iter(f"{SVG}{kind}"))


def words(text: str) -> list[str]:
    return [item.text or "" for item in elements(text, "text")]


def test_a_picture_has_every_box_pin_flag_and_wire() -> None:
    for path in EXAMPLES:
        diagram = diagram_of(*example(path))
        text = svg_of(placed(diagram))
        counted = Counter(
            item.get("class", "").split(" ")[0]
            for kind in ("rect", "polygon", "polyline")
            for item in elements(text, kind)
        )
        assert counted == Counter(
            {"paper": 1, "box": len(diagram.boxes), "flag": len(diagram.flags), "wire": len(diagram.wires)}
        )
        assert {box.title for box in diagram.boxes} | {str(box.line) for box in diagram.boxes} <= set(words(text))
        assert {pin.symbol for pin in diagram.pins} | {flag.name for flag in diagram.flags} <= set(words(text))


def test_booleans_feedback_and_inverted_inputs_are_told_apart() -> None:
    text = svg_of(placed(drawn("CALL AND(INPUT1=-U@, INPUT2=P@, OUTPUT=U@)", "X% = A%")))
    kinds = Counter(item.get("class") for item in elements(text, "polyline"))
    assert kinds == {"wire boolean": 1, "wire boolean feedback": 1, "wire": 1}
    assert [item.get("class") for item in elements(text, "circle")] == ["bubble"]


def test_where_a_net_forks_there_is_a_dot() -> None:
    fork = svg_of(placed(drawn("CALL SUMMER(INPUT1=A%, INPUT2=A%, OUTPUT=X%)")))
    plain = svg_of(placed(drawn("CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=X%)")))
    assert [len(elements(text, "circle")) for text in (fork, plain)] == [1, 0]


def test_foreign_texts_are_escaped() -> None:
    hostile = "</text><script>alert('&')</script>"
    program, source = checked(scan([f"REM {hostile}", 'IF U@ THEN PRINT "<b onload=1> & \']]>"']))
    diagram = diagram_of(program, source)
    text = svg_of(placed(replace(diagram, task=hostile + "\x07")))
    assert "<script" not in text
    assert "<b" not in text
    assert any('PRINT "<b onload=1>' in word for word in words(text))
    assert elements(text, "title")[0].text == hostile + "\N{REPLACEMENT CHARACTER}"
    kinds = {item.tag.removeprefix(SVG) for item in ElementTree.fromstring(text).iter()}
    assert kinds == {"svg", "title", "style", "rect", "text"}


def test_a_picture_needs_nothing_else() -> None:
    text = svg_of(placed(diagram_of(*example(EXAMPLES[0]))))
    assert re.findall(r"(?:href|url|@import|script)", text) == []
    assert re.match(r'<svg [^>]*width="\d+" height="\d+" viewBox="0 0 \d+ \d+"', text)


@given(tasks())
def test_the_data_join_what_is_drawn(text: str) -> None:
    facts = json.loads(json.dumps(diagram_facts(*checked(text)), allow_nan=False))
    assert (facts["drawable"], facts["why"], facts["task"]) == (True, "", "TASK")
    for wire in facts["wires"]:
        for end, point in ((wire["from"], wire["points"][0]), (wire["to"], wire["points"][-1])):
            if "flag" in end:
                flag = facts["flags"][end["flag"]]
                assert point == [flag["x"] + (0 if flag["out"] else flag["w"]), flag["y"] + flag["h"] // 2]
            else:
                pin = facts["pins"][end["pin"]]
                assert (point, pin["box"], pin["net"]) == ([pin["x"], pin["y"]], end["box"], wire["net"])
    for place, (box, net) in enumerate(zip(facts["boxes"], facts["nets"], strict=False)):
        assert box["id"] == net["id"] == place
        assert isinstance(box["x"], int)


def test_the_data_have_what_the_page_reads() -> None:
    facts = diagram_facts(
        *checked(scan(["CALL AND(INPUT1=-P@, INPUT2=U@, OUTPUT=Q@)"])), {"P@": ["LINE"]}, {"Q@": ["SEQ"]}
    )
    (box,) = facts["boxes"]
    assert {"id", "kind", "title", "line", "rows", "x", "y", "w", "h", "text"} <= set(box)
    assert (box["kind"], box["title"], box["line"], list(box["rows"])) == ("block", "AND", 100, [5, 5])
    assert [(flag["name"], flag["tasks"]) for flag in facts["flags"]] == [("P@", ["LINE"]), ("Q@", ["SEQ"])]
    pins = {pin["name"]: pin for pin in facts["pins"]}
    assert (pins["INPUT1"]["symbol"], pins["INPUT1"]["negated"]) == ("I1", True)
    assert (pins["INPUT2"]["var"], pins["INPUT2"]["net"]) == ("U@", None)
    assert facts["nets"][0] == {"id": 0, "name": "Q@", "watch": "Q@", "line": 100, "boolean": True, "kept": True}
    assert facts["source"][4]["names"] == ("P@", "U@", "Q@")


def test_a_task_that_is_not_drawn_has_its_source() -> None:
    facts = diagram_facts(*checked(scan(["GOTO 9000"])))
    assert (facts["drawable"], facts["why"], facts["boxes"]) == (False, "line 100: GOTO", [])
    assert facts["source"][4] == {"row": 5, "line": 100, "text": "100 GOTO 9000", "names": ()}
