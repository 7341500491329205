"""Problems of types (2xxx)."""

from __future__ import annotations

from automax_ros.core.problems.problem import Problem

PROBLEMS: tuple[Problem, ...] = (
    Problem("AMX2001", "operator cannot join these types"),
    Problem("AMX2002", "relation between values of different kinds"),
    Problem("AMX2003", "AND, OR, XOR or NOT of a REAL or a string"),
    Problem("AMX2004", "sign before a boolean or a string"),
    Problem("AMX2005", "condition is not boolean"),
    Problem("AMX2006", "value of another kind assigned"),
    Problem("AMX2007", "constant does not fit the type"),
    Problem("AMX2008", "integer constant does not fit in 32 bits"),
    Problem("AMX2009", "value must be an integer"),
    Problem("AMX2010", "subscript is not an integer"),
    Problem("AMX2011", "limits of a FOR loop are not numbers"),
    Problem("AMX2012", "FOR variable is not a simple number"),
    Problem("AMX2013", "wrong number of arguments"),
    Problem("AMX2014", "argument of another kind"),
    Problem("AMX2015", "parameter of another type"),
    Problem("AMX2016", "REAL constant of a block without its decimal point"),
    Problem("AMX2017", "READ finds no DATA value of its kind"),
    Problem("AMX2018", "tuning value of another kind"),
    Problem("AMX2019", "constant argument out of range"),
)
