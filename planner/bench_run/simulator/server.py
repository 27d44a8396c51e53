"""The simulated bench on TCP ports of this machine, loopback only.

One line is one message; the table and the chamber have a port each. A third port moves the clock, which is no
part of the table's language: `NOW?` and `SLEEP s` are answered with the time in seconds. While a client is
connected there, time stands still between its SLEEPs; otherwise it runs at the wall's pace times the speed.
"""

from __future__ import annotations

import ipaddress
import socketserver
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from planner.bench_run.simulator.chamber import Chamber
from planner.bench_run.simulator.client import ConnectedProcess
from planner.bench_run.simulator.clock import ServedClock
from planner.bench_run.simulator.faults import Device, Faulty, InjectedFault, Reply
from planner.bench_run.simulator.grammar import LONGEST_MESSAGE
from planner.bench_run.simulator.table import Table
from planner.errors import InputError


class _Device(Protocol):
    @property
    def unreachable(self) -> bool: ...

    def replies(self, message: str) -> Sequence[Reply]: ...


@dataclass(frozen=True)
class Ports:
    """Where to listen; 0 lets the system choose."""

    table: int = 0
    chamber: int = 0
    clock: int = 0


class ClockPort:
    """The clock as a device."""

    def __init__(self, clock: ServedClock) -> None:
        self.clock = clock
        self.clients = 0
        self.unreachable = False

    def replies(self, message: str) -> list[Reply]:
        """`NOW?` or `SLEEP s` → the time in seconds; `ERROR` for anything else."""
        return [(0.0, self._reply(message))]

    def _reply(self, message: str) -> str:
        verb, _, seconds = message.partition(" ")
        try:
            if verb == "SLEEP":
                self.clock.sleep(float(seconds))
            elif message != "NOW?":
                return "ERROR"
        except ValueError:
            return "ERROR"
        return repr(self.clock.now())

    def joined(self, change: int) -> None:
        """A client has come (+1) or gone (−1)."""
        self.clients += change
        self.clock.stepped = self.clients > 0


class SimulatedBench:
    """Table, chamber and clock behind three ports; `with` starts and stops it."""

    def __init__(
        self,
        *,
        ports: Ports = Ports(),
        host: str = "127.0.0.1",
        speed: float = 1.0,
        axes: int = 3,
        faults: Sequence[InjectedFault] = (),
        log: Callable[[float, str, str, str | None], None] | None = None,
    ) -> None:
        check_loopback(host)
        self.clock = ServedClock(speed)
        self.table, self.chamber = Table(self.clock, axes), Chamber(self.clock)
        self._lock, self._log, clock_port = threading.Lock(), log, ClockPort(self.clock)
        self._client = ConnectedProcess(self.clock)
        devices: dict[str, _Device] = {
            "table": self._faulty(self.table, "table", faults),
            "chamber": self._faulty(self.chamber, "chamber", faults),
            "clock": clock_port,
        }
        self._servers = {
            name: self._listen(name, host, getattr(ports, name), device, clock_port)
            for name, device in devices.items()
        }

    @property
    def ports(self) -> Ports:
        """The ports in use."""
        return Ports(**{name: server.server_address[1] for name, server in self._servers.items()})

    def __enter__(self) -> SimulatedBench:
        for server in self._servers.values():
            threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        return self

    def __exit__(self, *unused: object) -> None:
        for server in self._servers.values():
            server.shutdown()
            server.server_close()

    def _faulty(self, device: Device, name: str, faults: Sequence[InjectedFault]) -> Faulty:
        own = [fault for fault in faults if fault.device == name]
        return Faulty(device, own, self._client, self.clock.now)

    def _answer(self, name: str, device: _Device, message: str, peer: tuple[str, int]) -> Sequence[Reply]:
        with self._lock:
            self._client.port = peer[1] if name != "clock" else self._client.port
            replies = device.replies(message)
            if self._log is not None and name != "clock":
                self._log(self.clock.now(), name, message, replies[0][1] if replies else None)
            return replies

    def _listen(
        self, name: str, host: str, port: int, device: _Device, clock_port: ClockPort
    ) -> socketserver.ThreadingTCPServer:
        answer, lock = self._answer, self._lock

        class Line(socketserver.StreamRequestHandler):
            disable_nagle_algorithm = True

            def handle(self) -> None:
                end = b"\r\n" if name == "chamber" else b"\n"
                with _counted(clock_port if name == "clock" else None, lock):
                    while not device.unreachable and (line := self.rfile.readline(LONGEST_MESSAGE + 2)):
                        message = line.decode("ascii", "replace").rstrip("\r\n")
                        try:
                            replies = answer(name, device, message, self.client_address)
                        except ConnectionResetError:
                            return
                        for late_s, reply in replies:
                            time.sleep(late_s)
                            self.wfile.write(reply.encode() + end)

        class Server(socketserver.ThreadingTCPServer):
            allow_reuse_address, daemon_threads = True, True

            def handle_error(self, request: object, client_address: object) -> None:
                """A client that hangs up in the middle is no news."""

        try:
            return Server((host, port), Line)
        except OSError as error:
            raise InputError(f"cannot listen on {host}:{port} for the {name}: {error.strerror}") from error


class _counted:  # noqa: N801 - reads as a word after `with`
    def __init__(self, clock_port: ClockPort | None, lock: threading.Lock) -> None:
        self._clock_port, self._lock = clock_port, lock

    def __enter__(self) -> None:
        self._join(1)

    def __exit__(self, *unused: object) -> None:
        self._join(-1)

    def _join(self, change: int) -> None:
        if self._clock_port is not None:
            with self._lock:
                self._clock_port.joined(change)


def check_loopback(host: str) -> None:
    """Raise InputError unless the address is this machine only: the simulator has no lock on its door."""
    try:
        local = ipaddress.ip_address(host).is_loopback
    except ValueError:
        local = host == "localhost"
    if not local:
        raise InputError(f"the simulator listens on this machine only, not on {host}; leave out the address")
