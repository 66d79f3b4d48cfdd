# SPDX-License-Identifier: GPL-3.0-or-later
"""Edit solvers: a problem in, a layer of detail or another network out.

A solver is a function `solve(problem, progress)`. It draws random numbers only from the problem's
seed, leaves the given field as it is and may raise Cancelled through `progress`.
"""
