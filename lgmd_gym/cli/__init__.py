"""The `lgmd-gym` command line: option dataclasses, and one module per command."""
