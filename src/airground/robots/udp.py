"""A robot that is driven by datagrams: the newest command again and again, so that a lost one does not matter."""

from __future__ import annotations

import select
import socket
from collections import deque
from threading import Event, Lock, Thread
from time import monotonic
from typing import TYPE_CHECKING, Any, Literal, Self

from airground.control.command import STOP, VelocityCommand
from airground.errors import InputError, UnreachableError
from airground.robots.protocol import RobotLink, RobotReading
from airground.robots.stamp_clock import BACK_S, StampClock
from airground.robots.udp_messages import MOST_BYTES, command_datagram, parse_reading

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

__all__ = ["UdpRobot"]

MOST_WAITING = 500  # readings that nobody asks for
MOST_AT_ONCE = 64  # datagrams, before it is looked whether a command is due
STOP_TIMES, CLOSE_TIMES, CLOSE_STEP_S = 3, 6, 0.015
CLOSING_S = 1.0


class UdpRobot:
    """A `Robot` behind a UDP port, with a thread that repeats commands and hears readings.

    A command is sent at once and repeated until the next one; when the caller has been silent for `timeout_s`, it is
    the command to stand that is repeated. Datagrams of anybody but the robot, malformed or overtaken ones are counted
    and change nothing.

    Parameters
    ----------
    name : str
        What it is called.
    host : str
        Where it is.
    port : int
        Where it listens.
    clock : callable
        The session's: gives seconds.
    rate_hz : float [Hz]
        How often commands are repeated; 10 or more.
    timeout_s : float [s]
        After such a silence the robot stops by itself: it is told so in each command.
    lost_s : float [s]
        For how long it may be silent before its link counts as lost.

    Raises
    ------
    InputError
        If a number is out of range.
    UnreachableError
        If the host is not known, or no socket can be had.
    """

    def __init__(
        self,
        name: str,
        host: str,
        port: int,
        *,
        clock: Callable[[], float] = monotonic,
        rate_hz: float = 20.0,
        timeout_s: float = 0.5,
        lost_s: float = 0.5,
    ) -> None:
        if not 0 < port < 65536:
            raise InputError(f"{name}: a port is 1 to 65535, not {port}")
        if not 10 <= rate_hz <= 200:
            raise InputError(f"{name}: rate_hz must be 10 to 200, not {rate_hz}")
        if not 2 / rate_hz <= timeout_s <= 5:
            raise InputError(f"{name}: timeout_s must be {2 / rate_hz:g} to 5, not {timeout_s}")
        if not lost_s > 0:
            raise InputError(f"{name}: lost_s must be positive, not {lost_s}")
        self._name = name
        self._where = f"{host}:{port}"
        self._clock = clock
        self._period_s, self._timeout_s, self._lost_s = 1 / rate_hz, timeout_s, lost_s
        self._stamps = StampClock()
        self._stamp = -float("inf")  # newest of the robot's
        self._lock = (
            Lock()
        )  # of all below; held for no longer than a system call that does not wait
        self._command, self._told_s = STOP, monotonic()
        self._seq = self._received = self._refused = self._sent = 0
        self._note = ""
        self._heard_s: float | None = None
        self._waiting: deque[RobotReading] = deque(maxlen=MOST_WAITING)
        self._closing = Event()
        self._peer, self._socket = _socket_to(name, host, port)
        self._thread = Thread(target=self._run, name=f"robot {name}", daemon=True)
        self._thread.start()

    @property
    def name(self) -> str:
        """What it is called."""
        return self._name

    @property
    def link(self) -> RobotLink:
        """How its connection stands."""
        with self._lock:
            state: Literal["opening", "live", "lost", "closed"] = "opening"
            note = self._note
            if self._closing.is_set():
                state = "closed"
            elif self._heard_s is None:
                note = note or f"nothing was heard from {self._where} yet"
            else:
                silent_s = monotonic() - self._heard_s
                state = "live" if silent_s <= self._lost_s else "lost"
                if state == "lost":
                    note = f"{self._where} has been silent for {silent_s:.1f} s"
            return RobotLink(state, self._received, self._refused, self._sent, note)

    def read(self) -> list[RobotReading]:
        """Give what has arrived since one last asked.

        Returns
        -------
        readings : list of RobotReading
            Oldest first; never waits.
        """
        with self._lock:
            readings = list(self._waiting)
            self._waiting.clear()
        return readings

    def send(self, command: VelocityCommand) -> VelocityCommand:
        """Tell it what to do, at once and again and again.

        Parameters
        ----------
        command : VelocityCommand
            What; one that is not finite stops it.

        Returns
        -------
        sent : VelocityCommand
            As it was sent: at rest after `close`.
        """
        with self._lock:
            if self._closing.is_set() or not command.finite:
                command = STOP
            self._command, self._told_s = command, monotonic()
            self._transmit()
        return command

    def stop(self) -> None:
        """Tell it to stand, several times at once; repeated until the next command."""
        with self._lock:
            self._command, self._told_s = STOP, monotonic()
            for _ in range(STOP_TIMES):
                self._transmit()

    def close(self) -> None:
        """Stop it and let go of the link, which takes a tenth of a second; calling it again does nothing."""
        with self._lock:
            if self._closing.is_set():
                return
            self._command = STOP
            self._closing.set()
        self._thread.join(CLOSING_S)
        for _ in range(CLOSE_TIMES):
            with self._lock:
                self._transmit()
            Event().wait(CLOSE_STEP_S)
        with self._lock:
            self._socket.close()

    def _transmit(self) -> None:
        """Send the newest command. The lock is held."""
        if self._socket.fileno() < 0:
            return
        self._seq += 1
        datagram = command_datagram(self._seq, self._clock(), self._command, self._timeout_s)
        try:
            self._socket.sendto(datagram, self._peer)
            self._sent += 1
        except OSError as error:  # no network, or no room: the next one comes soon
            self._note = f"{self._where}: {error.strerror or error}"

    def _run(self) -> None:
        due_s = monotonic()
        while not self._closing.is_set():
            wait_s = max(due_s - monotonic(), 0.0)
            if select.select([self._socket], [], [], wait_s)[0]:
                for _ in range(MOST_AT_ONCE):
                    if not self._hear():
                        break
            now_s = monotonic()
            if now_s >= due_s:
                due_s = now_s + self._period_s
                with self._lock:
                    if now_s - self._told_s > self._timeout_s:
                        self._command = STOP
                    self._transmit()

    def _hear(self) -> bool:
        """Take one datagram; whether there was one."""
        try:
            datagram, sender = self._socket.recvfrom(MOST_BYTES + 1)
        except BlockingIOError:
            return False
        except OSError as error:  # told that nobody listens there
            with self._lock:
                self._note = f"{self._where}: {error.strerror or error}"
            return True
        arrival_s = self._clock()
        try:
            if sender[:2] != self._peer[:2]:
                raise InputError(f"a datagram of {sender[0]}:{sender[1]}, which is not the robot")
            t_s, heading, speed, turn_rate = parse_reading(datagram)
            if self._stamp - BACK_S <= t_s <= self._stamp:
                raise InputError("a datagram that was overtaken, or came twice")
        except InputError as error:
            with self._lock:
                self._refused += 1
                self._note = f"{self._refused} refused; the last: {error}"
            return True
        self._stamp = t_s
        t = self._stamps.take(t_s, arrival_s)
        with self._lock:
            self._received += 1
            self._heard_s = monotonic()
            self._waiting.append(RobotReading(t, heading, speed, turn_rate))
        return True

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _socket_to(name: str, host: str, port: int) -> tuple[Any, socket.socket]:
    """Find the robot's address, and open a socket on the interface that leads to it and on no other."""
    try:
        family, _, _, _, peer = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.connect(peer)
            own = probe.getsockname()
        ours = socket.socket(family, socket.SOCK_DGRAM)
        ours.bind((own[0], 0, *own[2:]))
        ours.setblocking(False)
    except OSError as error:
        raise UnreachableError(
            f"{name}: no way to {host}:{port}: {error.strerror or error}; check its address and the network"
        ) from None
    return peer, ours
