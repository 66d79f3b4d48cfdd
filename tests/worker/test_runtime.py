# SPDX-License-Identifier: GPL-3.0-or-later
"""What a computing process is like after `set_up`, and a worker when it is warm, each seen in a
process of its own."""

import json
import platform
import subprocess
import sys

import pytest

from tests.worker.support import ROOT

LOOK = """
import json, sys
sys.path.insert(0, sys.argv[1])
from neural_sculpt_addon.worker.runtime import set_up
if sys.argv[2] == "settled":
    set_up()
import numpy, torch
try:
    import resource
    def faults():
        return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
except ImportError:
    def faults():
        return 0
def work():
    held = [numpy.ones(1 << 18) for _ in range(8)]  # 2 MB each, 512 pages


work()
before = faults()
for _ in range(10):
    work()
found = {"threads": torch.get_num_threads(), "faults": faults() - before}
print(json.dumps(found))
"""


def look(how: str) -> dict[str, int]:
    command = [sys.executable, "-c", LOOK, str(ROOT), how]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def test_libraries_start_no_threads_of_their_own():
    assert look("settled")["threads"] == 1


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc is asked to keep memory")
def test_freed_memory_is_not_asked_for_anew():
    assert look("settled")["faults"] < look("as it comes")["faults"] / 10


WARM = """
import gc, sys
sys.path.insert(0, sys.argv[1])
from neural_sculpt_addon.worker.server.jobs import warm_up
warm_up()
print(gc.get_freeze_count(), len(gc.get_objects()))
"""


def test_garbage_is_not_looked_for_among_what_was_imported():
    """A pass over all of torch takes 0.1 s, in the midst of some stroke."""
    command = [sys.executable, "-c", WARM, str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    left_out, looked_at = map(int, done.stdout.split())
    assert left_out > 100_000
    assert looked_at < left_out / 100
