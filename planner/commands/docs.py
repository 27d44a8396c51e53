"""The command that opens the documentation, offline, from the installed package: docs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from planner.commands.options import AsJson
from planner.commands.output import answer, asked, console

if TYPE_CHECKING:
    from planner.api.documentation.pages import Command


def docs(
    context: typer.Context,
    page: Annotated[
        str | None, typer.Argument(metavar="[PAGE]", help="Print this page; left out: open all of them.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="DIR", help="Write the site here instead.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Open the documentation, which is part of the package: tutorial, how-to, reference, explanation.

    On a terminal with a browser its first page opens; anywhere else its place is printed. With a PAGE, e.g.
    `tutorial` or `limits`, its text is printed.

    Example: planner docs tutorial
    """
    from planner.api.documentation.pages import page_named, pages
    from planner.api.documentation.site import site
    from planner.own_files import write_own

    found = pages(commands_of(context.find_root().command))
    if page is not None:
        one = page_named(page, found)
        _printed(one.text, {"page": one.name, "text": one.text}, as_json)
        return
    folder = out or _place()
    files = {folder / name: text for name, text in site(found).items()}
    write_own(files, "the documentation", force=out is None or asked("--force"))
    first = folder / "index.html"
    opened = out is None and not as_json and console().is_terminal and typer.launch(first.as_uri()) == 0
    said = f"opened {first}" if opened else f"{len(found)} pages; begin with {first}"
    answer({"written": str(folder), "pages": [one.name for one in found]}, said, as_json)


def _printed(text: str, document: dict[str, str], as_json: bool) -> None:
    """The page: set as text on a terminal, as Markdown anywhere else."""
    if as_json or not console().is_terminal:
        answer(document, text.rstrip("\n"), as_json)
        return
    from rich.markdown import Markdown

    console().print(Markdown(text))


def _place() -> Path:
    """Where this version's pages go: a folder of the user's own for caches."""
    from planner import __version__

    return Path(typer.get_app_dir("planner")) / "docs" / __version__


def commands_of(program: Any) -> list[Command]:
    """What the command line offers, as its help has it. program: typer's, whose classes are private."""
    from planner.api.documentation.pages import Command

    return [
        Command(
            name,
            one.help or "",
            tuple(str(p.metavar or p.name.upper()) for p in one.params if p.param_type_name == "argument"),
            tuple(_option(p) for p in one.params if p.param_type_name == "option"),
        )
        for name, one in program.commands.items()
    ]


def _option(option: Any) -> tuple[str, str, str]:
    shown = option.default if isinstance(option.default, (str, int, float)) else None
    default = "" if shown is None or isinstance(shown, bool) or shown == "" else str(shown)
    metavar = "" if option.is_flag else f" {option.metavar or 'VALUE'}"
    return "/".join([*option.opts, *option.secondary_opts]) + metavar, default, option.help or ""
