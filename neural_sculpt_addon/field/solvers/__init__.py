# SPDX-License-Identifier: GPL-3.0-or-later
"""Edit solvers: a problem in, a network out.

A solver is a function `solve(problem, progress) -> Siren`; one that continues from its result is
`refine(problem, network, progress) -> Refined`. They draw random numbers only from the problem's
seed, leave the given networks as they are and may raise Cancelled through `progress`.
"""

from collections.abc import Callable
from typing import NamedTuple

from ...stroke.progress import Progress
from ..network import Siren
from ..problem import Problem
from ..proxy import Rough


class Refined(NamedTuple):
    """A network and its surface on CELLS cells per axis, which was searched for islands."""

    network: Siren
    surface: Rough


Solve = Callable[[Problem, Progress], Siren]
Refine = Callable[[Problem, Siren, Progress], Refined]
