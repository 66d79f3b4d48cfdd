# SPDX-License-Identifier: GPL-3.0-or-later
"""Client and server in real processes."""

import json
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
from pathlib import Path

import numpy as np
import pytest

from neural_sculpt_addon.common.errors import Cancelled, SculptError
from neural_sculpt_addon.worker import protocol, pulse
from neural_sculpt_addon.worker.client import (
    Client,
    JobKind,
    Message,
    MessageKind,
    WorkerGoneError,
    WorkerState,
)
from neural_sculpt_addon.worker.mailbox import Inbox, Outbox
from neural_sculpt_addon.worker.process import ANSWERS, REQUESTS
from neural_sculpt_addon.worker.protocol import FINAL, ProtocolError
from tests.worker.support import PATIENCE, ROOT, TOY_WORKER, gone, until

POSIX = pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
SLOW = {"seconds": 600.0}


@pytest.fixture
def client(tmp_path):
    client = Client(TOY_WORKER, tmp_path / "logs" / "worker.log")
    client.start()
    yield client
    client.stop()


def finish(client: Client, job: int) -> Message:
    return client.wait(job, timeout=PATIENCE)


def begun(client: Client, job: int) -> Message:
    """The first progress of a job."""
    news: list[Message] = []
    until(lambda: news.extend(client.poll_once()) or news)
    assert (news[0].kind, news[0].job) == (MessageKind.PROGRESS, job)
    return news[0]


def all_finals(client: Client, count: int) -> list[Message]:
    finals: list[Message] = []

    def poll() -> bool:
        finals.extend(message for message in client.poll_once() if message.kind in FINAL)
        return len(finals) >= count

    until(poll)
    return finals


def test_hello_makes_the_worker_ready(client):
    assert client.state is WorkerState.STARTING
    until(lambda: client.poll_once() or client.state is WorkerState.READY)
    assert client.hello["protocol"] == protocol.PROTOCOL
    assert client.hello["python"] == sys.version


def test_fields_and_ten_megabytes_come_back_as_they_went(client):
    rng = np.random.default_rng(0)
    arrays = {
        "points": rng.normal(size=(900_000, 3)).astype("<f4"),
        "flags": rng.integers(0, 255, 17).astype("u1"),
        "none": np.zeros((0, 3), "<i4"),
    }
    answer = finish(client, client.submit(JobKind.MESH, {"ä": [1, None, "→"]}, arrays))
    assert answer.kind is MessageKind.RESULT
    assert answer.fields == {"ä": [1, None, "→"]}
    for name, array in arrays.items():
        np.testing.assert_array_equal(answer.arrays[name], array)


def test_jobs_run_in_the_order_of_their_arrival_and_end_once(client):
    jobs = [client.submit(JobKind.MESH, {"n": n}) for n in range(20)]
    finals = all_finals(client, len(jobs))
    assert [message.job for message in finals] == jobs
    assert [message.fields["n"] for message in finals] == list(range(20))
    finish(client, client.submit(JobKind.MESH, {}))
    assert client.poll_once() == []


def test_progress_rises(client):
    seen: list[tuple[float, str]] = []
    job = client.submit(JobKind.EDIT, {"seconds": 0.5})
    answer = client.wait(job, lambda *now: seen.append(now), timeout=PATIENCE)
    assert answer.fields == {"slept": True}
    assert seen[0] == (0.0, "step 000000")
    assert seen == sorted(seen)


def test_waiting_for_one_job_keeps_the_news_of_the_others(client):
    first = client.submit(JobKind.MESH, {"n": 1})
    second = client.submit(JobKind.MESH, {"n": 2})
    assert finish(client, second).fields == {"n": 2}
    assert [message.job for message in client.poll_once()] == [first]


def test_waiting_has_an_end(client):
    job = client.submit(JobKind.EDIT, SLOW)
    with pytest.raises(TimeoutError):
        client.wait(job, timeout=0.1)
    with pytest.raises(ValueError, match="not open"):
        client.wait(job + 1)


def test_cancel_ends_the_running_job_and_spares_the_next(client):
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    after = client.submit(JobKind.MESH, {"n": 1})
    client.cancel(job)
    assert [(m.job, m.kind) for m in all_finals(client, 2)] == [
        (job, MessageKind.CANCELLED),
        (after, MessageKind.RESULT),
    ]


def test_a_preview_comes_ahead_of_the_result(client):
    shown = {"a": np.arange(12.0).reshape(4, 3)}
    job = client.submit(JobKind.EDIT, {"seconds": 0.1}, shown)
    news: list[Message] = []
    until(lambda: news.extend(client.poll_once()) or (news and news[-1].kind in FINAL))
    assert {message.job for message in news} == {job}
    assert (news[0].kind, news[0].fields) == (MessageKind.PREVIEW, {"shown": True})
    np.testing.assert_array_equal(news[0].arrays["a"], shown["a"])
    assert {message.kind for message in news[1:-1]} <= {MessageKind.PROGRESS}
    assert news[-1].kind is MessageKind.RESULT


def test_waiting_passes_over_a_preview(client):
    job = client.submit(JobKind.EDIT, {"seconds": 0.1}, {"a": np.ones(3)})
    assert finish(client, job).fields == {"slept": True}


def test_cancel_takes_a_waiting_job_out_while_another_runs(client):
    running = client.submit(JobKind.EDIT, SLOW)
    waiting = client.submit(JobKind.EDIT, SLOW)
    begun(client, running)
    client.cancel(waiting)
    assert finish(client, waiting).kind is MessageKind.CANCELLED
    after = client.submit(JobKind.MESH, {})
    client.cancel(running)
    assert finish(client, running).kind is MessageKind.CANCELLED
    assert finish(client, after).kind is MessageKind.RESULT


def test_what_is_good_enough_ends_with_a_result_though_it_waits_and_no_other_does(client):
    running, waiting, last = (client.submit(JobKind.EDIT, SLOW) for _ in range(3))
    begun(client, running)
    client.settle(waiting)
    client.settle(running)
    client.settle(12345)
    assert finish(client, running).fields == {"slept": False}
    assert finish(client, waiting).fields == {"slept": False}
    begun(client, last)
    client.settle(last)
    assert finish(client, last).fields == {"slept": False}


def test_good_enough_before_the_worker_is_up_counts(client):
    job = client.submit(JobKind.EDIT, SLOW)
    client.settle(job)
    assert finish(client, job).fields == {"slept": False}


def test_cancel_before_the_worker_is_up_counts(client):
    job = client.submit(JobKind.EDIT, SLOW)
    client.cancel(job)
    assert finish(client, job).kind is MessageKind.CANCELLED


def test_cancel_of_what_has_ended_is_nothing(client):
    job = client.submit(JobKind.MESH, {})
    finish(client, job)
    client.cancel(job)
    client.cancel(12345)
    finish(client, client.submit(JobKind.MESH, {}))
    assert client.poll_once() == []


def test_a_watcher_that_raises_cancelled_cancels(client):
    def watch(fraction: float, message: str) -> None:
        raise Cancelled

    job = client.submit(JobKind.EDIT, SLOW)
    assert client.wait(job, watch, timeout=PATIENCE).kind is MessageKind.CANCELLED


def test_messages_remember_what_they_were_made_of(client):
    answer = finish(client, client.submit(JobKind.LOAD, {"how": "sculpt"}))
    text = answer.fields["message"]
    assert text.template == "{}: {}" and text.arguments[0] == "Stroke 2"
    assert text.arguments[1].template == "The stroke is {} off."
    told = []
    job = client.submit(JobKind.EDIT, {"seconds": 0.2})
    client.wait(job, lambda _, text: told.append(text), PATIENCE)
    assert {text.template for text in told} == {"step {}"}


@pytest.mark.parametrize(
    ("how", "message", "detail"),
    [
        ("sculpt", "Stroke 2: The stroke is 0.25 off.", ""),
        ("value", "ValueError: a defect", "Traceback"),
        ("memory", "out of memory", ""),
        ("nan", "cannot be sent", ""),
    ],
)
def test_a_failing_job_is_an_error_with_a_sentence_and_the_worker_lives(
    client, how, message, detail
):
    answer = finish(client, client.submit(JobKind.LOAD, {"how": how}))
    assert answer.kind is MessageKind.ERROR
    assert message in answer.fields["message"]
    assert detail in answer.fields["detail"]
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


def test_what_the_worker_lacks_is_named(client):
    answer = finish(client, client.submit(JobKind.LOAD, {"how": "missing"}))
    assert (answer.kind, answer.fields["missing"]) == (MessageKind.ERROR, ["one", "two"])


def test_what_a_job_prints_goes_to_the_log_and_it_reads_no_frames(client):
    answer = finish(client, client.submit(JobKind.PREPARE, {}))
    assert answer.kind is MessageKind.RESULT
    assert answer.fields == {"stdin": ""}
    assert {"not a frame", "not a frame either"} <= set(client.log.read_text().splitlines())


def test_a_worker_that_dies_answers_every_open_job_once_and_starts_again(client):
    jobs = [client.submit(kind, {}) for kind in (JobKind.SAVE, JobKind.MESH, JobKind.MESH)]
    finals = all_finals(client, 3)
    assert [(m.job, m.kind) for m in finals] == [(job, MessageKind.ERROR) for job in jobs]
    for message in finals:
        assert "stopped unexpectedly (exit code 3: the last words)" in message.fields["message"]
        assert "the last words" in message.fields["detail"]
    assert client.state is WorkerState.DEAD
    assert client.problem == finals[0].fields["message"]
    assert not client.alive
    assert all(message.fields["died"] for message in finals)
    with pytest.raises(WorkerGoneError, match="not running"):
        client.submit(JobKind.MESH, {})
    client.start()
    assert client.problem == ""
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


@POSIX
def test_a_worker_killed_in_mid_job_is_an_error_and_starts_again(client):
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    os.kill(client.pid, signal.SIGKILL)
    answer = finish(client, job)
    assert answer.kind is MessageKind.ERROR
    assert "killed by SIGKILL" in answer.fields["message"]
    client.start()
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


@POSIX
def test_a_worker_started_again_before_its_death_was_polled_still_answers_for_it(client):
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    os.kill(client.pid, signal.SIGKILL)
    until(lambda: not client.alive)
    client.start()
    assert finish(client, job).kind is MessageKind.ERROR
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


@POSIX
def test_submitting_never_waits_for_a_worker_that_does_not_read(client):
    finish(client, client.submit(JobKind.MESH, {}))
    os.kill(client.pid, signal.SIGSTOP)
    job = client.submit(JobKind.MESH, {}, {"a": np.ones(1 << 22)})  # far more than a pipe holds
    assert client.poll_once() == []
    os.kill(client.pid, signal.SIGCONT)
    assert finish(client, job).arrays["a"].sum() == 1 << 22


@POSIX
def test_stop_ends_even_a_worker_that_hears_nothing(client):
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    pid = client.pid
    os.kill(pid, signal.SIGSTOP)
    client.stop()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    assert finish(client, job).kind is MessageKind.CANCELLED


def states_until(client: Client, wanted: WorkerState) -> set[WorkerState]:
    """All states of the client until it is in the wanted one."""
    seen = set()

    def there() -> bool:
        client.poll_once()
        seen.add(client.state)
        return client.state is wanted

    until(there)
    return seen


@POSIX
def test_a_stopped_worker_hangs_until_it_goes_on(client, monkeypatch):
    monkeypatch.setattr(pulse, "SILENT", 3.0)
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    os.kill(client.pid, signal.SIGSTOP)
    states_until(client, WorkerState.HANGING)
    os.kill(client.pid, signal.SIGCONT)
    states_until(client, WorkerState.READY)
    assert client.alive


@POSIX
def test_a_worker_that_hangs_is_given_up_as_one_that_died(client, monkeypatch):
    monkeypatch.setattr(pulse, "SILENT", 3.0)
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    pid = client.pid
    os.kill(pid, signal.SIGSTOP)
    states_until(client, WorkerState.HANGING)
    client.give_up()
    assert gone(pid)
    answer = finish(client, job)
    assert answer.fields["died"]
    assert "gave no sign of life" in answer.fields["message"]
    client.start()
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


@pytest.mark.long
def test_a_long_silent_computation_is_no_hanging(client, monkeypatch):
    monkeypatch.setattr(pulse, "SILENT", 3.0)
    job = client.submit(JobKind.SAMPLE, {"seconds": 10.0})
    finals: list[Message] = []

    def ended() -> bool:
        finals.extend(client.poll_once())
        assert client.state is not WorkerState.HANGING
        return bool(finals)

    until(ended)
    assert (finals[0].job, finals[0].kind) == (job, MessageKind.RESULT)


def test_a_job_that_reports_nothing_for_minutes_hangs(tmp_path, monkeypatch):
    monkeypatch.setattr(pulse, "SILENT", 3.0)
    client = Client([*TOY_WORKER, "1.0"], tmp_path / "log")
    client.start()
    finish(client, client.submit(JobKind.MESH, {}))
    job = client.submit(JobKind.SAMPLE, SLOW)
    states_until(client, WorkerState.HANGING)
    client.give_up()
    assert finish(client, job).fields["died"]


@LINUX
def test_a_temporary_folder_whose_name_has_a_line_break(tmp_path, monkeypatch):
    (tmp_path / "two\nlines").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "two\nlines"))
    client = Client(TOY_WORKER, tmp_path / "log")
    client.start()
    assert finish(client, client.submit(JobKind.MESH, {"n": 1})).fields == {"n": 1}
    client.stop()
    assert not [*(tmp_path / "two\nlines").iterdir()]


def test_stop_cancels_what_is_open_and_start_begins_anew(client):
    jobs = [client.submit(JobKind.EDIT, SLOW) for _ in range(2)]
    begun(client, jobs[0])
    client.stop()
    assert client.state is WorkerState.STOPPED
    assert not client.alive
    assert [(m.job, m.kind) for m in all_finals(client, 2)] == [
        (job, MessageKind.CANCELLED) for job in jobs
    ]
    client.stop()
    client.start()
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


def test_what_cannot_be_sent_is_said_at_once_and_opens_no_job(client):
    with pytest.raises(ProtocolError):
        client.submit(JobKind.MESH, {"a": float("nan")})
    first = client.submit(JobKind.MESH, {})
    assert [message.job for message in all_finals(client, 1)] == [first]


def test_a_worker_that_talks_nonsense_is_ended(tmp_path):
    script = textwrap.dedent("""
        import json, sys
        from pathlib import Path
        answers = Path(json.loads(input())) / "answers"
        (answers / "part").write_text("Hello!")
        (answers / "part").rename(answers / "0")
        sys.stdin.read()
    """)
    client = Client([sys.executable, "-c", script], tmp_path / "log")
    client.start()
    answer = finish(client, client.submit(JobKind.MESH, {}))
    assert "ends after 6 of 16 bytes" in answer.fields["message"]
    assert not client.alive


@pytest.mark.skipif(os.name != "posix", reason="there a folder is as a file in use")
def test_a_worker_whose_answer_cannot_be_opened_is_ended(tmp_path):
    client = Client(["/bin/cat"], tmp_path / "log")
    client.start()
    job = client.submit(JobKind.EDIT, {})
    (client.folder / ANSWERS / "0").mkdir()
    (news,) = client.poll_once()
    assert (news.kind, news.job, news.fields["died"]) == (MessageKind.ERROR, job, True)
    assert "cannot be opened" in news.fields["message"]
    assert not client.alive
    client.stop()


def test_a_worker_whose_progress_says_nothing_is_ended(tmp_path):
    script = textwrap.dedent("""
        import json, sys
        from pathlib import Path
        sys.path.insert(0, sys.argv[1])
        from neural_sculpt_addon.worker.mailbox import Outbox
        from neural_sculpt_addon.worker.protocol import Message, MessageKind
        answers = Outbox(Path(json.loads(input())) / "answers")
        sys.stdin.read(1)
        answers.put(Message(MessageKind.PROGRESS, 1, {"fraction": "half"}))
        sys.stdin.read()
    """)
    client = Client([sys.executable, "-c", script, str(ROOT)], tmp_path / "log")
    client.start()
    answer = finish(client, client.submit(JobKind.MESH, {}))
    assert answer.fields["died"]
    assert "its progress has no 'fraction'" in answer.fields["message"]
    assert not client.alive


def test_a_worker_of_another_protocol_is_ended(tmp_path):
    script = textwrap.dedent("""
        import sys
        sys.path.insert(0, sys.argv[1])
        from neural_sculpt_addon.worker.server import server
        server.PROTOCOL = 10**6
        server.take_over().serve({}, {})
    """)
    client = Client([sys.executable, "-c", script, str(ROOT)], tmp_path / "log")
    client.start()
    answer = finish(client, client.submit(JobKind.MESH, {}))
    assert "another version of Neural Sculpt" in answer.fields["message"]
    assert not client.alive


def test_a_command_that_cannot_be_run_is_said_at_once(tmp_path):
    client = Client([str(tmp_path / "no-python")], tmp_path / "log")
    with pytest.raises(SculptError, match="cannot be started"):
        client.start()
    assert client.state is WorkerState.STOPPED


def test_a_log_that_cannot_be_written_is_said_at_once(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(SculptError, match="cannot be started"):
        Client(TOY_WORKER, tmp_path / "file" / "worker.log").start()


def test_the_worker_does_not_see_the_python_of_its_parent(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/somewhere")
    monkeypatch.setenv("PYTHONHOME", "/elsewhere")
    script = "import os, sys; sys.exit(str({'PYTHONPATH', 'PYTHONHOME'} & os.environ.keys()))"
    client = Client([sys.executable, "-c", script], tmp_path / "log")
    client.start()
    until(lambda: client.poll_once() or client.state is WorkerState.DEAD)
    assert client.log.read_text().strip() == "set()"


def raw_worker() -> subprocess.Popen[bytes]:
    return subprocess.Popen(TOY_WORKER, bufsize=0, stdin=subprocess.PIPE)


def folder_for(tmp_path: Path) -> Path:
    for name in (REQUESTS, ANSWERS):
        (tmp_path / "worker" / name).mkdir(parents=True)
    return tmp_path / "worker"


def test_the_end_of_stdin_ends_the_worker_in_mid_job_and_leaves_no_files(tmp_path):
    folder = folder_for(tmp_path)
    answers = Inbox(folder / ANSWERS)
    with raw_worker() as worker:
        worker.stdin.write(json.dumps(str(folder)).encode() + b"\n")
        Outbox(folder / REQUESTS).put(Message(JobKind.EDIT, 1, SLOW))
        worker.stdin.write(b".")
        for kind in (MessageKind.HELLO, MessageKind.PROGRESS):
            said: list[Message] = []
            until(lambda said=said: said.extend(filter(None, [answers.take()])) or said)
            assert said[0].kind is kind
        worker.stdin.close()
        assert worker.wait(PATIENCE) == 0
    assert not folder.exists()


@pytest.mark.long
def test_a_worker_whose_request_is_lost_says_so_and_ends(tmp_path):
    folder = folder_for(tmp_path)
    with subprocess.Popen(TOY_WORKER, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as worker:
        worker.stdin.write(json.dumps(str(folder)).encode() + b"\n.")
        worker.stdin.flush()
        assert worker.wait(PATIENCE) != 0
        assert b"is lost" in worker.stderr.read()


def test_garbage_on_stdin_ends_the_worker():
    with raw_worker() as worker:
        worker.stdin.write(b"garbage garbage garbage\n")
        assert worker.wait(PATIENCE) == 1


def test_nothing_is_left_when_a_worker_is_stopped_or_killed(client, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for end in (Client.stop, lambda client: os.kill(client.pid, signal.SIGTERM)):
        client.stop()
        client.start()
        finish(client, client.submit(JobKind.MESH, {}, {"a": np.ones(1000)}))
        assert len([*tmp_path.glob("neural_sculpt_*")]) == 1
        end(client)
        until(lambda: client.poll_once() or client.state is not WorkerState.READY)
        assert not [*tmp_path.glob("neural_sculpt_*")]


def test_a_full_disk_is_said_at_once_and_opens_no_job(client, tmp_path):
    finish(client, client.submit(JobKind.MESH, {}))
    requests = client.folder / REQUESTS
    requests.rename(tmp_path / "elsewhere")  # as good as full
    with pytest.raises(SculptError, match="room on the disk"):
        client.submit(JobKind.MESH, {})
    (tmp_path / "elsewhere").rename(requests)
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


@POSIX
def test_a_cancel_that_a_dead_worker_cannot_hear_is_no_error(client, tmp_path):
    job = client.submit(JobKind.EDIT, SLOW)
    begun(client, job)
    os.kill(client.pid, signal.SIGKILL)
    until(lambda: not client.alive)
    (client.folder / REQUESTS).rename(tmp_path / "elsewhere")
    client.cancel(job)
    assert finish(client, job).kind is MessageKind.ERROR


def test_no_thread_is_needed(client):
    before = threading.active_count()
    finish(client, client.submit(JobKind.MESH, {}, {"a": np.ones(1 << 20)}))
    assert threading.active_count() == before


@POSIX
def test_a_result_half_read_survives_the_death_of_the_worker(client, monkeypatch):
    until(lambda: client.poll_once() or client.state is WorkerState.READY)
    monkeypatch.setattr("neural_sculpt_addon.worker.client.READING", 0.0)
    arrays = {str(number): np.arange(number) for number in range(8)}
    job = client.submit(JobKind.MESH, {}, arrays)
    until((client.folder / ANSWERS / "1").exists)  # the whole result, after the hello
    assert client.poll_once() == []  # one piece of it
    os.kill(client.pid, signal.SIGKILL)
    until(lambda: not client.alive)
    (result,) = all_finals(client, 1)
    assert (result.kind, result.job) == (MessageKind.RESULT, job)
    np.testing.assert_array_equal(result.arrays["7"], arrays["7"])
    until(lambda: client.poll_once() or client.state is WorkerState.DEAD)


@POSIX
def test_interrupting_the_terminal_does_not_interrupt_the_worker(client):
    finish(client, client.submit(JobKind.MESH, {}))
    os.kill(client.pid, signal.SIGINT)
    assert finish(client, client.submit(JobKind.MESH, {})).kind is MessageKind.RESULT


@LINUX
def test_the_worker_goes_when_its_parent_is_killed(tmp_path):
    script = textwrap.dedent(f"""
        import sys, time
        from pathlib import Path
        sys.path.insert(0, {str(ROOT)!r})
        from neural_sculpt_addon.worker.client import Client, JobKind
        client = Client({TOY_WORKER!r}, Path({str(tmp_path / "log")!r}))
        client.start()
        client.submit(JobKind.EDIT, {{"seconds": 600.0}})
        while not client.poll_once():
            time.sleep(0.01)
        print(client.pid, flush=True)
        time.sleep(600)
    """)
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE) as parent:
        pid = int(parent.stdout.readline())
        assert not gone(pid)
        parent.kill()
    until(lambda: gone(pid))


@LINUX
def test_the_worker_goes_with_its_parent_even_if_another_holds_its_pipe(tmp_path):
    folder = folder_for(tmp_path)
    script = textwrap.dedent(f"""
        import subprocess, sys, time
        worker = subprocess.Popen({TOY_WORKER!r})
        print(worker.pid, flush=True)
        time.sleep(600)
    """)
    with subprocess.Popen(
        [sys.executable, "-c", script], bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as parent:
        parent.stdin.write(json.dumps(str(folder)).encode() + b"\n")
        pid = int(parent.stdout.readline())
        until(Inbox(folder / ANSWERS).take)
        assert not gone(pid)
        parent.kill()
        until(lambda: gone(pid))  # while this process still holds the other end of its stdin


@LINUX
def test_a_killed_blender_leaves_no_folder_behind_the_next_start(tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    script = textwrap.dedent("""
        import os, sys
        from pathlib import Path
        sys.path.insert(0, sys.argv[1])
        from neural_sculpt_addon.worker.client import Client, JobKind
        client = Client(sys.argv[2:], Path(os.devnull).parent / "null")
        client.start()
        client.wait(client.submit(JobKind.MESH, {}))
        os.kill(client.pid, 9)  # or it would remove its folder itself
        os.kill(os.getpid(), 9)
    """)
    command = [sys.executable, "-c", script, str(ROOT), *TOY_WORKER]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    left = set(tmp_path.glob("neural_sculpt_*"))
    assert left
    other = Client(TOY_WORKER, tmp_path / "log")
    other.start()
    now = set(tmp_path.glob("neural_sculpt_*"))
    assert len(now) == 1
    assert not now & left
    client = Client(TOY_WORKER, tmp_path / "log2")
    client.start()
    assert len(set(tmp_path.glob("neural_sculpt_*"))) == 2, "that of one that runs stays"
    for each in (other, client):
        each.stop()
