"""Problems of declarations, statements and blocks (4xxx)."""

from __future__ import annotations

from automax_ros.core.problems.problem import Problem, Severity

_DECLARATIONS = (
    Problem("AMX4001", "variable is not declared"),
    Problem("AMX4002", "name declared twice"),
    Problem("AMX4003", "declaration after SCAN_LOOP"),
    Problem("AMX4004", "declaration inside IF or FOR"),
    Problem("AMX4006", "array with more than four dimensions"),
    Problem("AMX4007", "array too large"),
    Problem("AMX4008", "bad length of a string"),
    Problem("AMX4009", "local data of the task too large"),
    Problem("AMX4010", "the rack does not define the common", hardware="E0"),
    Problem("AMX4011", "the rack defines the common differently", hardware="E0"),
    Problem("AMX4012", "variable cannot be tunable"),
    Problem("AMX4013", "tunable without CURRENT"),
    Problem("AMX4014", "CURRENT outside of the tuning limits"),
    Problem("AMX4015", "STEP of a tunable is not positive"),
    Problem("AMX4016", "tunable written by the task"),
    Problem("AMX4017", "input point written by the task"),
)
_EXPRESSIONS = (
    Problem("AMX4020", "whole array where a value is needed"),
    Problem("AMX4021", "subscripts after a simple variable"),
    Problem("AMX4022", "wrong number of subscripts"),
    Problem("AMX4023", "subscript out of range"),
    Problem("AMX4024", "division by the constant 0"),
    Problem("AMX4027", "not allowed on this Processor"),
)
_FLOW = (
    Problem("AMX4040", "SCAN_LOOP is missing"),
    Problem("AMX4041", "second SCAN_LOOP"),
    Problem("AMX4042", "block before SCAN_LOOP"),
    Problem("AMX4043", "SCAN_LOOP inside IF or FOR"),
    Problem("AMX4044", "END is missing"),
    Problem("AMX4045", "statement after END"),
    Problem("AMX4046", "END before SCAN_LOOP"),
    Problem("AMX4047", "no such line"),
    Problem("AMX4048", "jump back to SCAN_LOOP or before it"),
    Problem("AMX4049", "jump over SCAN_LOOP"),
    Problem("AMX4050", "jump into an IF or FOR block"),
    Problem("AMX4051", "jump to a declaration"),
    Problem("AMX4052", "RESTORE without DATA"),
    Problem("AMX4053", "READ without DATA"),
    Problem("AMX4054", "statement is never reached", Severity.WARNING),
    Problem("AMX4055", "RETURN without GOSUB", Severity.WARNING),
    Problem("AMX4056", "STEP of a FOR loop is 0"),
)
_EVENTS = (
    Problem("AMX4060", "event is not declared"),
    Problem("AMX4061", "scan cannot wait for a software event"),
    Problem("AMX4062", "interrupt status variable is not a simple common INTEGER"),
    Problem("AMX4063", "TIMEOUT of an event out of range"),
    Problem("AMX4064", "EVENT after SCAN_LOOP"),
)
_BLOCKS = (
    Problem("AMX4070", "unknown block"),
    Problem("AMX4071", "block does not run on this Processor"),
    Problem("AMX4072", "unknown parameter"),
    Problem("AMX4073", "parameter given twice"),
    Problem("AMX4074", "required parameter is missing"),
    Problem("AMX4075", "constant where a variable is needed"),
    Problem("AMX4076", "variable where a constant is needed"),
    Problem("AMX4077", "expression as a parameter"),
    Problem("AMX4078", "output is a constant"),
    Problem("AMX4079", "inverted output"),
    Problem("AMX4080", "constant outside of the parameter's range"),
    Problem("AMX4081", "channels do not follow each other"),
    Problem("AMX4082", "parameters do not fit together"),
    Problem("AMX4084", "coefficient outside of its limits"),
    Problem("AMX4085", "TICKS above the UDC's maximum"),
    Problem("AMX4086", "common shared by blocks and BASIC statements", Severity.WARNING),
    Problem("AMX4087", "not the name of a data structure of that type"),
    Problem("AMX4088", "no SHIFT block makes the data structure"),
    Problem("AMX4089", "data structure made twice"),
    Problem("AMX4090", "channel that the data structure does not have"),
    Problem("AMX4091", "storage of a block too large"),
    Problem("AMX4092", "table of the wrong size"),
    Problem("AMX4093", "data structure and variable of one name"),
    Problem("AMX4094", "TABLE2 is never selected", Severity.WARNING),
    Problem("AMX4095", "name of a data structure has 16 characters", Severity.WARNING),
    Problem("AMX4096", "variable should be COMMON", Severity.WARNING),
    Problem("AMX4097", "UDC task without THERMAL_OVERLOAD", Severity.WARNING),
    Problem("AMX4098", "constant is limited at run time", Severity.WARNING),
    Problem("AMX4099", "LOOP_TIME is not a whole number of scan periods", Severity.WARNING),
)

PROBLEMS: tuple[Problem, ...] = (*_DECLARATIONS, *_EXPRESSIONS, *_FLOW, *_EVENTS, *_BLOCKS)
