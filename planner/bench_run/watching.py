"""Telling people how far a run is: a line, a page that refreshes itself, a command that is called."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path

from planner.bench_run.equipment import Status
from planner.bench_run.safety import angle_words
from planner.errors import PlannerError
from planner.whole_files import write_whole

REFRESH_S = 10  # of the page, and how often it is written at most
PATIENCE_S = 60.0  # for a command that is called

_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
{refresh}<title>{title}</title>
<style>
body {{ font: 1rem/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 44rem; padding: 0 1rem; }}
h1 {{ font-size: 1.3rem; }}
dl {{ display: grid; grid-template-columns: minmax(7rem, auto) 1fr; gap: .3rem 1rem; }}
dt {{ color: #555; }} dd {{ margin: 0; overflow-wrap: anywhere; }} progress {{ width: 100%; height: 1.2rem; }}
.ended {{ border-left: .4rem solid #284; padding: .5rem 1rem; }}
.attention {{ border-left: .4rem solid #b00; background: #fee; padding: .5rem 1rem; }}
@media (prefers-color-scheme: dark) {{ body {{ background: #111; color: #eee; }} dt {{ color: #aaa; }}
.attention {{ background: #411; }} }}
</style></head><body><h1>{title}</h1>
{attention}{benches}
<p>Written {written}. {footer}</p>
</body></html>
"""


def duration(seconds: float) -> str:
    """`2 d 03:04`, `03:04` in hours and minutes."""
    minutes = max(round(seconds / 60), 0)
    days, rest = divmod(minutes, 24 * 60)
    return f"{f'{days} d ' if days else ''}{rest // 60:02d}:{rest % 60:02d}"


def status_line(status: Status) -> str:
    """Where a run is, in one line."""
    parts = [f"{status.step.id}", f"{status.done + 1}/{status.steps}", f"{duration(status.left_s)} left"]
    if status.attended is not None:
        parts.append(f"people in {duration(status.attended_in_s)}: {status.attended.action}")
    if status.temperature_degc is not None:
        parts.append(f"{status.temperature_degc:.1f} degC")
    return "; ".join([*parts, *filter(None, [angle_words(status.angles)])])


class Page:
    """A page in a file, written whole; at most every few seconds, by the wall."""

    def __init__(self, path: Path, title: str) -> None:
        self._path, self._title = path, title
        self._benches: dict[str, Status] = {}
        self._attention, self._ended, self._last_s = "", "", float("-inf")

    def watch(self, status: Status) -> None:
        """The run is here now."""
        self._benches[status.bench] = status
        if time.monotonic() - self._last_s >= REFRESH_S:
            self.write()

    def attend(self, words: str) -> None:
        """Somebody must look."""
        self._attention = words
        self.write()

    def end(self, words: str) -> None:
        """The run has ended, and how."""
        self._ended = words
        self.write()

    def write(self) -> None:
        """Write it. Raises InputError when that cannot be."""
        self._last_s = time.monotonic()
        said = {"attention": self._attention, "ended": self._ended}
        again = f"This page loads itself again every {REFRESH_S} s; what stands still for long has ended."
        page = _PAGE.format(
            title=escape(self._title),
            refresh="" if self._ended else f'<meta http-equiv="refresh" content="{REFRESH_S}">',
            attention="".join(f'<p class="{c}">{escape(text)}</p>\n' for c, text in said.items() if text),
            benches="\n".join(map(_bench, self._benches.values())) or "<p>Nothing has begun yet.</p>",
            footer="The run has ended; what stands here was seen last." if self._ended else again,
            written=time.strftime("%Y-%m-%d %H:%M:%S"),
        )
        write_whole(self._path, page)


def _bench(status: Status) -> str:
    attended = status.attended
    facts = {
        "bench": status.bench,
        "step": f"{status.step.id}, {status.step.action}",
        "steps done": f"{status.done} of {status.steps}",
        "time left by the plan": f"{duration(status.left_s)} h",
        "people needed": "no more"
        if attended is None
        else f"in {duration(status.attended_in_s)} h: {attended.action} ({attended.id})",
        "temperature": "not read"
        if status.temperature_degc is None
        else f"{status.temperature_degc:.1f} degC",
        "angles": angle_words(status.angles) or "not read",
    }
    rows = "".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in facts.items())
    return f'<progress max="{status.steps}" value="{status.done}"></progress>\n<dl>{rows}</dl>'


class Notifier:
    """Calls a command, `COMMAND EVENT WORDS`, as a list of arguments and without a shell.

    Events: person, attention, stopped, finished. A command that fails or hangs is said, and stops nothing.
    """

    def __init__(self, command: Sequence[str], say: Callable[[str], None]) -> None:
        self._command, self._say = tuple(command), say
        self._calls: list[threading.Thread] = []

    def __call__(self, event: str, words: str) -> None:
        """Call it, without waiting."""
        thread = threading.Thread(target=self._call, args=(event, words), daemon=True)
        self._calls = [call for call in self._calls if call.is_alive()] + [thread]
        thread.start()

    def close(self) -> None:
        """Wait until the last calls have ended, or had their time."""
        for call in self._calls:
            call.join(PATIENCE_S)

    def _call(self, event: str, words: str) -> None:
        try:
            subprocess.run(
                [*self._command, event, words],
                check=True,
                timeout=PATIENCE_S,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            self._say(f"--notify failed: {error}")


class Watching:
    """All of them together. Nothing that goes wrong with them reaches the run."""

    def __init__(
        self,
        page: Page | None,
        notifier: Notifier | None,
        line: Callable[[str], None],
        say: Callable[[str], None],
    ) -> None:
        self._page, self._notifier, self._line, self._say = page, notifier, line, say
        self._page_failed = False

    def watch(self, status: Status) -> None:
        """The run is here now."""
        self._line(status_line(status))
        self._on_page(lambda page: page.watch(status))

    def event(self, event: str, words: str) -> None:
        """A person is needed, or must look."""
        if self._notifier is not None:
            self._notifier(event, words)
        if event == "attention":
            self._on_page(lambda page: page.attend(words))

    def end(self, event: str, words: str) -> None:
        """The run has ended."""
        self._on_page(lambda page: page.end(words))
        if self._notifier is not None:
            self._notifier(event, words)
            self._notifier.close()

    def _on_page(self, do: Callable[[Page], None]) -> None:
        if self._page is None:
            return
        try:
            do(self._page)
        except (PlannerError, OSError) as error:
            if not self._page_failed:
                self._say(f"--page failed: {error}")
            self._page_failed = True
