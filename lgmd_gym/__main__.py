"""`python -m lgmd_gym` is the `lgmd-gym` command."""

from lgmd_gym.cli.main import main

if __name__ == "__main__":
    main()
