"""The built-in functions and the numbers of BASIC, as an independent model for the interpreter."""

from __future__ import annotations

import math

import numpy as np

LIMIT = 9.2233717e18
LARGEST = float(np.float32(LIMIT))
LOW32, HIGH32 = -(2**31), 2**31 - 1


def single(value: float) -> tuple[float, bool]:
    """What a REAL variable takes, and whether it was clamped: what only single precision makes smaller was not."""
    if math.isnan(value):
        return 0.0, True
    if abs(value) > LARGEST:
        return math.copysign(LARGEST, value), abs(value) > LIMIT
    if 0 <= value < 5.4210107e-20 or -2.7105054e-20 < value <= 0:
        return 0.0, False
    return float(np.float32(value)), False


def whole(value: float) -> int:
    if math.isnan(value):
        return 0
    return int(max(-1e19, min(1e19, value)))


def real_text(value: float) -> str:
    text = f"{0.0 if value == 0 else value:.8G}"
    mantissa, mark, exponent = text.partition("E")
    return (
        text if not mark else f"{mantissa}E{'-' if exponent[0] == '-' else '+'}{exponent[1:].lstrip('0').rjust(2, '0')}"
    )


class Functions:
    """What expressions call. Needs ``line``, ``log``, ``errors`` and a statement's first ``overflow``."""

    def _error(self, code, line=None):
        self.log.append((self.line if line is None else line, code))
        self.errors += 1

    def _note(self, code):
        self.overflow = self.overflow or code

    def fitted(self, value: int) -> int:
        if LOW32 <= value <= HIGH32:
            return value
        self._note(7023)
        return LOW32 if value < 0 else HIGH32

    def bad(self, result):
        self._error(7025)
        return result

    def fn_abs(self, value):
        return abs(value) if isinstance(value, float) else self.fitted(abs(value))

    def fn_int(self, value):
        return self.fitted(whole(value)) if isinstance(value, float) else value

    def fn_sgn(self, value):
        return 1 if value > 0 else -1 if value < 0 else 0

    def fn_min(self, *values):
        return self._alike(min(values), values)

    def fn_max(self, *values):
        return self._alike(max(values), values)

    def _alike(self, value, values):
        return float(value) if any(isinstance(item, float) for item in values) else value

    def fn_sqrt(self, value):
        return math.sqrt(value) if 0 <= value < math.inf else self.bad(0.0)

    def fn_sin(self, value):
        return math.sin(value) if math.isfinite(value) else self.bad(0.0)

    def fn_atn(self, value):
        return self.bad(0.0) if math.isnan(value) else math.atan(value)

    def fn_ln(self, value):
        return math.log(value) if 0 < value < math.inf else self.bad(0.0)

    def fn_exp(self, value):
        if value < 700:
            return math.exp(value)
        self._note(7023)
        return LARGEST

    def fn_leni(self, text):
        return len(text)

    def fn_asci(self, text):
        return ord(text[0]) if text else self.bad(0)

    def fn_chrs(self, code):
        return chr(code) if 0 <= code <= 255 else self.bad("")

    def fn_strs(self, value):
        return self.text(value)

    def fn_val(self, text):
        try:
            value, clamped = single(float(text if not set(text.strip()) - set("0123456789+-.Ee") else "none"))
        except ValueError:
            return self.bad(0.0)
        if clamped:
            self._note(7023)
        return value

    def fn_lefts(self, text, count):
        return text[:count] if count >= 0 else self.bad("")

    def fn_rights(self, text, count):
        return (text[-count:] if count else "") if count >= 0 else self.bad("")

    def fn_mids(self, text, first, count):
        return text[first - 1 :][:count] if first >= 1 and count >= 0 else self.bad("")

    def word(self, value, place, bits):
        """A 16-bit word from a string of 16 binary digits."""
        if not 0 <= place <= 15:
            return self.bad(value)
        digits = bits(f"{value & 0xFFFF:016b}")
        return int(digits, 2) - (0x10000 if digits[0] == "1" else 0)

    def fn_bit_seti(self, value, bit):
        return self.word(value, bit, lambda digits: digits[: 15 - bit] + "1" + digits[16 - bit :])

    def fn_bit_clri(self, value, bit):
        return self.word(value, bit, lambda digits: digits[: 15 - bit] + "0" + digits[16 - bit :])

    def fn_bit_tstb(self, value, bit):
        return f"{value & 0xFFFFFFFF:032b}"[31 - bit] == "1" if 0 <= bit <= 31 else self.bad(False)

    def fn_shiftli(self, value, places):
        return self.word(value, places, lambda digits: digits[places:] + "0" * places)

    def fn_shiftri(self, value, places):
        return self.word(value, places, lambda digits: "0" * places + digits[: 16 - places])

    def fn_rotateli(self, value, places):
        return self.word(value, places, lambda digits: digits[places:] + digits[:places])

    def fn_rotateri(self, value, places):
        return self.word(value, places, lambda digits: digits[16 - places :] + digits[: 16 - places])

    def fn_tst_errlogb(self):
        return self.errors > 0

    def text(self, value):
        if isinstance(value, bool):
            return "TRUE" if value else "FALSE"
        return real_text(value) if isinstance(value, float) else str(value)
