"""The command `lgmd-gym`, also `python -m lgmd_gym`."""

import os

from lgmd_gym.processes.signals import exit_on_signals


def main() -> None:
    """Run the command line and exit; a signal during the slow imports ends the process with one line."""
    open_standard_streams()
    exit_on_signals()
    from lgmd_gym.cli.main import main as run_command_line

    run_command_line()


def open_standard_streams() -> None:
    """Open the null device in place of a standard stream that was closed before the start.

    Otherwise the next file gets its number, and worker processes, which inherit only streams, do not start.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # It is the lowest free number, because those below are open.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


if __name__ == "__main__":
    main()
