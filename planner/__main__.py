"""`planner`, and `python -m planner`: the same program."""

import sys


def main() -> None:
    """Run the program; the list of commands comes from a file, before anything else is imported."""
    if sys.argv[1:] == ["--help"] and sys.argv[0].endswith("planner") and _is_wide():
        sys.stdout.write(_help())
        return
    import gc

    from planner.commands import sign

    gc.set_threshold(500_000)  # imports make 250 000 objects that stay; to look through 100 000 takes 40 ms
    sign.starting(sys.argv[1:])
    try:
        from planner.cli import main as program

        program()
    finally:
        sign.ended()
        gc.freeze()  # python's last look through all objects took 0.4 s after the last word


def _is_wide() -> bool:
    """Whether lines of 80 signs, as typer breaks them, stand on the terminal."""
    import shutil

    return shutil.get_terminal_size().columns >= 80


def _help() -> str:
    """What typer says of all commands; `tests/commands/test_every_command.py` holds the file to that."""
    from pathlib import Path

    return (Path(__file__).parent / "commands" / "help.txt").read_text(encoding="utf-8")


if __name__ == "__main__":
    main()
