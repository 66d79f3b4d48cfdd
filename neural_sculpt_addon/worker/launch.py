# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that another Python is started with: `python -I -u launch.py MODULE ARGUMENT`.

MODULE is `server.server`, the worker, with its device, or `install.installation`, with the folder
to install into.

The package is imported as `neural_sculpt_addon`, whatever its folder is called: an installed
extension's folder has the name of its id. It is found by this file's path and not by `sys.path`, so
that nothing beside it, other extensions above all, can be imported by mistake.
"""

import importlib
import importlib.util
import sys
from pathlib import Path

PACKAGE = "neural_sculpt_addon"


def main() -> None:
    """Import the package and run the `main` of the module."""
    folder = Path(__file__).resolve().parent.parent
    spec = importlib.util.spec_from_file_location(
        PACKAGE, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None and spec.loader is not None
    package = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = package
    spec.loader.exec_module(package)
    importlib.import_module(f"{PACKAGE}.worker.runtime").set_up()
    name, argument = sys.argv[1:]
    importlib.import_module(f"{PACKAGE}.worker.{name}").main(argument)


if __name__ == "__main__":
    main()
