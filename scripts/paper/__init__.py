# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's evaluation, repeated with this project's code: `python3 scripts/paper.py`.

    shapes, edits         what is sculpted: fields, and strokes on them
    methods, three_dns, mesh_edit
                          who sculpts it: each method behind one interface, ours and baselines
    surface, ground       what comes out, and what should have
    chamfer, measures     how far apart these are
    table1 ... beyond     rows of one table each; main_table, of those, for the README
    figures, families, frame, sequence, sheet
                          pictures, and how they are put on a page
    settings, work, about, table
                          the run: its two sizes, finished rows, the machine, Markdown and CSV

Baselines import from the product, never the other way. Lengths are in model space.
"""
