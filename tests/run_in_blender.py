# SPDX-License-Identifier: GPL-3.0-or-later
"""Run tests/blender in a Blender, against the extension as an artist installs it.

    blender --background --python tests/run_in_blender.py -- [EXTENSION.zip] [--short] [-k PATTERN]
    python tests/run_in_blender.py -- [EXTENSION.zip] [--short] [-k PATTERN]   (a Python with bpy)

Without a zip, the sources are packed as they are. --short leaves out the tests marked `long`, and
-k may be given more than once. The extension is installed into a user folder of its own
that is gone afterwards. The worker is the Python that NEURAL_SCULPT_PYTHON names. The last line
reads `Blender 5.2.2: 23 passed, 0 failed, 0 skipped`, and the exit code says whether none failed.
"""

import faulthandler
import os
import subprocess
import sys
import tempfile
import traceback
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from suite import EXTENSION, make_importable, pack, tests_of

USER_FOLDER = "BLENDER_USER_RESOURCES"


def main() -> int:
    """Install, test, remove; the exit code."""
    extension, patterns, short = _arguments()
    if "bpy" in sys.modules and USER_FOLDER not in os.environ:
        return _again_with_own_folder()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        os.environ.setdefault(USER_FOLDER, folder)  # before bpy is imported
        return _test(extension or pack(Path(folder)), patterns, short)


def _arguments() -> tuple[Path | None, list[str], bool]:
    given = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    if "bpy" in sys.modules and "--" not in sys.argv:
        given = []  # they are Blender's
    patterns = [given[i + 1] for i, word in enumerate(given[:-1]) if word == "-k"]
    zips = [Path(word).resolve() for word in given if word.endswith(".zip")]
    return (zips[0] if zips else None), patterns, "--short" in given


def _again_with_own_folder() -> int:
    """A Blender that is running already has read the artist's settings: start another one."""
    import bpy

    given = sys.argv[sys.argv.index("--") :] if "--" in sys.argv else []
    command = [bpy.app.binary_path, "--background", "--factory-startup", "--python", __file__]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        environment = {**os.environ, USER_FOLDER: folder}
        return subprocess.run([*command, *given], env=environment, check=False).returncode


def _test(extension: Path, patterns: list[str], short: bool) -> int:
    import bpy

    bpy.ops.extensions.package_install_files(
        filepath=str(extension), repo="user_default", enable_on_install=True
    )
    if EXTENSION not in sys.modules:
        print(f"{extension.name} was not enabled.")
        return 1
    make_importable("blender")
    from durations import TimedResult
    from harness import SteeredCase

    tests = tests_of("blender", patterns, short)
    tests.sort(key=lambda test: isinstance(test, SteeredCase))  # or the worker would start often
    runner = unittest.TextTestRunner(sys.stdout, verbosity=2, resultclass=TimedResult)
    result = runner.run(unittest.TestSuite(tests))
    print("\n".join(result.durations.slowest()))
    bpy.ops.preferences.addon_disable(module=EXTENSION)

    wrong = [test for test, _ in (*result.failures, *result.errors)] + result.unexpectedSuccesses
    failed = len({getattr(test, "test_case", test) for test in wrong})  # not each of its subtests
    skipped = len(result.skipped)
    passed = result.testsRun - failed - skipped
    version = ".".join(map(str, bpy.app.version))
    print(f"Blender {version}: {passed} passed, {failed} failed, {skipped} skipped")
    return 0 if passed and not failed else 1


if __name__ == "__main__":
    code = 1
    faulthandler.enable()  # a Blender that crashes says in which test
    try:
        code = main()
    finally:  # some Blenders crash or hang in a regular exit of their Python module
        if sys.exc_info()[0]:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
