# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors: the two ways in which work ends without a result."""

from .text import Text


class SculptError(Exception):
    """A failure the artist can act upon: one or two sentences, what happened and what to do."""

    def __init__(self, template: str, *arguments: object) -> None:
        """The sentences: a template and what fills its {}, as `Text` takes them."""
        self.text = Text(template, *arguments)
        super().__init__(self.text)


class Cancelled(Exception):  # noqa: N818 - the outcome of a request, not an error
    """The artist cancelled the work; nothing was changed."""
