"""The command ``phiw``, in this process: ``python -m phiw``."""

import signal
import sys


def main() -> None:
    """Does what the command line says and ends with its exit status."""
    # The command writes its results as a whole or not at all: Ctrl-C may end it at any time, and so may a
    # reader that has seen enough (`| head`).
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from ._phiw import command

    sys.exit(command(["phiw", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
