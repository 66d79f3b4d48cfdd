# SPDX-License-Identifier: GPL-3.0-or-later
"""What the mouse and the keys do while a stroke is drawn: a state machine. No bpy here.

    DRAWING   the button is held and points are recorded; release -> DONE, or EDITING to adjust
    EDITING   a press adds a control point or takes one to drag it; Backspace removes, Enter -> DONE
    DONE, CANCELLED   the end

A press on the surface begins it: with DRAWING, or with EDITING when the points are clicked. A
stroke that was sculpted before begins with EDITING.

Points are in model space, the mouse is in pixels of the window.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Protocol

from .recorder import Mouse, Point, Stabilizer, StrokeRecorder

GRAB = 14.0  # pixels; a control point this near to the mouse is meant
SIMPLIFIED = 0.4  # of the spacing: how far simplifying may move the line


class SeenSurface(Protocol):
    """The surface as it is seen on the screen."""

    def cast(self, mouse: Mouse) -> Point | None:
        """The point of the surface under the mouse."""
        ...

    def project(self, point: Point) -> Mouse | None:
        """Where a point is seen; None when it is behind the viewer."""
        ...


class Nowhere:
    """The surface for a mouse beside all views."""

    def cast(self, mouse: Mouse) -> None:
        """Nothing is hit."""

    def project(self, point: Point) -> None:
        """Nothing is seen."""


class Phase(StrEnum):
    """Where a drawing is between its beginning and its end."""

    DRAWING = "drawing"
    EDITING = "editing"
    DONE = "done"
    CANCELLED = "cancelled"


@dataclass(frozen=True)
class Habits:
    """How the artist draws.

    spacing: between the control points of a freehand stroke, model space
    rope:    of the stabilizer, pixels
    clicks:  control points are clicked, not drawn
    adjust:  a freehand stroke, too, can be edited until it is confirmed
    """

    spacing: float
    rope: float = 0.0
    clicks: bool = False
    adjust: bool = False


class Drawing:
    """One stroke from its first point to its confirmation."""

    def __init__(self, habits: Habits, hit: Point, mouse: Mouse, pressure: float = 1.0) -> None:
        """The button went down on the surface at `hit`."""
        self.habits = habits
        self.phase = Phase.EDITING if habits.clicks else Phase.DRAWING
        self.line = StrokeRecorder(habits.spacing, [hit], [pressure])
        self.chosen: int | None = 0 if habits.clicks else None
        """The control point under the mouse, or last touched."""
        self.dragging = habits.clicks
        self._pen = Stabilizer(habits.rope, mouse)
        self._under: Point | None = hit

    @classmethod
    def again(
        cls, habits: Habits, points: Sequence[Point], pressures: Sequence[float]
    ) -> "Drawing":
        """A stroke through points, which can be edited: those that are not needed are left out."""
        drawing = cls(replace(habits, clicks=True), points[0], (0.0, 0.0))
        drawing.line.points, drawing.line.pressures = [*points], [*pressures]
        drawing.line.simplify(SIMPLIFIED * habits.spacing)
        drawing.chosen, drawing.dragging = None, False
        return drawing

    @property
    def so_far(self) -> StrokeRecorder:
        """The line as it would be if the pen were lifted now."""
        if self.phase is not Phase.DRAWING:
            return self.line
        line = replace(self.line, points=[*self.line.points], pressures=[*self.line.pressures])
        line.finish(self._under)
        return line

    def press(self, surface: SeenSurface, mouse: Mouse, pressure: float = 1.0) -> None:
        """The button went down again: on a control point, on the surface, or beside both."""
        if self.phase is not Phase.EDITING:
            return
        self.chosen = self._near(surface, mouse)
        if self.chosen is None and (hit := surface.cast(mouse)) is not None:
            self.line.keep(hit, pressure)
            self.chosen = len(self.line.points) - 1
        self.dragging = self.chosen is not None

    def move(self, surface: SeenSurface, mouse: Mouse, pressure: float = 1.0) -> None:
        """The mouse moved."""
        if self.phase is Phase.DRAWING:
            self._under = surface.cast(self._pen.pull(mouse))
            if self._under is not None:
                self.line.add(self._under, pressure)
        elif self.phase is Phase.EDITING:
            if not self.dragging:
                self.chosen = self._near(surface, mouse)
            elif self.chosen is not None and (hit := surface.cast(mouse)) is not None:
                self.line.points[self.chosen] = hit

    def release(self, surface: SeenSurface, mouse: Mouse) -> None:
        """The button went up."""
        self.dragging = False
        if self.phase is not Phase.DRAWING:
            return
        self.line.finish(surface.cast(self._pen.pull(mouse)))
        if self.habits.adjust and len(self.line.points) > 1:
            self.line.simplify(SIMPLIFIED * self.habits.spacing)
            self.phase = Phase.EDITING
        else:
            self.phase = Phase.DONE

    def remove(self) -> None:
        """Drop the control point under the mouse, or else the last; without any it is over."""
        if self.phase is Phase.EDITING:
            self.line.remove(-1 if self.chosen is None else self.chosen)
            self.chosen, self.dragging = None, False
            if not self.line.points:
                self.phase = Phase.CANCELLED

    def confirm(self) -> None:
        """Sculpt the stroke as it is."""
        if self.phase is Phase.EDITING:
            self.phase = Phase.DONE

    def cancel(self) -> None:
        """Forget the stroke."""
        self.phase = Phase.CANCELLED

    def _near(self, surface: SeenSurface, mouse: Mouse) -> int | None:
        """The control point that the mouse means."""
        best, distance = None, GRAB
        for index, point in enumerate(self.line.points):
            place = surface.project(point)
            if place is not None and math.dist(place, mouse) <= distance:
                best, distance = index, math.dist(place, mouse)
        return best
