"""Problems of run time (7xxx): what a task's error log holds, and what stops a rack."""

from __future__ import annotations

from automax_ros.core.problems.problem import Problem

PROBLEMS: tuple[Problem, ...] = (
    Problem("AMX7001", "output of a block clamped to 16 bits"),
    Problem("AMX7002", "32-bit overflow inside a block"),
    Problem("AMX7003", "division by zero inside a block"),
    Problem("AMX7004", "coefficient out of its limits"),
    Problem("AMX7005", "column that the data structure does not have"),
    Problem("AMX7020", "value clamped on assignment to an INTEGER variable"),
    Problem("AMX7021", "value clamped on assignment to a DOUBLE INTEGER variable"),
    Problem("AMX7022", "value clamped on assignment to a REAL variable"),
    Problem("AMX7023", "32-bit overflow in an expression"),
    Problem("AMX7024", "division by zero in an expression"),
    Problem("AMX7025", "argument of a function out of range"),
    Problem("AMX7026", "subscript out of range"),
    Problem("AMX7027", "STEP of a FOR statement is 0"),
    Problem("AMX7028", "GOSUB nested more than 16 deep"),
    Problem("AMX7029", "RETURN without GOSUB"),
    Problem("AMX7030", "READ past the last DATA value"),
    Problem("AMX7032", "DATA value of another kind than the variable"),
    Problem("AMX7031", "bus error", hardware="31"),
    Problem("AMX7040", "scan stopped: too many statements", hardware="14"),
    Problem("AMX7070", "overlap: the last scan was still under way", hardware="14"),
    Problem("AMX7071", "no event within its TIMEOUT"),
    Problem("AMX7072", "two modules drive the common clock", hardware="38"),
    Problem("AMX7050", "channel or port is not open"),
    Problem("AMX7051", "another task reads the channel"),
    Problem("AMX7052", "TYPE is not the channel's"),
    Problem("AMX7053", "DEPTH of a channel out of range"),
    Problem("AMX7054", "time of DELAY or START EVERY out of range"),
    Problem("AMX7042", "deadline missed on the wall clock"),
)
