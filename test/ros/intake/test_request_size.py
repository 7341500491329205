"""The weight of requests, from the C structures that rclpy's own conversion has filled in."""

import pytest

from automax_ros.ros.intake.service_requests import MOST, OF_A_MESSAGE, OF_A_TEXT, RequestTooLarge, request_size


@pytest.fixture
def weigh(ros_domain_id):
    from rclpy.type_support import check_is_valid_srv_type

    from automax_ros.ros.intake.service_requests import Conversion

    def weighed(kind, request):
        check_is_valid_srv_type(kind)
        conversion = Conversion(kind.Request)
        raw = conversion.create()
        try:
            conversion.from_python(request, raw)
            assert conversion.to_python(raw) == conversion.read(raw) == request
            return request_size(kind.Request, raw)
        finally:
            conversion.destroy(raw)

    return weighed


def parameter(**value):
    from rcl_interfaces.msg import Parameter, ParameterValue

    return Parameter(name="P", value=ParameterValue(**value))


def test_weight_is_that_of_all_parts(weigh):
    from rcl_interfaces.srv import GetParameters, SetParameters
    from std_srvs.srv import SetBool, Trigger

    assert weigh(Trigger, Trigger.Request()) == 0
    assert weigh(SetBool, SetBool.Request(data=True)) == 0
    assert weigh(GetParameters, GetParameters.Request(names=["a" * 160, "b"])) == (1 + OF_A_TEXT + 10) + (1 + OF_A_TEXT)
    one = parameter(type=8, double_array_value=[1.0] * 30, string_array_value=["x"] * 3)
    own = OF_A_MESSAGE + OF_A_TEXT + OF_A_TEXT + 30 + 3 * (1 + OF_A_TEXT)
    assert weigh(SetParameters, SetParameters.Request(parameters=[one])) == own
    assert weigh(SetParameters, SetParameters.Request(parameters=[one] * 5)) == 5 * own


@pytest.mark.parametrize(
    "value",
    [
        {"type": 4, "string_value": "a" * (16 * MOST + 1)},
        {"type": 6, "bool_array_value": [True] * (MOST + 1)},
        {"type": 9, "string_array_value": ["a"] * 5000},
    ],
)
def test_heavy_requests_are_refused(weigh, value):
    from rcl_interfaces.srv import SetParameters

    with pytest.raises(RequestTooLarge):
        weigh(SetParameters, SetParameters.Request(parameters=[parameter(**value)]))


def test_as_many_parameters_as_a_rack_has_pass_and_more_do_not(weigh):
    from rcl_interfaces.srv import SetParameters

    assert weigh(SetParameters, SetParameters.Request(parameters=[parameter(type=2)] * 600)) <= MOST
    with pytest.raises(RequestTooLarge):
        weigh(SetParameters, SetParameters.Request(parameters=[parameter(type=2)] * 2000))
