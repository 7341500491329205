"""The domain that a test gets is its own: no other test's, and no program's that knows nothing of the tests."""

import ros_domains
from ros_domains import free_domain, inhabited
from system.support import Client, wait_until


def test_a_domain_that_another_test_has_is_not_given_again(ros_domain_id):
    with free_domain(start=ros_domain_id) as domain:
        assert domain != ros_domain_id
        with free_domain(start=ros_domain_id) as third:
            assert third not in (domain, ros_domain_id)


def test_a_domain_in_which_somebody_is_goes_to_no_test(ros_domain_id, tmp_path, monkeypatch):
    """A rack that a person ran said no in place of a test's own: both are called OPERATED, and both answer."""
    monkeypatch.setattr(ros_domains, "LOCKS", tmp_path)  # so this test's own lock is not why
    with free_domain(start=ros_domain_id) as domain:
        assert domain == ros_domain_id
    with Client():
        assert ros_domain_id in inhabited()
        with free_domain(start=ros_domain_id) as domain:
            assert domain != ros_domain_id
    wait_until(lambda: ros_domain_id not in inhabited())
    with free_domain(start=ros_domain_id) as domain:
        assert domain == ros_domain_id
