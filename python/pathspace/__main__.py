"""The command: `python -m pathspace` is `pathspace`."""

import importlib
import os
import signal
import sys

# Module of a plug-in crate whose integrators the command has.
MODULE = "PATHSPACE_MODULE"


def main() -> None:
    """Runs the command with the arguments of this process."""
    # Ctrl-C is the command's own business: it keeps what is rendered.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    engine = importlib.import_module(os.environ.get(MODULE, "pathspace._native"))
    sys.exit(engine.command(engine.integrators, ["pathspace", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
