"""`planner` for shells of the documentation: a process that has imported everything forks for each call.

A start of the program costs one to two seconds of imports; thirty blocks would pay for them again and again.
What a call does is what `planner` does: its own process, folder, environment, standard files and exit code.
Two things that take long and that other tests look at are short: charts are empty, as in all tests but
tests/report, and the genetic campaign beside a plan has three generations, of which three points are shown.
"""

from __future__ import annotations

import importlib
import json
import os
import socket
import sys
from contextlib import suppress
from html import escape
from pathlib import Path

SLOW = (
    *("planner.cli", "planner.pipelines.data", "planner.pipelines.diagnosing", "planner.pipelines.planning"),
    *("planner.pipelines.promise", "planner.pipelines.recordings", "planner.pipelines.sweep"),
    *("planner.report.page", "planner.report.charts.theme", "jinja2"),
    *("pandas", "pyarrow.csv", "rich.table", "scipy.optimize", "scipy.signal", "scipy.stats"),
)
CLIENT = """#!{python} -SEs
import json, os, socket, sys
with socket.socket(socket.AF_UNIX) as line:
    line.connect({address!r})
    said = json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode()
    socket.send_fds(line, [len(said).to_bytes(8, "big")], [0, 1, 2])
    line.sendall(said)
    sys.exit(int(line.recv(8) or b"70"))
"""


def serve(address: str) -> None:
    """Answer calls for ever, one child each, and one at a time."""
    _import_everything()
    with socket.socket(socket.AF_UNIX) as door:
        door.bind(address)
        door.listen()
        print("ready", flush=True)
        while True:
            line, _ = door.accept()
            child = os.fork()
            if child == 0:
                door.close()
                _call(line)
            line.close()
            os.waitpid(child, 0)


def _call(line: socket.socket) -> None:
    """In the child: take over the caller's files, folder and environment, run, say the exit code."""
    size, files, _, _ = socket.recv_fds(line, 8, 3)
    wanted, said = int.from_bytes(size, "big"), b""
    while len(said) < wanted:
        said += line.recv(wanted - len(said))
    words, folder, environment = json.loads(said)
    for number, file in enumerate(files):
        os.dup2(file, number)
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w")  # noqa: SIM115 - until it ends
    sys.argv = ["planner", *words]
    code = 70
    try:
        _answer(words)
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    finally:
        with suppress(OSError, ValueError):
            sys.stdout.flush()
            sys.stderr.flush()
        line.sendall(str(code).encode())
        os._exit(0)


def _answer(words: list[str]) -> None:
    """What `planner WORDS` does; `python -c TEXT` where the words begin with -c."""
    from planner.__main__ import main

    if words[:1] == ["-c"]:
        sys.path.insert(0, "")
        exec(compile(words[1], "<page>", "exec"), {"__name__": "__main__"})
    else:
        main()


def _import_everything() -> None:
    """What takes long to import, and changes nothing by being there; what is short here."""
    for module in SLOW:
        importlib.import_module(module)
    pareto = importlib.import_module("planner.information.pareto")
    pareto.GENERATIONS, pareto.SHOWN = 3, 3
    importlib.import_module("planner.report.charts.theme").drawn = not_drawn


def not_drawn(name: str, description: str, draw: object) -> str:
    """A chart that is empty, with its name and its words."""
    del draw
    return f'<svg role="img" id="{name}"><title>{escape(description)}</title></svg>'


def write_client(place: Path, address: str) -> None:
    """The command `planner` in a folder."""
    file = place / "planner"
    file.write_text(CLIENT.format(python=sys.executable, address=address))
    file.chmod(0o755)


if __name__ == "__main__":
    serve(sys.argv[1])
