"""Decodes sources of an old plant: UTF-8, UTF-16 with its mark, or bytes of a code page, as editors wrote them."""

from __future__ import annotations

import codecs

ONE_BYTE = "latin-1"
"""The code page by which each byte becomes one character, and stays the byte that it was."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def decoded(data: bytes, code_page: str = ONE_BYTE) -> tuple[str, str, list[str]]:
    """Return a text, the encoding to write it in, and notes; what is not Unicode is read by ``code_page``."""
    if data.startswith(_UTF_16):
        try:
            return data.decode("utf-16"), "utf-8", ["UTF-16 written as UTF-8"]
        except UnicodeDecodeError:
            return data.decode(ONE_BYTE), ONE_BYTE, []
    notes = ["byte order mark left out"] if data.startswith(codecs.BOM_UTF8) else []
    plain = data.removeprefix(codecs.BOM_UTF8)
    try:
        return plain.decode(), "utf-8", notes
    except UnicodeDecodeError:
        text = plain.decode(code_page, errors="replace")
        return (text, ONE_BYTE, notes) if code_page == ONE_BYTE else (text, "utf-8", [*notes, "written as UTF-8"])
