# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers of the field's rooms that no table has, by the reason.

There is nothing to be traded by half or twice of them, or what they trade is not what tables
measure.
"""

WHY = {
    "bounds of memory, time and files: more is allowed, or refused": {
        "fit.fit": ("LARGEST_LATTICE",),
        "fit.fit_detail": ("MOST_SAMPLES",),
        "fit.mesh_cleanup": ("MOST_FACES", "CLUSTERS", "COARSER"),
        "fit.mesh_sew": ("MOST_NEAR",),
        "fit.consolidate": ("NARROWEST", "WIDEST"),
        "fit.fit_report": ("MOST_PIECES",),
        "mesh.extraction.cells": ("WIDEST_LEVEL",),
        "mesh.glb_file": ("MOST_CORNERS", "OVERLAP"),
        "mesh.mesh_file": ("LARGEST_FILE",),
        "mesh.ply_file": ("HEADER",),
        "mesh.polygons": ("MOST_CORNERS",),
        "mesh.proxy": ("FEWEST_CELLS", "MOST_CELLS"),
        "mesh.refinement.subdivide": ("DIVISIONS",),
        "problem.placement": ("MOST_PATH_POINTS",),
        "problem.problem": ("MOST_UNDER",),
        "problem.tube": ("LONGEST_CELL", "MOST_CAP_ROWS"),
        "solve.resolution": ("REFUSED_BELOW", "MOST_ROWS", "MOST_NODES"),
        "edit.boolean": ("BLEND_CELLS", "BLEND_FINEST"),
        "edit.layers": ("REMEMBERED",),
    },
    "how work is divided: what comes does not depend on it, or only in its last bits": {
        "fit.fit_detail": ("BATCH", "AT_ONCE"),
        "fit.mesh_cut": ("FEW", "TICK"),
        "fit.mesh_distance": ("BATCH",),
        "fit.mesh_sew": ("AT_ONCE",),
        "fit.mesh_union": ("BATCH",),
        "mesh.extraction.cells": ("BATCH",),
        "mesh.polygons": ("BLOCK",),
        "mesh.proxy": ("BATCH",),
        "mesh.volume": ("BAND", "SLABS"),
        "problem.fold": ("WOUND",),
        "mesh.morton_order": ("ORDER_CELLS",),
        "solve.gauss_newton": ("BLOCK",),
        "solve.paper": ("BATCH",),
        "solve.spline_system": ("PIECE",),
    },
    "numbers that follow from the mathematics or from float32": {
        "edit.reshape": ("STILL",),
        "fit.mesh_cleanup": ("SMALLEST_AREA",),
        "fit.mesh_orient": ("EVEN",),
        "fit.mesh_sew": ("SEAM",),
        "fit.mesh_union": ("ALIKE",),
        "fit.mesh_winding": ("INWARD", "SAME_PLACE", "SAME_VOLUME"),
        "fit.strays": ("SHORT_OF_MESH",),
        "mesh.ear_clipping": ("ROUNDING",),
        "mesh.extraction.march": ("TRIANGLES_PER_CELL",),
        "mesh.polygons": ("FACES_AWAY",),
        "mesh.proxy": ("FLAT", "ROUNDING"),
        "problem.fold": ("PRECISION", "BOUND", "ORDER"),
        "problem.folded": ("BURIED",),
        "projection": ("SMALLEST_GRADIENT",),
        "solve.local": ("LEAST_MISSED",),
        "solve.resolution": ("SAMPLES",),
    },
    "what is asked for, and what the artist is told: another value is another wish": {
        "edit.fairing": ("SMOOTHED", "SPREAD", "PINCHED"),
        "edit.patch": ("SHARP",),
        "fit.mesh_cleanup": ("LONGEST_SIDE", "SMALLER"),
        "fit.schedule": ("SETTLING", "PREVIEW_SECONDS", "SMOOTHING"),
        "mesh.nearest": ("LENGTHENED", "LONGER", "ASIDE", "OFF"),
        "problem.placement": (
            *("PATH_POINTS", "PER_RADIUS", "MOST_OFF", "OFF_SURFACE", "LARGEST_GAP", "SPANNED"),
        ),
        "problem.tube": ("TORN", "INNER_RIM"),
    },
    "how results are measured and reported": {
        "edit.gone": ("CELLS", "FINE_CELLS", "NEAR"),
        "edit.lost": ("LOST", "UNTOLD"),
        "fit.consolidate": ("COMPARED_CELLS", "MEASURE_SAMPLES"),
        "fit.fit_report": (
            *("MEASURED_SAMPLES", "VOLUME_SAMPLES", "SIGN_CLEARANCE", "SAMPLES_OF_PIECE"),
            *("LOST_OFF", "WORST_PLACES", "APART", "SOME", "MUCH"),
        ),
        "problem.copies": ("MEASURED_RADII",),
        "problem.metrics": (
            *("FAR", "CREASE", "FLOOR", "TOLERANCE", "OF_HEIGHT", "GAIN", "TURNED"),
            *("ALL_BUT_PARALLEL", "FRESH", "CHAMFER_SAMPLES"),
        ),
        "problem.reverse": ("MEASURED", "GAP", "GAP_REACH", "ACROSS", "AROUND"),
        "problem.tube": ("ROWS", "COLUMNS", "FEWEST_COLUMNS"),
    },
    "what is prepared once for all strokes on a field: no case prepares anew": {
        "problem.prepare": ("CELLS", "SURFACE_SAMPLES", "SHELL", "BOX_SAMPLES", "SAFE", "SEED"),
    },
    "methods of others, as these published them": {
        "fit.fit_paper": ("SURFACE", "NORMAL", "EIKONAL", "BOUNDARY", "SHARPNESS"),
        "solve.paper": ("PRESERVE_SAMPLES", "BOX_SAMPLES", "LEARNING_RATE", "HUBER"),
    },
    "cases that no table has yet: wide networks, consolidation, islands at old places": {
        "fit.fit": ("WIDE_LAYER",),
        "fit.consolidate": ("NEAR_SHARE", "AROUND_SHARE"),
        "mesh.pieces": ("AT_OLD_SURFACE",),
        "solve.loose": ("SMALLEST",),
    },
}
