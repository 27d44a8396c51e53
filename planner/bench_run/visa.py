"""Lines over PyVISA with pyvisa-py as the backend: TCP (`TCPIP::host::port::SOCKET`) and serial (`ASRL…`)."""

from __future__ import annotations

import contextlib
import os
import re
import select
import socket
import time
from typing import Any

from planner.errors import InputError

MOST_LATE = 1000  # replies that are thrown away at most; a device that never stops talking is none
OPEN_MS = 5000  # how long connecting may take
LOCAL = re.compile(r"TCPIP\d*::(127\.\d+\.\d+\.\d+|localhost)::\d+::SOCKET", re.IGNORECASE)


def is_simulator(resource: str) -> bool:
    """Whether a resource is a port of this machine: nothing that can hurt anybody."""
    return LOCAL.fullmatch(resource) is not None


class VisaLine:
    """One instrument. Raises InputError when it cannot be opened; then see `planner.bench_run.line.Line`."""

    def __init__(self, resource: str, line_end: str, baud: int = 19200) -> None:
        self._resource, self._line_end, self._baud = resource, line_end, baud
        self._manager = _manager()
        self._instrument: Any = None
        self._instrument = self._open()

    def write(self, message: str) -> None:
        """Send one message."""
        try:
            self._instrument.write(message)
        except Exception as error:  # pyvisa-py lets through errors of sockets and of pyserial as they are
            raise _translated(error) from error

    def read(self, within_s: float) -> str:
        """The next reply."""
        end = time.monotonic() + within_s
        try:
            self._await(within_s)
            self._instrument.timeout = max(round(1000 * (end - time.monotonic())), 1)
            return str(self._instrument.read()).rstrip("\r\n")
        except Exception as error:  # as in write
            raise _translated(error) from error

    def drain(self, listen_s: float, at_most: int = 0) -> int:
        """Throw away what has come in, and what comes in the next seconds.

        Not by VISA's own clear: pyvisa-py's (0.8) never returns once the other side has hung up.
        """
        end, found = time.monotonic() + listen_s, 0
        while found < MOST_LATE:
            left = end - time.monotonic()
            if left <= 0 and not self._more():
                break
            try:
                self.read(max(left, 0.001))
            except TimeoutError:
                break
            except ValueError:
                pass  # it was something, if no text
            found += 1
            if found == at_most:
                break
        return found

    def reopen(self) -> None:
        """Connect again."""
        self.close()
        try:
            self._instrument = self._open()
        except InputError as error:
            raise ConnectionError(str(error)) from error

    def close(self) -> None:
        """Hang up."""
        with contextlib.suppress(Exception):  # it may have gone by itself
            self._instrument.close()

    def _await(self, within_s: float) -> None:
        """Until a reply begins on a socket. Raises ConnectionResetError when the other side has hung up.

        pyvisa-py (0.8) takes a closed socket for one that is silent, and spins until the time-out.
        """
        session = self._instrument.visalib.sessions[self._instrument.session]
        interface = getattr(session, "interface", None)
        if getattr(session, "_pending_buffer", b"") or not isinstance(interface, socket.socket):
            return
        ready = select.select([interface], [], [], within_s)[0]
        if ready and not interface.recv(1, socket.MSG_PEEK):
            raise ConnectionResetError("the other side has hung up")

    def _more(self) -> bool:
        try:
            return self._has_more()
        except Exception as error:  # as in write
            raise _translated(error) from error

    def _has_more(self) -> bool:
        """Whether a reply has come: in pyvisa-py's own buffer, or in the system's."""
        session = self._instrument.visalib.sessions[self._instrument.session]
        if getattr(session, "_pending_buffer", b""):
            return True
        interface = getattr(session, "interface", None)
        if isinstance(interface, socket.socket):
            return bool(select.select([interface], [], [], 0)[0])
        return bool(getattr(interface, "in_waiting", 0))

    def _open(self) -> Any:
        settings: dict[str, Any] = (
            {"baud_rate": self._baud} if self._resource.upper().startswith("ASRL") else {}
        )
        try:
            instrument = self._manager.open_resource(
                self._resource,
                open_timeout=OPEN_MS,
                read_termination="\r" if self._line_end == "\r" else "\n",
                write_termination=self._line_end,
                **settings,
            )
            instrument.encoding = "ascii"
            _connected(instrument)
        except Exception as error:  # of VISA, of sockets, of pyserial, and plain Exception for a refused port
            raise InputError(f"cannot open {self._resource}: {error}") from error
        _without_delay(instrument)
        return instrument


def _connected(instrument: Any) -> None:
    """Raises OSError when nobody answered: pyvisa-py (0.8) opens a socket that was refused all the same."""
    interface = getattr(instrument.visalib.sessions[instrument.session], "interface", None)
    if isinstance(interface, socket.socket):
        error = interface.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if error:
            raise OSError(error, os.strerror(error))
        interface.getpeername()


def _without_delay(instrument: Any) -> None:
    """A command and the question after it go out at once; else the second waits 40 ms for an ACK.

    pyvisa-py (0.8) lists VI_ATTR_TCPIP_NODELAY and refuses to set it, so its socket is asked; where there is
    none the run is as right, only slower.
    """
    with contextlib.suppress(Exception):
        socket_of = instrument.visalib.sessions[instrument.session].interface
        socket_of.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _manager() -> Any:
    try:
        import pyvisa

        return pyvisa.ResourceManager("@py")
    except (ImportError, ValueError) as error:
        raise InputError("a bench is driven over PyVISA: pip install 'planner[bench]'") from error


def _translated(error: Exception) -> OSError | ValueError:
    """VISA's own errors as the ones that everybody knows."""
    from pyvisa.constants import StatusCode

    if getattr(error, "error_code", None) == StatusCode.error_timeout:
        return TimeoutError("no reply")
    if isinstance(error, UnicodeError):
        return ValueError("the reply is not ASCII")
    return ConnectionError(f"{type(error).__name__}: {error}")
