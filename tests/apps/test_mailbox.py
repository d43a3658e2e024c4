"""What goes between the threads of a live picture: events, calls and frames, without a picture."""

import threading
import time

import pytest

from taichi_tracer.apps.frames import Frame
from taichi_tracer.apps.mailbox import FORGOTTEN, MOST_EVENTS, Mailbox
from taichi_tracer.system.errors import InputError


@pytest.fixture
def mail():
    return Mailbox(time.monotonic)


def frame(number):
    return Frame(number, "png", b"", "{}")


def test_ten_thousand_events_are_no_queue(mail):
    for k in range(10_000):
        mail.post({"type": "drag", "dx": 1e-5 * k, "dy": 0})
    events, _ = mail.take_post()
    assert len(events) == MOST_EVENTS
    assert events[-1] == ("drag", {"dx": 1e-5 * 9999, "dy": 0.0})  # the oldest ones are dropped
    assert mail.take_post() == ([], 0)


def test_a_malformed_event_is_refused(mail):
    with pytest.raises(InputError, match="event"):
        mail.post({"type": "dance"})
    assert mail.take_post() == ([], 0)


def test_threads_wait_for_a_newer_frame_and_are_let_go(mail):
    mail.show(frame(1))
    assert mail.newest(0).number == mail.wait_for_frame(0, 0.0).number == 1
    assert mail.newest(1) is mail.wait_for_frame(1, 0.0) is None
    found = []
    threads = [threading.Thread(target=lambda: found.append(mail.wait_for_frame(1, 20))) for _ in range(3)]
    for thread in threads:
        thread.start()
    mail.close()
    for thread in threads:
        thread.join(5)
    assert found == [None] * 3


def test_calls_are_answered_by_the_thread_that_renders_with_their_errors(mail):
    def fails():
        raise ValueError("no")

    answers = []

    def ask():
        answers.append(mail.call(threading.get_ident))
        with pytest.raises(ValueError, match="no"):
            mail.call(fails)
        answers.append("told")

    thread = threading.Thread(target=ask)
    thread.start()
    while thread.is_alive():
        mail.take_post()
    assert answers == [threading.get_ident(), "told"]


def test_a_mailbox_knows_whether_somebody_watches_and_takes_a_frame():
    clock = [0.0]
    mail = Mailbox(lambda: clock[0])
    assert mail.is_watched
    clock[0] = FORGOTTEN + 1
    assert not mail.is_watched
    mail.watch()
    assert mail.is_watched
    assert not mail.is_asked
    mail.ask()
    assert mail.is_asked
    mail.show(frame(1))
    assert not mail.is_asked
