"""The command `lgmd-gym`, also `python -m lgmd_gym`."""

from lgmd_gym.processes.signals import exit_on_signals


def main() -> None:
    """Run the command line and exit; a signal during the slow imports ends the process with one line."""
    exit_on_signals()
    from lgmd_gym.cli.main import main as run_command_line

    run_command_line()


if __name__ == "__main__":
    main()
