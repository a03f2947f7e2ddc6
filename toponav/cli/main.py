"""The `toponav` command: finds the command, runs it, turns errors into exit statuses."""

import importlib
import sys
from collections.abc import Callable, Sequence
from typing import Any

import tyro

import toponav
from toponav.core.errors import InputError, did_you_mean
from toponav.core.files import os_fault

__all__ = ["main"]

_FAILED = 1
_WRONG_USAGE = 2
_INTERRUPTED = 130

# Which module holds each first word, so that `map check` never waits for torch to load.
_MODULES = {
    "demo": "toponav.cli.demo",
    "scene": "toponav.cli.scene",
    "map": "toponav.cli.map",
    "collect": "toponav.cli.collect",
    "data": "toponav.cli.data",
    "episodes": "toponav.cli.episodes",
    "train": "toponav.cli.train",
    "eval": "toponav.cli.eval",
    "tables": "toponav.cli.tables",
    "figures": "toponav.cli.figures",
    "ros": "toponav.cli.ros",
    "explore": "toponav.cli.explore",
    "bench": "toponav.cli.bench",
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    Args:
        arguments: Words after the program's name; those of the process when None.

    Returns:
        0 when it worked, 1 when the thing failed, 2 for wrong usage, 130 when interrupted.

    Example:
        >>> main(["--version"])
        toponav 0.1.0
        0
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    if words in (["--version"], ["version"]):
        print(f"toponav {toponav.__version__}")
        return 0
    if not words or words[0] in ("-h", "--help"):
        print(_overview())
        return 0 if words else _WRONG_USAGE
    try:
        return _dispatch(words)
    except InputError as error:
        return _failed(error)
    except BrokenPipeError:
        sys.stderr.close()
        return _FAILED
    except OSError as error:
        return _failed(os_fault(error, verb="be used"))
    except MemoryError:
        return _failed(
            InputError(
                "there is not enough memory for this",
                where=" ".join(words[:2]),
                remedy="give fewer --workers or smaller inputs, or close other programs",
            )
        )
    except KeyboardInterrupt:
        print("toponav: interrupted; run the same command again to resume", file=sys.stderr)
        return _INTERRUPTED


def _failed(error: InputError) -> int:
    """Prints the error on one line; what files say cannot steer the terminal."""
    shown = "".join(
        letter if letter.isprintable() else ascii(letter)[1:-1] for letter in str(error)
    )
    print(f"toponav: {shown}", file=sys.stderr)
    return _FAILED


def _dispatch(words: list[str]) -> int:
    if words[0] not in _MODULES:
        return _unknown(words[0], _MODULES)
    commands = _commands(words[0])
    for length in (3, 2, 1):
        path = tuple(words[:length])
        if path in commands:
            return _run(commands[path], path, words[length:])
    second = {path[1] for path in commands if len(path) > 1}
    if len(words) > 1 and not words[1].startswith("-"):
        return _unknown(words[1], second, within=f" {words[0]}")
    print(_overview(words[0]))
    return 0 if {"-h", "--help"} & set(words) else _WRONG_USAGE


def _run(command: Callable[..., Any], path: tuple[str, ...], rest: list[str]) -> int:
    try:
        status = tyro.cli(command, args=rest, prog=" ".join(("toponav", *path)))
    except SystemExit as exit_:
        return exit_.code if isinstance(exit_.code, int) else _FAILED
    return status if isinstance(status, int) else 0


def _commands(word: str) -> dict[tuple[str, ...], Callable[..., Any]]:
    module = importlib.import_module(_MODULES[word])
    commands: dict[tuple[str, ...], Callable[..., Any]] = module.register()
    return commands


def _unknown(word: str, valid: Any, within: str = "") -> int:
    hint = did_you_mean(word, valid)
    print(f"toponav{within}: no command '{word}'; {hint}", file=sys.stderr)
    return _WRONG_USAGE


def _overview(only: str | None = None) -> str:
    lines = [
        "toponav: visual robot navigation with topological maps",
        "",
        "usage: toponav COMMAND [OPTIONS]        toponav COMMAND --help for one command",
        "",
    ]
    for word in [only] if only else _MODULES:
        for path, command in _commands(word).items():
            summary = (command.__doc__ or "").strip().splitlines()
            lines.append(f"  {' '.join(path):<22} {summary[0] if summary else ''}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
