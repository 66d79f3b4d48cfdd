# SPDX-License-Identifier: GPL-3.0-or-later
"""What runs inside Blender: of the demo, the pictures and the benchmarks.

    start                    the entry script, which starts a module; START is its path
    simulated_input          mouse, keys and pictures of a window, for tests/window, too
    extension, call_times    the installed extension, and how long its calls take
    demo, demo_strokes       of demo.py; studio, light and camera, serves others, too
    sample, gallery, tour    of make_sample.py, gallery.py, tour.py
    interface, live, stroke  of the benchmarks of these names

What attacks start is in reliability/attacked/.
"""

from pathlib import Path

START = Path(__file__).with_name("start.py")
