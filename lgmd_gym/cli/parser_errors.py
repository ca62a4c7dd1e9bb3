"""Errors of the argument parser as one line."""

import ast
import re
from collections.abc import Callable

from lgmd_gym.errors import unknown_name


def one_line(box: str, command: str) -> str:
    """Return the message in the parser's box, with the nearest option of the command if the box has one.

    Args:
        box: Output of the parser.
        command: Name of the command.
    """
    lines = [line.strip("│╭╰╮╯|+ ") for line in re.sub(r"\x1b\[[0-9;]*m", "", box).splitlines()[1:]]
    text = " ".join("──" if re.fullmatch("[─-]+", line) else line for line in lines if line)
    text = re.sub(r" \(applied to [^)]*\)| Arguments are applied .* matter\.", "", text)
    message = re.split(r" ?──", text.removeprefix("── "))[0]
    for pattern, rewrite in _MESSAGES.items():
        if match := re.match(pattern, message):
            message = rewrite(match)
            break
    for suggestion in text.partition("Perhaps you meant:")[2].split(" --help"):
        option = re.search(rf"--[a-z-]+(?=.* in lgmd-gym {command}$)", suggestion)
        if option:
            return f"{message}; did you mean {option[0]}?"
    return message if message.endswith("?") else f"{message}; see lgmd-gym {command} --help"


def _unknown_choice(match: re.Match[str]) -> str:
    return str(unknown_name(f"value of {match[2]}", match[1], ast.literal_eval(match[3])))


# Messages of the parser and how to say them.
_MESSAGES: dict[str, Callable[[re.Match[str]], str]] = {
    r"Error parsing (--[a-z-]+):.*?('.*?')": lambda match: f"{match[1]} has the invalid value {match[2]}",
    r"invalid choice '(.*?)' for argument '(.*?)'\. Expected one of (\(.*?\))": _unknown_choice,
    r"Missing from lgmd-gym (\S+): (\S+)": lambda match: f"{match[1]} requires {match[2]}",
    r"Missing value for argument '(.*?)'": lambda match: f"{match[1]} requires a value",
    r"Unrecognized (?:or misplaced )?options: ([^,]*).*": lambda match: f"unknown option {match[1]}",
}
