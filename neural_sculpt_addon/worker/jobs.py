# SPDX-License-Identifier: GPL-3.0-or-later
"""What the worker can do: one handler per kind of job, fields and arrays in, fields and arrays out.

Torch and the rest are imported by the job that needs them first, or by `warm_up`.
"""

from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ..stroke.errors import SculptError
from ..stroke.progress import Progress, sub_progress
from ..stroke.stroke import Stroke
from .payload import (
    Handler,
    Payload,
    Task,
    model_arrays,
    proxy_arrays,
    read,
    read_array,
    read_network,
)
from .protocol import JobKind
from .replay import Replays

if TYPE_CHECKING:
    import torch

    from ..field.edit import Edit
    from ..field.fit import Fit
    from ..field.network import Siren
    from ..field.prepare import Preparation
    from ..field.proxy import Proxy

    Prepare = Callable[[Progress], Preparation]

PREPARATIONS = 16
"""Revisions whose preparations are kept, some 10 MB each and two of each stroke: a few objects and
steps of undo."""

PREVIEW_CELLS = 64
"""Of a proxy that is only looked at for a moment."""

QUICK_AT = 0.34
"""Progress of an edit of one stroke when its quick result is there."""


def warm_up() -> None:
    """Import what the jobs need, so that the first one need not wait for it."""
    from ..field import absorb, checkpoint, edit, fit, prepare, primitives, proxy  # noqa: F401


class Jobs:
    """The handlers and what they remember: preparations by revision, and the proxy last shown."""

    def __init__(self, device: "torch.device") -> None:
        """Nothing is prepared yet; `device` is what strokes are sculpted on."""
        self._device = device
        self._preparations: OrderedDict[str, Preparation | Prepare] = OrderedDict()
        self._replays = Replays(device)
        self._shown: tuple[str, Proxy] | None = None

    def handlers(self) -> dict[JobKind, Handler]:
        """The handler of each kind of job."""
        return {
            JobKind.EDIT: self.edit,
            JobKind.REPLAY: self.replay,
            JobKind.MESH: self.mesh,
            JobKind.FIT: self.fit,
            JobKind.ABSORB: self.absorb,
            JobKind.LOAD: self.load,
            JobKind.SAVE: self.save,
            JobKind.SAMPLE: self.sample,
            JobKind.PREPARE: self.prepare,
        }

    def edit(self, job: Task, progress: Progress) -> Payload:
        """strokes, solver, epochs, resolution, revision <field> -> reports <field, proxy>.

        The result's revision is `result_revision`. With a `quick_revision`, the quick result comes
        ahead in the same form. What is known of both is kept for the strokes to come. With a
        `result_state`, replays need not repeat the edit.
        """
        from ..field.edit import Quick, edit

        def send_quick(result: Quick) -> None:
            revision, follows = read(job, "quick_revision", str), read(job, "revision", str)
            share = sub_progress(progress, QUICK_AT, QUICK_AT)
            arrays = self._edited(result.network, result.proxy, revision, job, share, follows)
            job.quick(Payload({"revision": revision, "reports": list(result.reports)}, arrays))
            self._keep(revision, result.remember)
            self._known(revision, share)  # the next stroke waits for it

        result = edit(
            self._network(job),
            [Stroke.from_json(stroke) for stroke in read(job, "strokes", list)],
            solver=read(job, "solver", str),
            epochs=job.fields.get("epochs"),
            preparation=self._prepared(job, sub_progress(progress, 0.0, 0.1)),
            quick=send_quick if "quick_revision" in job.fields else None,
            progress=sub_progress(progress, 0.1, 0.9),
        )
        if "result_state" in job.fields:
            self._replays.remember(read(job, "result_state", str), result)
        return self._answer(result, job, progress)

    def replay(self, job: Task, progress: Progress) -> Payload:
        """strokes, states, solver, resolution <base field> -> revision, reports <field, proxy>."""
        result = self._replays.run(
            read_array(job, "field").tobytes(),
            [Stroke.from_json(stroke) for stroke in read(job, "strokes", list)],
            read(job, "states", list),
            read(job, "solver", str),
            sub_progress(progress, 0.0, 0.9),
        )
        return self._answer(result, job, progress)

    def mesh(self, job: Payload, progress: Progress) -> Payload:
        """resolution <field> -> <proxy>."""
        return Payload({}, proxy_arrays(_extract(self._network(job), job, progress)))

    def fit(self, job: Task, progress: Progress) -> Payload:
        """primitive, or preset, width, thickness, seed <mesh> -> scale, center, report <model>.

        Without a width the mesh decides; without a thickness sheets are refused. With `preview`,
        scale, center, report <proxy> come now and then.
        """
        from ..field.fit import Fit, fit_mesh
        from ..field.primitives import primitive
        from ..field.proxy import extract

        if "primitive" in job.fields:
            result = Fit(primitive(read(job, "primitive", str)), 1.0, (0.0, 0.0, 0.0), {})
        else:

            def show(fit: "Fit") -> None:
                with suppress(SculptError):  # there is no surface yet
                    proxy = extract(fit.network, PREVIEW_CELLS)
                    job.preview(Payload(_place(fit), proxy_arrays(proxy)))

            result = fit_mesh(
                read_array(job, "vertices"),
                read_array(job, "triangles"),
                preset=read(job, "preset", str),
                width=job.fields.get("width"),
                thickness=job.fields.get("thickness"),
                seed=read(job, "seed", int),
                progress=sub_progress(progress, 0.0, 0.9),
                preview=show if job.fields.get("preview") else lambda _: None,
                enough=job.enough,
            )
        return Payload(
            _place(result), _model(result.network, job, sub_progress(progress, 0.9, 1.0))
        )

    def absorb(self, job: Payload, progress: Progress) -> Payload:
        """resolution, result_revision <field, proxy as sculpted> -> revision, reports <model>."""
        from ..field.absorb import absorb

        vertices, triangles = read_array(job, "vertices"), read_array(job, "triangles")
        result = absorb(
            read_network(job), vertices, triangles, progress=sub_progress(progress, 0.0, 0.9)
        )
        arrays = _model(result.network, job, sub_progress(progress, 0.9, 1.0))
        fields = {"revision": read(job, "result_revision", str), "reports": [result.report]}
        return Payload(fields, arrays)

    def load(self, job: Payload, progress: Progress) -> Payload:
        """path, resolution -> widths <field, proxy>."""
        from ..field.checkpoint import load

        network = load(read(job, "path", str))
        return Payload({"widths": list(network.widths)}, _model(network, job, progress))

    def save(self, job: Payload, progress: Progress) -> Payload:
        """path <field> -> path."""
        from ..field.checkpoint import save

        path = read(job, "path", str)
        save(read_network(job), path)
        return Payload({"path": path})

    def sample(self, job: Payload, progress: Progress) -> Payload:
        """resolution <field> -> <band>, see field.volume."""
        from ..field.volume import sample_band

        band = sample_band(self._network(job), read(job, "resolution", int), progress)
        return Payload({}, {"band": band})

    def prepare(self, job: Payload, progress: Progress) -> Payload:
        """revision <field> -> nothing; the next edit of that revision starts at once."""
        self._prepared(job, progress)
        return Payload()

    def _network(self, job: Payload) -> "Siren":
        return read_network(job).to(self._device)

    def _prepared(self, job: Payload, progress: Progress) -> "Preparation":
        """The preparation of the job's revision, made unless it is remembered."""
        from ..field.prepare import prepare

        revision = read(job, "revision", str)
        if revision not in self._preparations:
            network = self._network(job)
            self._keep(revision, lambda progress: prepare(network, progress=progress))
        return self._known(revision, progress)

    def _keep(self, revision: str, preparation: "Preparation | Prepare") -> None:
        """Remember it, or how to make it, and forget the one that was not needed for longest."""
        self._preparations[revision] = preparation
        self._preparations.move_to_end(revision)
        if len(self._preparations) > PREPARATIONS:
            self._preparations.popitem(last=False)

    def _known(self, revision: str, progress: Progress) -> "Preparation":
        """The preparation of a revision; one that a cancel left unmade is made now."""
        known = self._preparations[revision]
        made = known(progress) if callable(known) else known
        self._keep(revision, made)
        return made

    def _answer(self, result: "Edit", job: Payload, progress: Progress) -> Payload:
        """The final result of an edit, whose preparation is kept."""
        revision, share = read(job, "result_revision", str), sub_progress(progress, 0.9, 1.0)
        known = result.preparation
        self._keep(revision, known)
        arrays = self._edited(known.network, known.proxy, revision, job, share)
        return Payload({"revision": revision, "reports": list(result.reports)}, arrays)

    def _edited(
        self,
        network: "Siren",
        proxy: "Proxy",
        revision: str,
        job: Payload,
        progress: Progress,
        follows: str = "",
    ) -> dict[str, np.ndarray]:
        """An edited field and its proxy, which is known already at the usual resolution.

        At another one it is that of the revision it `follows`, updated, when that was shown last.
        """
        from ..field.prepare import CELLS
        from ..field.proxy import extract, update

        cells = read(job, "resolution", int)
        if cells != CELLS:
            shown, last = self._shown or ("", proxy)
            if shown == follows and last.active.cells == cells:
                proxy = update(last, network, progress)
            else:
                proxy = extract(network, cells, progress)
            self._shown = revision, proxy
        return model_arrays(network, proxy)


def _model(network: "Siren", job: Payload, progress: Progress) -> dict[str, np.ndarray]:
    """A field and its proxy as arrays."""
    return model_arrays(network, _extract(network, job, progress))


def _extract(network: "Siren", job: Payload, progress: Progress) -> "Proxy":
    from ..field.proxy import extract

    return extract(network, read(job, "resolution", int), progress)


def _place(fit: "Fit") -> dict[str, Any]:
    """Where a fitted field belongs, and how good it is."""
    return {"scale": fit.scale, "center": list(fit.center), "report": fit.report}
