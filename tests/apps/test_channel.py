"""What goes between the threads of a live picture: events, calls and frames, without a picture."""

import threading
import time

import pytest

from taichi_tracer.apps.page.channel import MOST_EVENTS, Channel


@pytest.fixture
def mail():
    return Channel(time.monotonic)


def test_ten_thousand_events_are_no_queue(mail):
    for k in range(10_000):
        mail.post({"type": "explain", "column": k, "row": 0, "sample": 0})
    events = mail.take_post()
    assert len(events) == MOST_EVENTS
    assert events[-1] == ("explain", {"column": 9999, "row": 0, "sample": 0})  # the oldest ones are dropped
    assert mail.take_post() == []


def test_functions_of_other_threads_wait_for_the_thread_that_renders(mail):
    found = []
    thread = threading.Thread(target=lambda: mail.later(lambda: found.append(threading.get_ident())))
    thread.start()
    thread.join()
    assert found == []
    ((kind, members),) = mail.take_post()
    assert kind == "call"
    members["task"]()
    assert found == [threading.get_ident()]
