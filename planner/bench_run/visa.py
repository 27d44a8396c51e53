"""Lines over PyVISA with pyvisa-py as the backend: TCP (`TCPIP::host::port::SOCKET`) and serial (`ASRL…`)."""

from __future__ import annotations

import contextlib
import os
import re
import socket
from typing import Any

from planner.errors import InputError

TIMEOUT_MS = 2000
LATE_MS, MOST_LATE = 100, 100  # how long to listen for late replies, and for how many
LOCAL = re.compile(r"TCPIP\d*::(127\.\d+\.\d+\.\d+|localhost)::\d+::SOCKET", re.IGNORECASE)


def is_simulator(resource: str) -> bool:
    """Whether a resource is a port of this machine: nothing that can hurt anybody."""
    return LOCAL.fullmatch(resource) is not None


class VisaLine:
    """One instrument. Raises InputError when it cannot be opened; then see `planner.bench_run.line.Line`."""

    def __init__(self, resource: str, line_end: str, baud: int = 19200) -> None:
        self._resource, self._line_end, self._baud = resource, line_end, baud
        self._manager = _manager()
        self._instrument = self._open()

    def write(self, message: str) -> None:
        """Send one message."""
        try:
            self._instrument.write(message)
        except Exception as error:  # pyvisa-py lets through errors of sockets and of pyserial as they are
            raise _translated(error) from error

    def read(self) -> str:
        """The next reply."""
        try:
            return str(self._instrument.read()).rstrip("\r\n")
        except Exception as error:  # as in write
            raise _translated(error) from error

    def clear(self) -> None:
        """Throw away what has come in, and what comes in the next moment.

        Not by VISA's own clear: pyvisa-py's (0.8) never returns once the other side has hung up.
        """
        self._instrument.timeout = LATE_MS
        try:
            for _ in range(MOST_LATE):
                self.read()
        except (OSError, ValueError):
            pass  # nothing more; if the line is down, the next message finds out
        finally:
            self._instrument.timeout = TIMEOUT_MS

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

    def _open(self) -> Any:
        settings: dict[str, Any] = (
            {"baud_rate": self._baud} if self._resource.upper().startswith("ASRL") else {}
        )
        try:
            instrument = self._manager.open_resource(
                self._resource,
                read_termination="\n",
                write_termination=self._line_end,
                timeout=TIMEOUT_MS,
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
