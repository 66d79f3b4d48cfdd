# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's evaluation, repeated with this project's code: `python3 scripts/paper.py`.

    shapes, edits   what is sculpted: fields, and strokes on them
    methods/        who sculpts it: each method behind one interface, ours and baselines
    measures/       what comes out, and what should have, how far apart these are, and times
    tables/         rows of one table each; main_table, of those, for the README
    figures/        pictures
    run, settings, work, about
                    the run: its two sizes, finished rows, the machine

Baselines import from the product, never the other way. Lengths are in model space.
"""
