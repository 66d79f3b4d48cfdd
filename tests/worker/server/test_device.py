# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker sculpts on, and what it says when that is not there."""

import sys

import pytest
import torch

from neural_sculpt_addon.common.errors import SculptError
from neural_sculpt_addon.worker.client import Client, JobKind, MessageKind
from neural_sculpt_addon.worker.install.environment import Device, worker_command
from neural_sculpt_addon.worker.server import device
from neural_sculpt_addon.worker.server.device import choose

needs_no_cuda = pytest.mark.skipif(torch.cuda.is_available(), reason="there is a CUDA card")


def test_the_processor_can_always_be_had():
    assert choose(Device.CPU).type == "cpu"


@needs_no_cuda
def test_auto_is_the_processor_without_cuda():
    assert choose(Device.AUTO).type == "cpu"


def test_a_card_that_cannot_sculpt_is_not_chosen_unasked(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    broken = torch.device("meta")  # has no numbers
    try_out = device.try_out
    monkeypatch.setattr(device, "try_out", lambda _: try_out(broken))
    assert choose(Device.AUTO).type == "cpu"
    with pytest.raises(SculptError, match="cannot be used"):
        choose(Device.CUDA)


def test_a_device_that_can_sculpt_is_chosen(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    try_out = device.try_out
    monkeypatch.setattr(device, "try_out", lambda _: try_out(torch.device("cpu")))
    assert choose(Device.AUTO).type == choose(Device.CUDA).type == "cuda"


@needs_no_cuda
def test_every_job_says_that_the_device_is_missing(tmp_path):
    client = Client(worker_command(sys.executable, Device.CUDA), tmp_path / "worker.log")
    client.start()
    try:
        fields = {"primitive": "sphere", "resolution": 32}
        for _ in range(2):
            answer = client.wait(client.submit(JobKind.FIT, fields), timeout=120)
            assert answer.kind is MessageKind.ERROR
            assert "no CUDA" in answer.fields["message"]
        assert client.hello["device"] == ""
    finally:
        client.stop()
