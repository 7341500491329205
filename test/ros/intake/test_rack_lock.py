"""One thread at a time, and the one that scans goes first."""

import threading
import time

from system.support import wait_until

from automax_ros.ros.base.node import RackLock


def test_visitor_enters_within_itself():
    turns = RackLock()
    with turns, turns:
        pass
    with turns.for_scan, turns:
        pass


def test_nobody_enters_while_another_is_in():
    turns, inside, most = RackLock(), [], []

    def visit(entry):
        for _ in range(200):
            with entry:
                inside.append(1)
                most.append(len(inside))
                inside.pop()

    threads = [threading.Thread(target=visit, args=(entry,)) for entry in (turns, turns, turns.for_scan)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert max(most) == 1
    assert len(most) == 600


def test_scan_waits_for_one_visit_at_most():
    """A visitor that comes again and again at once would keep a plain lock from the one that waits."""
    turns, visits, stop = RackLock(), [], threading.Event()

    def visit():
        while not stop.is_set():
            with turns:
                visits.append(turns._due)
                time.sleep(0.002)

    visitor = threading.Thread(target=visit)
    visitor.start()
    between = []
    try:
        for _ in range(20):
            before = len(visits)
            with turns.for_scan:
                between.append(sum(visits[before:]))
            time.sleep(0.001)
    finally:
        stop.set()
        visitor.join()
    assert max(between) <= 1, between  # of the visits that began while the scan waited: one that had looked just before


def test_visitor_enters_again_within_itself_while_a_scan_waits():
    """Else both would wait for each other."""
    turns, scanned = RackLock(), threading.Event()

    def scan():
        with turns.for_scan:
            scanned.set()

    scanner = threading.Thread(target=scan)
    with turns:
        scanner.start()
        wait_until(lambda: turns._due)
        with turns:
            assert not scanned.is_set()
    scanner.join()
    assert scanned.is_set()
