# SPDX-License-Identifier: GPL-3.0-or-later
"""No network socket is opened by the worker, the command line or a stroke in Blender, as strace
sees it: processes speak by files and pipes. Left out, and said so, where there is no strace."""

import json
import os
import re
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
import trimesh

from neural_sculpt_addon.worker.client import Client, JobKind, MessageKind
from neural_sculpt_addon.worker.install.environment import ENVIRONMENT_VARIABLE, worker_command
from tests.worker.support import PATIENCE, ROOT

STRACE = shutil.which("strace")
BLENDER = ROOT / ".venv" / "bin" / "python"
STROKE = {
    "points": [[0.6, 0.0, 0.0], [0.6, 0.05, 0.0]],
    "radius": 0.1,
    "intensity": 0.02,
    "profile": {"name": "quintic"},
    "modulation": {"name": "identity"},
}

pytestmark = pytest.mark.skipif(STRACE is None, reason="no strace (apt-get install strace)")


def traced(trace: Path) -> list[str]:
    return [str(STRACE), "-f", "--seccomp-bpf", "-o", str(trace), "-e", "trace=socket", "--"]


def network_sockets(trace: Path) -> list[str]:
    """The lines about sockets that are not within this computer."""
    lines = trace.read_text(errors="replace").splitlines()
    assert any("+++ exited" in line or "+++ killed" in line for line in lines), "nothing was traced"
    return [line for line in lines if "socket(" in line and not re.search(r"AF_UNIX", line)]


def run(trace: Path, command: list[str], **variables: str) -> None:
    environ = {**os.environ, **variables}
    done = subprocess.run(
        [*traced(trace), *command],
        env=environ,
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_socket_would_be_seen(tmp_path):
    run(tmp_path / "trace", [sys.executable, "-c", "import socket; socket.socket()"])
    assert len(network_sockets(tmp_path / "trace")) == 1


def test_the_worker_opens_none(tmp_path):
    trace = tmp_path / "trace"
    client = Client([*traced(trace), *worker_command(sys.executable)], tmp_path / "log")
    client.start()
    sphere = client.wait(
        client.submit(JobKind.FIT, {"primitive": "sphere", "resolution": 48}), timeout=PATIENCE
    )
    assert sphere.kind is MessageKind.RESULT, sphere.fields
    state = {"base": sphere.fields["id"], "layers": []}
    fields = {"state": state, "revision": "a", "result_revision": "b", "resolution": 48}
    fields |= {"stroke": STROKE, "solver": "local"}
    edit = client.wait(client.submit(JobKind.EDIT, fields), timeout=PATIENCE)
    assert edit.kind is MessageKind.RESULT, edit.fields
    client.stop()
    assert network_sockets(trace) == []


@pytest.mark.long
def test_fit_and_apply_open_none(tmp_path):
    mesh, field, strokes = (tmp_path / name for name in ("box.ply", "a.safetensors", "s.json"))
    trimesh.creation.icosahedron().export(mesh)
    strokes.write_text(json.dumps({"version": 1, "strokes": []}))
    cli = [sys.executable, "-m", "neural_sculpt_addon"]
    fit = [*cli, "fit", str(mesh), "-o", str(field), "--preset", "draft", "--width", "64"]
    run(tmp_path / "fit", [*fit, "--no-detail"])
    from neural_sculpt_addon.field import checkpoint
    from neural_sculpt_addon.field.primitives import primitive

    checkpoint.save(primitive("sphere"), field)
    strokes.write_text(json.dumps({"version": 1, "strokes": [STROKE]}))
    run(tmp_path / "apply", [*cli, "apply", str(field), str(strokes), "-o", str(field)])
    assert network_sockets(tmp_path / "fit") == network_sockets(tmp_path / "apply") == []


@pytest.mark.skipif(not BLENDER.exists(), reason="no Blender as a module in .venv")
@pytest.mark.long
def test_a_stroke_in_blender_opens_none(tmp_path):
    script = textwrap.dedent("""
        import os, sys
        from pathlib import Path
        sys.path.insert(0, sys.argv[1])
        from reliability.attacked import stressed_blender
        harness = stressed_blender.install(Path(sys.argv[2]))
        import bpy
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.context.preferences.addons[harness.EXTENSION].preferences.resolution = 48
        ob = harness.add("SPHERE")
        assert harness.stroke(harness.arc(ob)) == {"FINISHED"}
        assert len(ob.neural_sculpt.strokes) == 1
        bpy.ops.preferences.addon_disable(module=harness.EXTENSION)
        os._exit(0)
    """)
    command = [str(BLENDER), "-c", script, str(ROOT / "scripts"), str(tmp_path / "user")]
    (tmp_path / "user").mkdir()
    run(tmp_path / "trace", command, **{ENVIRONMENT_VARIABLE: sys.executable})
    assert network_sockets(tmp_path / "trace") == []
