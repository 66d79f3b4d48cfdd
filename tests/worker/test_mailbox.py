# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages as files of a folder, and the reading of large ones bit by bit."""

import os

import numpy as np
import pytest

from neural_sculpt_addon.worker.mailbox import Inbox, Outbox
from neural_sculpt_addon.worker.protocol import JobKind, Message, ProtocolError

LARGE = {name: np.full(1000, number) for number, name in enumerate("abc")}


def test_messages_come_in_their_order_and_are_removed(tmp_path):
    outbox, inbox = Outbox(tmp_path), Inbox(tmp_path)
    assert inbox.take() is None
    outbox.put(Message(JobKind.MESH, 1, {}, LARGE))
    outbox.put(Message(JobKind.MESH, 2))
    assert inbox.take().job == 1
    assert inbox.take().job == 2
    assert inbox.take() is None
    assert not list(tmp_path.iterdir())


def test_a_large_message_is_read_an_array_at_a_time_when_there_is_no_time(tmp_path):
    outbox, inbox = Outbox(tmp_path), Inbox(tmp_path)
    outbox.put(Message(JobKind.MESH, 1, {"x": 3}, LARGE))
    outbox.put(Message(JobKind.MESH, 2))
    assert not inbox.amid
    for _ in LARGE:
        assert inbox.take(0.0) is None
        assert inbox.amid
    message = inbox.take(0.0)
    assert (message.job, message.fields) == (1, {"x": 3})
    for name, array in LARGE.items():
        np.testing.assert_array_equal(message.arrays[name], array)
    assert not inbox.amid
    assert inbox.take(0.0).job == 2  # it has no arrays


def test_what_was_begun_in_a_hurry_ends_at_leisure(tmp_path):
    outbox, inbox = Outbox(tmp_path), Inbox(tmp_path)
    outbox.put(Message(JobKind.MESH, 1, {}, LARGE))
    assert inbox.take(0.0) is None
    np.testing.assert_array_equal(inbox.take().arrays["c"], LARGE["c"])


@pytest.mark.skipif(os.name != "posix", reason="there a folder is as a file in use")
def test_what_cannot_be_opened_is_no_message(tmp_path):
    (tmp_path / "0").mkdir()
    with pytest.raises(ProtocolError, match="cannot be opened"):
        Inbox(tmp_path).take()


def test_a_message_cut_short_is_refused_and_closed(tmp_path):
    Outbox(tmp_path).put(Message(JobKind.MESH, 1, {}, LARGE))
    whole = (tmp_path / "0").read_bytes()
    (tmp_path / "0").write_bytes(whole[:-1])
    inbox = Inbox(tmp_path)
    with pytest.raises(ProtocolError, match="ends after"):
        for _ in range(len(LARGE)):
            inbox.take(0.0)
    assert not inbox.amid
