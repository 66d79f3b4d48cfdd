# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of what an artist does to two fields, with undo and redo among them.

Results come when the sequence says so, so late among everything else. After each operation

- nothing has changed without a step in Blender's history, and undo and redo lead to states that
  were seen before,
- each mesh is the sum of its field's base and layers, or what Blender's own tools made of it, which
  only Absorb, Remesh Proxy and the history itself may take away,
- each stroke whose job has ended is listed.

The worker is the toy one, whose fields are added up here. A sequence is a generator, of which each
`yield seconds` lets a window be drawn.
"""

import os
import random
import signal
import time
from collections import Counter
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from dataclasses import dataclass

import bmesh
import bpy
import harness
import numpy as np
from bpy.types import Object

brush_results = harness.module("blender.session.absorption.brush_results")
live = harness.module("blender.session.absorption.live")
preview_attributes = harness.module("blender.scene.mesh.preview_attributes")
native_edits = harness.module("blender.scene.mesh.native_edits")
sculpt_steps = harness.module("blender.scene.sculpt_steps")
undo_step = harness.module("blender.scene.undo_step")
properties = harness.module("blender.scene.properties")
proxy_mesh = harness.module("blender.scene.mesh.proxy_mesh")
ops = bpy.ops.neural_sculpt

OPERATIONS = 20
LONGEST = 60.0  # seconds after which a job hangs
CLOSE = 0.01  # of positions up to some thousands, which a preview rounds
SIZE = 24  # numbers of a toy field
KINDS = ("DRAW", "DRAW", "DRAW", "SMOOTH", "FLATTEN", "PINCH")
OBJECTS = 5  # at most
WEIGHTS = {
    **{"draw": 5, "deliver_one": 3, "deliver": 2, "undo": 6, "redo": 4},
    **{"mute": 2, "solo": 1, "strength": 2, "delete": 1, "duplicate": 1, "move": 2},
    **{"edit": 2, "dialog": 2, "base": 1, "remesh": 2, "absorb": 3, "sculpt": 3, "brush": 2},
    **{"boolean": 1, "consolidate": 1, "choose": 1},
    **{"object_mode": 3, "edit_mode": 2, "sculpt_mode": 2, "link": 1, "remove": 1, "transform": 1},
    **{"save": 1, "kill": 1, "cancel": 1, "piece": 2},
}
FIRST = "draw", "draw", "draw", "deliver"
"""What each sequence begins with, so that there is a history."""
TAKE_IN = ("mesh", "absorb_proxy", "absorb_stroke")
"""Jobs that may take away what Blender's own tools made."""
BY_THEMSELVES = ("mesh", "apply_to_base", "consolidate")
"""Jobs whose results no sequence keeps back."""
Steps = Generator[float, None, None]


@dataclass(frozen=True, eq=False)
class Seen:
    """A field at a moment: what it is made of, the vertices (V, 3) of its proxy that Blender's
    history has, and those that are seen without a preview."""

    made_of: tuple[object, ...]
    positions: np.ndarray
    shown: np.ndarray

    def same(self, other: "Seen") -> bool:
        """Whether it is as another one."""
        one, two = self.positions, other.positions
        return self.made_of == other.made_of and one.shape == two.shape and close(one, two)


Scene = dict[str, Seen]


class Hands:
    """How undo, redo and Esc come to a Blender without a window."""

    def undo(self) -> Steps:
        """One step back."""
        harness.undo()
        yield 0.0

    def redo(self) -> Steps:
        """One step forth."""
        harness.redo()
        yield 0.0

    def escape(self) -> Steps:
        """Leave a dialog, which without a window nobody sees."""
        yield 0.0

    def context(self) -> AbstractContextManager[object]:
        """Where operators are called."""
        return bpy.context.temp_override(window=bpy.context.window_manager.windows[0])


class Sequence:
    """A sequence; AssertionError where something is not as it must be; `told` is what was done."""

    def __init__(self, case: harness.SteeredCase, seed: str, hands: Hands) -> None:
        self.case, self.session, self.hands = case, case.session, hands
        self.random = random.Random(seed)
        self.told: list[str] = []
        self.first = 0
        self.last: tuple[Scene, int] = {}, 0
        """The scene, and its step in Blender's history."""
        self.steps: list = []
        """Those of Blender's history up to the one that the scene is at."""
        self.possible: dict[int, list[Scene]] = {}
        """What the scene may be at each step of Blender's history; nothing of steps that nobody has
        seen."""
        self.took_effect: Counter[str] = Counter()
        """How often each operation could be done."""
        self.jobs: list = []
        """All that were asked for, or began by themselves, until they have ended."""

    def play(self) -> Steps:
        """All of it."""
        yield from self._begin()
        words, weights = zip(*WEIGHTS.items(), strict=True)
        for word in FIRST:
            yield from self._operate(word)
        for _ in range(OPERATIONS):
            yield from self._operate(self.random.choices(words, weights)[0])
        for word in ("object_mode", "deliver"):
            yield from self._operate(word)
        while steps()[0] > self.first:
            yield from self._operate("undo")
        while steps()[0] < steps()[1] - 1:
            yield from self._operate("redo")

    def _begin(self) -> Steps:
        self.session.cancel()
        (self.case.folder / "go").unlink(missing_ok=True)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.context.preferences.edit.undo_steps = 256
        yield 0.0
        harness.push_undo("Start")
        harness.call_as("Script")
        for kind in ("SPHERE", "TORUS"):
            with self.hands.context():
                ops.add(kind=kind)
        harness.call_as("Artist")
        harness.push_undo("Fields")
        self.first = steps()[0]
        self.last, self.steps = (scene(), self.first), sculpt_steps.steps()[0]
        self.possible[self.first] = [self.last[0]]

    def _operate(self, word: str) -> Steps:
        """One operation, and what must be so after it."""
        if word not in ("undo", "redo"):
            self._choose()
        before, _ = self.last
        fields = [harness.field(name) for name in before]
        edited = [ob for ob in fields if native_edits.edited(ob)]
        natively = [(ob.name, [other.session_uid for other in linked(ob)]) for ob in edited]
        self.told.append(f"{word} {getattr(active(), 'name', None)}")
        at = self.steps, [*self.jobs], getattr(active(), "mode", None)
        yield from getattr(self, word)() or ()
        self.took_effect[word] += at != (sculpt_steps.steps()[0], [*self.session.jobs], _mode())
        if not editing():  # these come by themselves
            yield from self._until(lambda: self._first_kind() not in BY_THEMSELVES)
        self._look()
        for name in scene():
            check_sum(harness.field(name))
        ended = [job for job in self.jobs if not job.pending]
        self.jobs = [job for job in self.jobs if job.pending]
        if word not in ("undo", "redo", "sculpt", "brush"):
            done = [job for job in ended if job.status == "done"]
            taken = {job.target for job in done if job.kind in TAKE_IN}
            left = [name for name, targets in natively if taken.isdisjoint(targets)]
            check_native(before, [name for name in left if not comes_in(before[name], name)])
        check_strokes(ended)

    def _choose(self) -> None:
        """Work on another field, as the artist can in Object Mode; to select is a step."""
        chosen = self.random.choice([*scene()])
        if active() is None or (active().mode == "OBJECT" and active().name != chosen):
            select(chosen)
            harness.push_undo("Select")
            self._look()

    def _look(self) -> None:
        """See what the scene is after an operation or a result, and keep it by its step."""
        self.jobs += [job for job in self.session.jobs if job not in self.jobs]
        (before, _), now, (place, count) = self.last, scene(), steps()
        past, self.steps = self.steps, sculpt_steps.steps()[0]
        self.last = now, place
        pairs = enumerate(zip(past, self.steps, strict=False))
        new = next((step for step, (one, two) in pairs if one != two), len(past))
        if place < new and self._keeps_steps(before, now):
            for step in range(place, self.first, -1):
                if not sculpt_steps.is_native(self.steps[step]):
                    break
                self.possible[step] = [now] if step == place else []
        elif place < new:
            known = [before, *self.possible.get(place, ())]
            same(now, known, "was changed without a step in the history")
        taken_back = self.possible.get(new - 1, [])  # what the steps that gave way were done to
        between = [] if several(before, now) else [*taken_back, before, now]
        for step in range(new, place + 1):
            self.possible[step] = [now] if step == place else between
        if new <= place:  # what lies ahead of new steps: borders alone, which hold what is there
            self.possible.update({step: [now] for step in range(place + 1, count)})
        for step in [step for step in self.possible if step >= count]:
            del self.possible[step]

    def _keeps_steps(self, before: Scene, now: Scene) -> bool:
        """Whether brush strokes have come in, from Blender 5.0 on, without steps of ours: those of
        the brushes stand for them, and the meshes stay."""
        changed = [name for name in now if not now[name].same(before.get(name, now[name]))]
        return (
            bool(changed)
            and now.keys() == before.keys()
            and sculpt_steps.is_native(self.steps[-1])
            and all(comes_in(before[name], name) for name in changed)
            and all(close(before[name].positions, now[name].positions) for name in changed)
        )

    def _look_after_step(self) -> None:
        """See that undo or redo has led to what the scene was there."""
        (_, at), now, (place, count) = self.last, scene(), steps()
        self.last, self.steps = (now, place), sculpt_steps.steps()[0]
        if not self.possible[place]:
            self.possible[place] = [now]
        same(now, self.possible[place], f"is not what it was at step {place}")
        if place == at:  # a stroke that waited was undone, by a step of its own
            self.possible[count - 1] = [now]
        for step in [step for step in self.possible if step >= count]:
            del self.possible[step]

    def _first_kind(self) -> str:
        return self.session.jobs[0].kind if self.session.jobs else ""

    def _until(self, condition: Callable[[], bool]) -> Steps:
        """Let the worker go on until something is so."""
        end = time.monotonic() + LONGEST
        while not condition():
            assert time.monotonic() < end, f"a job hangs: {[*self.session.jobs]}"
            self.session.poll_once()
            self._look()
            yield 0.003

    def _deliver(self, count: int) -> Steps:
        """Let jobs end until so many are left, as far as they can in this mode."""

        def over() -> bool:
            jobs = self.session.jobs
            return len(jobs) <= count or jobs[0].waits or "this mode" in jobs[0].message

        self.case.say("go")
        yield from self._until(over)
        (self.case.folder / "go").unlink()

    def _ask(self, operator: Callable[..., object], *how: object, **given: object) -> None:
        """Call an operator, which may say no in a sentence."""
        known = [*self.session.jobs]
        try:
            with self.hands.context():
                operator(*how, **given)
        except RuntimeError as error:
            text = str(error)
            assert "Traceback" not in text and "Python:" not in text, text
        self.jobs += [job for job in self.session.jobs if job not in known]

    def _entry(self, operator: Callable[..., object], **given: object) -> None:
        """Call an operator for any entry of the list."""
        listed = active().neural_sculpt.strokes
        if len(listed) and not editing():
            self._ask(operator, uid=self.random.choice(listed).uid, **given)

    # What an artist does; all of it may be refused.

    def draw(self) -> None:
        """A stroke at the first vertex, which is displaced meanwhile, or where nothing is."""
        ways = [[-0.97, 0.03, 0.97], [-0.9, 0.1, 0.9]], [[0.5, 0.1, 0.2], [0.5, 0.2, 0.3]]
        points = np.array(self.random.choice(ways))
        harness.brush_settings().kind = self.random.choice(KINDS)
        self._ask(ops.stroke, points=harness.collection(points), name=f"Drawn {len(self.told)}")

    def deliver_one(self) -> Steps:
        """The first job that waits ends."""
        yield from self._deliver(max(len(self.session.jobs) - 1, 0))

    def deliver(self) -> Steps:
        """All of them do."""
        yield from self._deliver(0)

    def undo(self) -> Steps:
        """Ctrl Z, not farther than to the first step of the sequence."""
        if steps()[0] > self.first:
            yield from self.hands.undo()
            self._look_after_step()

    def redo(self) -> Steps:
        """Shift Ctrl Z."""
        place, count = steps()
        if place < count - 1:
            yield from self.hands.redo()
            self._look_after_step()

    def mute(self) -> None:
        """Mute an entry, or no longer."""
        self._entry(ops.mute_stroke)

    def solo(self) -> None:
        """Mute all others."""
        self._entry(ops.solo_stroke)

    def strength(self) -> None:
        """Weaken one."""
        self._entry(ops.set_strength, strength=self.random.choice((0.0, 0.3, 1.0)))

    def delete(self) -> None:
        """Delete one."""
        self._entry(ops.delete_stroke)

    def duplicate(self) -> None:
        """Have one twice."""
        self._entry(ops.duplicate_stroke)

    def move(self) -> None:
        """Reorder."""
        self._entry(ops.move_stroke, direction=self.random.choice(("UP", "DOWN")))

    def edit(self) -> None:
        """Change the settings of a stroke."""
        settings = (
            {"intensity": self.random.uniform(-0.2, 0.2)},
            {"radius": 0.2, "profile": "CURVE"},
            {"ends": "FLAT"},
            {"mirror": {"X"}, "closed": True},
            {"pressure": False},
        )
        self._entry(ops.edit_stroke, **self.random.choice(settings))

    def dialog(self) -> Steps:
        """Open Edit Stroke and leave it by Esc."""
        if len(active().neural_sculpt.strokes):
            self._ask(ops.edit_stroke, "INVOKE_DEFAULT")
            self.took_effect["dialog"] += 1
            yield from self.hands.escape()

    def base(self) -> None:
        """Apply to Base."""
        self._ask(ops.apply_to_base)

    def remesh(self) -> None:
        """Another proxy of the same field."""
        self._ask(ops.remesh, resolution=self.random.choice((32, 48)))

    def absorb(self) -> None:
        """Take what other tools made into the field."""
        self._ask(ops.absorb)

    def sculpt(self) -> None:
        """Move vertices by Blender's own tools, of the mode."""
        ob = active()
        if ob.mode == "SCULPT":
            kind = self.random.choice(("SCALE", "INFLATE"))
            self._ask(bpy.ops.sculpt.mesh_filter, "EXEC_DEFAULT", True, type=kind, strength=0.5)
            return
        chosen = self.random.randrange(SIZE // 3)
        if ob.mode == "EDIT":
            edited = bmesh.from_edit_mesh(ob.data)
            edited.verts.ensure_lookup_table()
            edited.verts[chosen].co.z += 7
            bmesh.update_edit_mesh(ob.data)
        else:
            raw = harness.vertices(ob)
            raw[chosen, 2] += 7
            ob.data.vertices.foreach_set("co", raw.ravel())
        harness.push_undo("Native")

    def brush(self) -> None:
        """Sculpt as a brush does, and let that be absorbed by itself."""
        if active().mode == "SCULPT":
            self.sculpt()
            live.look()

    def piece(self) -> None:
        """One brush stroke that has its result gets a little nearer to the scene."""
        self.session.poll_once()
        self._look()

    def boolean(self) -> None:
        """Unite two fields, of which one is hidden then."""
        others = [ob for ob in bpy.data.objects if ob != active() and ob.visible_get()]
        if others and active().mode == "OBJECT":
            others[0].select_set(True)
            self._ask(ops.boolean, operation="UNION")
            others[0].select_set(False)

    def consolidate(self) -> None:
        """Make a network of the field."""
        self._ask(ops.consolidate)

    def choose(self) -> None:
        """Point at an entry of the list, whose stroke is shown then."""
        if listed := active().neural_sculpt.strokes:
            active().neural_sculpt.active_stroke = self.random.randrange(len(listed))
            self.took_effect["choose"] += 1

    def object_mode(self) -> Steps:
        """Leave any other mode."""
        yield from self._enter("OBJECT")

    def edit_mode(self) -> Steps:
        """Edit the mesh."""
        yield from self._enter("EDIT")

    def sculpt_mode(self) -> Steps:
        """Blender's brushes; by way of Object Mode, for Blender itself does not take back what was
        done in Edit Mode when that was left straight for Sculpt Mode."""
        if editing():
            yield from self._enter("OBJECT")
        yield from self._enter("SCULPT")

    def _enter(self, mode: str) -> Steps:
        if active().mode != mode:
            self._ask(bpy.ops.object.mode_set, "EXEC_DEFAULT", True, mode=mode)
            self.session.poll_once()
            self._look()
            yield 0.0

    def link(self) -> None:
        """Alt D."""
        if active().mode == "OBJECT" and len(bpy.data.objects) < OBJECTS:
            given = {
                "OBJECT_OT_duplicate": {"linked": True},
                "TRANSFORM_OT_translate": {"value": (2, 0, 0)},
            }
            self._ask(bpy.ops.object.duplicate_move_linked, "EXEC_DEFAULT", True, **given)

    def remove(self) -> None:
        """Delete an object, but not the last ones."""
        if active().mode == "OBJECT" and len(bpy.data.objects) > 2:
            self._ask(bpy.ops.object.delete, "EXEC_DEFAULT", True)

    def transform(self) -> None:
        """Move the object."""
        if active().mode == "OBJECT":
            active().location.x += 1
            bpy.context.view_layer.update()
            harness.push_undo("Move")

    def save(self) -> None:
        """Save the file, but not in Edit Mode: Blender itself does not undo what that flushes."""
        if not editing():
            path = str(self.case.folder / "sequence.blend")
            self._ask(bpy.ops.wm.save_as_mainfile, "EXEC_DEFAULT", filepath=path, copy=True)
            self.took_effect["save"] += 1

    def kill(self) -> None:
        """Kill the worker."""
        if self.session.client is not None and self.session.client.alive:
            os.kill(self.session.client.pid, signal.SIGKILL)
            self.took_effect["kill"] += 1

    def cancel(self) -> None:
        """Cancel what waits."""
        self.session.cancel()


def active() -> Object:
    """The object that is worked on; never kept."""
    return bpy.context.view_layer.objects.active


def linked(ob: Object) -> list[Object]:
    """The objects with the mesh of one: a brush sculpts them all, and one of them absorbs it."""
    return [other for other in bpy.data.objects if other.data == ob.data]


def _mode() -> str | None:
    return getattr(active(), "mode", None)


def several(before: Scene, now: Scene) -> bool:
    """Whether a field has more than one entry more, as brush strokes come together."""
    lists = [(before[name].made_of[2], now[name].made_of[2]) for name in before.keys() & now.keys()]
    return any(len(two) > len(one) + 1 for one, two in lists)


def select(name: str) -> None:
    """Make a field the active object and the only one that is selected."""
    for ob in bpy.data.objects:
        ob.select_set(ob.name == name)
    bpy.context.view_layer.objects.active = harness.field(name)


def editing() -> bool:
    """Whether Edit Mode makes results wait."""
    return undo_step.in_partial_mode()


def steps() -> tuple[int, int]:
    """The place in Blender's history, and how many steps it has."""
    before, after = sculpt_steps.steps()
    return len(before) - 1, len(before) + len(after)


def scene() -> Scene:
    """All fields."""
    bpy.context.view_layer.update()
    return {ob.name: seen(ob) for ob in bpy.data.objects if ob.neural_sculpt.revision}


def seen(ob: Object) -> Seen:
    """One field; reports come when they come."""
    weights, base, listed, revision, _, _, place = harness.state(ob)
    shown, proxy = positions(ob), brush_results.proxies.get(ob.session_uid)
    is_there = proxy and proxy.half_way and proxy.step == sculpt_steps.active()
    kept = proxy.positions if is_there else shown
    return Seen((weights, base, listed, revision, place), kept, shown)


def positions(ob: Object) -> np.ndarray:
    """The vertices (V, 3) of its mesh without a preview."""
    if ob.data.is_editmode:
        return np.array([vertex.co[:] for vertex in bmesh.from_edit_mesh(ob.data).verts])
    return preview_attributes.true_positions(ob.data)


def close(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether positions are the same but for rounding."""
    return bool(np.allclose(one, two, rtol=1e-6, atol=CLOSE))


def same(now: Scene, possible: list[Scene], what: str) -> None:
    """AssertionError when a scene is none of those that are possible."""
    if any(now.keys() == other.keys() and not differing(now, other) for other in possible):
        return
    other = possible[-1]
    assert now.keys() == other.keys(), f"{now.keys() ^ other.keys()} {what}"
    raise AssertionError(f"{', '.join(differing(now, other))} {what}")


def differing(now: Scene, other: Scene) -> list[str]:
    """Names of fields that are not the same, and in what."""
    parts = ("weights", "base", "history", "revision", "place")
    found = []
    for name, one in now.items():
        two = other[name]
        if not one.same(two):
            pairs = zip(parts, one.made_of, two.made_of, strict=True)
            how = [part for part, a, b in pairs if a != b] or ["mesh"]
            found.append(f"{name} ({', '.join(how)})")
    return found


def check_sum(ob: Object) -> None:
    """A mesh that no other tool changed is the sum of its field, unless it waits to be renewed."""
    assert ob.data.name in bpy.data.meshes
    if ob.data.is_editmode or native_edits.edited(ob) or proxy_mesh.STRETCHED in ob.data:
        return
    group = ob.neural_sculpt
    total = np.frombuffer(group.base_weights, "<i4")
    for item in group.strokes:
        if not item.muted:
            layer = np.frombuffer(item.layer, "<i4")
            assert layer.shape == total.shape, f"{item.name} has no layer"
            total = total + np.rint(item.strength * layer).astype("<i4")
    if group.weights:
        total = np.frombuffer(group.weights, "<i4")
    found = preview_attributes.true_positions(ob.data)[:-1].ravel()
    assert np.array_equal(found, total), f"{ob.name}: its mesh is not the sum of its history"


def comes_in(before: Seen, name: str) -> bool:
    """Whether brush strokes that had their results got into a history."""
    ob = bpy.data.objects.get(name)
    added = () if ob is None else [*ob.neural_sculpt.strokes][len(before.made_of[2]) :]
    return any(item.context == "absorbed" for item in added)


def check_native(before: Scene, names: list[str]) -> None:
    """What Blender's own tools made of fields is as it was."""
    for name in names:
        if (ob := bpy.data.objects.get(name)) is not None:
            kept, found = before[name].shown, positions(ob)
            assert kept.shape == found.shape, f"the native edit of {name} is gone"
            assert close(kept, found), f"the native edit of {name} is gone"


def check_strokes(ended: list) -> None:
    """Strokes whose jobs have ended are listed, but those that became part of a base."""
    for job in ended:
        ob = properties.find(job.target)
        if job.strokes and job.status != "cancelled" and ob is not None:
            listed = [item.name for item in ob.neural_sculpt.strokes]
            flattened = any(other.kind == "apply_to_base" for other in ended)
            assert flattened or job.label in listed, f"{job.label} is lost: {job.message}"
