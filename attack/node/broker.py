"""MQTT 3.1.1 broker of one topic for a campaign run: keeps arrival times, and can be killed.

Only CONNECT with its will, PUBLISH at QoS 0 and 1, PINGREQ and DISCONNECT are handled (OASIS MQTT
3.1.1, chapter 3). When a connection ends without DISCONNECT, the will is recorded as a message.
"""

from __future__ import annotations

import contextlib
import json
import socket
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

CONNECT, PUBLISH, PINGREQ, DISCONNECT = 1, 3, 12, 14


class Session:
    """One connection of a client."""

    def __init__(self, peer: socket.socket, take: Callable[[dict[str, Any]], None]) -> None:
        self.peer = peer
        self.take = take
        self.received = b""
        self.will: bytes | None = None

    def read(self) -> bool:
        """Processes received bytes; returns whether the connection is still open."""
        try:
            received = self.peer.recv(1 << 16)
        except BlockingIOError:
            return True
        except OSError:
            received = b""
        if not received:
            if self.will:
                self._record(self.will)
            self.peer.close()
            return False
        self.received += received
        while packet := self._packet():
            self._handle(*packet)
        return True

    def _packet(self) -> tuple[int, bytes] | None:
        """First byte and body of the next complete packet."""
        length, shift = 0, 0
        for place, byte in enumerate(self.received[1:5], start=1):
            length |= (byte & 0x7F) << shift
            shift += 7
            if not byte & 0x80:
                end = place + 1 + length
                if len(self.received) < end:
                    return None
                packet = self.received[0], self.received[place + 1 : end]
                self.received = self.received[end:]
                return packet
        return None

    def _handle(self, first: int, body: bytes) -> None:
        kind = first >> 4
        if kind == CONNECT:
            self._connect(body)
            self._send(b"\x20\x02\x00\x00")
        elif kind == PUBLISH:
            length = int.from_bytes(body[:2], "big")
            rest = body[2 + length :]
            if first & 0b110:
                self._send(b"\x40\x02" + rest[:2])
                rest = rest[2:]
            self._record(rest)
        elif kind == PINGREQ:
            self._send(b"\xd0\x00")
        elif kind == DISCONNECT:
            self.will = None

    def _connect(self, body: bytes) -> None:
        fields = []
        name_length = int.from_bytes(body[:2], "big")
        flags, rest = body[2 + name_length + 1], body[2 + name_length + 4 :]
        while len(rest) >= 2:
            length = int.from_bytes(rest[:2], "big")
            fields.append(rest[2 : 2 + length])
            rest = rest[2 + length :]
        # Client identifier, then topic and message of the will (3.1.3).
        self.will = fields[2] if flags & 0b100 and len(fields) >= 3 else None

    def _send(self, packet: bytes) -> None:
        with contextlib.suppress(OSError):
            self.peer.sendall(packet)

    def _record(self, content: bytes) -> None:
        try:
            self.take(dict(json.loads(content)))
        except (ValueError, TypeError):
            self.take({"malformed": content.decode(errors="replace")})


class Broker:
    """A listening socket and its sessions, read by whoever calls `poll`."""

    def __init__(self, take: Callable[[dict[str, Any]], None]) -> None:
        self.take = take
        self.sessions: list[Session] = []
        self.server: socket.socket | None = socket.create_server(("127.0.0.1", 0))
        self.port = int(self.server.getsockname()[1])
        self.server.setblocking(False)

    def poll(self) -> None:
        """Accepts connections and reads all sessions."""
        if self.server is not None:
            with contextlib.suppress(OSError):
                peer, _ = self.server.accept()
                peer.setblocking(False)
                self.sessions.append(Session(peer, self.take))
        self.sessions = [it for it in self.sessions if it.read()]

    def kill(self) -> None:
        """Closes all sockets, as the end of the broker's process does."""
        if self.server is not None:
            self.server.close()
            self.server = None
        for session in self.sessions:
            session.peer.close()
        self.sessions = []

    def restart(self) -> None:
        """Listens again on the same port."""
        self.server = socket.create_server(("127.0.0.1", self.port))
        self.server.setblocking(False)
