# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks: `python3 scripts/benchmark.py NAME` runs the module of that name.

    edit, session, fuzz, stroke, fit, proxy, refine, interface, live
                            one benchmark each
    scored_cases, random_strokes
                            strokes
    awkward_meshes, damaged_meshes
                            meshes for `fit`
    window_benchmark        what `interface` and `live` share
    timed_worker            the worker of `stroke`

Benchmarks import NumPy and torch within their functions.
"""
