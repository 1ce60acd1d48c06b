"""Server of ``meltemi live``: one page and its socket, accessible from this machine only.

It listens on 127.0.0.1 and answers requests whose path has the random token and whose ``Host`` is its address; the
socket also requires the origin of the page. So neither another machine, nor another page in the same browser, nor a
name that resolves to 127.0.0.1 reaches the simulation. A new page replaces the previous one, whose messages are
dropped. The numbers of connections and pending messages, and the nesting of messages, are bounded.
"""

from __future__ import annotations

import json
import logging
import secrets
import socket
from contextlib import suppress
from http import HTTPStatus
from queue import Empty, Full, Queue
from threading import BoundedSemaphore, Thread
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from meltemi.core.errors import InputError
from meltemi.core.extras import need

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from websockets.http11 import Request, Response
    from websockets.sync.server import ServerConnection

ADDRESS = "127.0.0.1"
LONGEST_MESSAGE = 2048
"""Bytes of a message of the page."""
MOST_WAITING = 256
"""Messages that wait; of a page that sends faster than they are handled the others are dropped."""
MOST_CONNECTIONS = 16
"""Largest number of simultaneous connections, including idle ones; each takes two threads."""
PATIENCE = 10.0
"""[s] after which a page that does not answer is taken as closed."""
POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"


class LiveServer:
    """Server of one page; a context manager.

    Args:
      page: returns the HTML of the page; called in another thread.
      port: 0 for a free port.

    Attributes:
      url: address of the page, with the token.
      closed_at: [s] of ``time.monotonic`` at which the last page was closed; None before the first page opens, and
        while one is open.

    Raises:
      InputError: the package websockets is missing, or the port is taken.
    """

    def __init__(self, page: Callable[[], str], port: int = 0) -> None:
        need("live", "websockets")
        from websockets.sync.server import serve

        if not 0 <= port < 65536:
            raise InputError(f"--port must be from 1 to 65535, found {port}")
        try:
            bound = socket.create_server((ADDRESS, port))
        except OSError as error:
            raise InputError(f"--port {port}: {error.strerror or error}; leave it out for a free one") from None
        self.host = f"{ADDRESS}:{bound.getsockname()[1]}"
        self._path = f"/{secrets.token_urlsafe(24)}/"
        self.url = f"http://{self.host}{self._path}"
        self.closed_at: float | None = None
        self._page, self._inbox = page, Queue[tuple[Any, str]](MOST_WAITING)
        self._open: ServerConnection | None = None
        self._server = serve(
            self._talk,
            sock=bound,
            origins=[f"http://{self.host}"],  # type: ignore[list-item]  # a NewType of str
            process_request=self._answer,
            compression=None,
            max_size=LONGEST_MESSAGE,
            ping_interval=PATIENCE / 2.0,
            ping_timeout=PATIENCE,
            server_header=None,
            logger=logging.Logger("meltemi live", logging.CRITICAL),  # no tracebacks of connections that others broke
        )
        self._server.handler = _at_most(MOST_CONNECTIONS, self._server.handler)
        self._thread = Thread(target=self._server.serve_forever, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._open is not None:
            self._open.close(1001, "the simulation has ended")
        self._server.shutdown()
        self._thread.join()

    @property
    def open(self) -> bool:
        """Whether a page is open."""
        return self._open is not None

    def send(self, message: bytes | dict[str, Any]) -> None:
        """Send to the page, if one is open."""
        from websockets.exceptions import ConnectionClosed

        page = self._open
        if page is not None:
            with suppress(ConnectionClosed):
                page.send(message if isinstance(message, bytes) else json.dumps(message, allow_nan=False))

    def received(self, wait: float) -> Iterator[Any]:
        """Messages of the open page; waits up to ``wait`` seconds for the first one. ``None`` replaces invalid JSON.

        Repeated equal messages are left out: a second reset changes nothing.
        """
        before = ""
        with suppress(Empty):
            for _ in range(MOST_WAITING):
                sender, text = self._inbox.get(timeout=wait) if wait > 0.0 else self._inbox.get_nowait()
                wait = 0.0
                if sender is not self._open or text == before:
                    continue
                before = text
                try:
                    message = json.loads(text)
                except (ValueError, RecursionError):
                    message = None
                yield message

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Response with the page, or a rejection; None lets the socket open after a check of its origin."""
        given = request.path.encode()
        if request.headers.get_all("Host") != [self.host]:
            return connection.respond(HTTPStatus.FORBIDDEN, "unknown host\n")
        if secrets.compare_digest(given, f"{self._path}socket".encode()):
            return None
        if not secrets.compare_digest(given, self._path.encode()):
            return connection.respond(HTTPStatus.FORBIDDEN, "wrong address: open the one that meltemi live printed\n")
        if self.closed_at is not None:  # the page was opened again: its socket follows
            self.closed_at = monotonic()
        response = connection.respond(HTTPStatus.OK, self._page())
        del response.headers["Content-Type"]
        for name, value in (
            ("Content-Type", "text/html; charset=utf-8"),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
            ("Content-Security-Policy", f"{POLICY}; connect-src ws://{self.host}; frame-ancestors 'none'"),
        ):
            response.headers[name] = value
        return response

    def _talk(self, connection: ServerConnection) -> None:
        from websockets.exceptions import ConnectionClosed

        before, self._open, self.closed_at = self._open, connection, None
        with suppress(Empty):
            while True:  # pending messages of the previous page are dropped
                self._inbox.get_nowait()
        self._inbox.put((connection, '{"opened": true}'))
        if before is not None:
            before.close(4000, "opened in another window")
        with suppress(ConnectionClosed):  # a terminated browser sends no closing frame
            for message in connection:
                with suppress(Full):
                    self._inbox.put_nowait((connection, message if isinstance(message, str) else ""))
        if self._open is connection:
            self._open, self.closed_at = None, monotonic()


def _at_most(n: int, handler: Callable[[socket.socket, Any], None]) -> Callable[[socket.socket, Any], None]:
    """Connection handler that closes connections beyond ``n`` at a time."""
    free = BoundedSemaphore(n)

    def handled(connection: socket.socket, address: Any) -> None:
        granted = free.acquire(blocking=False)
        if not granted:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)  # the handler ends at once
        try:
            handler(connection, address)
        finally:
            if granted:
                free.release()

    return handled
