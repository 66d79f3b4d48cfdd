# SPDX-License-Identifier: GPL-3.0-or-later
"""Reliability: attacks on the product, and what they have in common.

    attacks/        one attack each, which stress.py finds by its file
    attacked/       what attacks start inside Blender
    batches         random sequences in Blenders of their own, read from what they print
    mutations, disk, fork_server
                    faults: damaged bytes, a full disk, workers that die
    document        docs/reliability.md

Modules import NumPy, torch and bpy within their functions.
"""
