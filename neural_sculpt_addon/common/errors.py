# SPDX-License-Identifier: GPL-3.0-or-later
"""Errors: the two ways in which work ends without a result."""


class SculptError(Exception):
    """A failure the artist can act upon: one or two sentences, what happened and what to do."""


class Cancelled(Exception):  # noqa: N818 - the outcome of a request, not an error
    """The artist cancelled the work; nothing was changed."""
