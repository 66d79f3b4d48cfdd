# SPDX-License-Identifier: GPL-3.0-or-later
"""What constants change: `python3 scripts/sensitivity.py SUBJECT` measures those of a subject.

    edits                      strokes by the local solver
    network                    strokes by the solver on the network's weights
    absorption                 what Blender's brushes do, and strokes that reshape
    fit_meshes, fit_networks,  a fit: what a mesh bounds, what a network learns, detail, and
    fit_details, fit_repairs   what takes strays away
    refinement                 the proxy and its refinement
    subject, constants, table  what they have in common
    fits                       what the last three of fits have in common
    strokes, shapes, solids    held out: no benchmark has them
    left_out                   numbers that no table has, and why

A subject has one module with its cases, its constants and its measures, as SUBJECT. They need the
worker's environment.
"""
