"""The server of the panel: a thread with one port for the page, the login and the sockets of all browsers.

The source is called by one more thread; what all browsers are shown is read at once.
"""

from __future__ import annotations

import asyncio
import errno
import itertools
import logging
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, ClassVar, TypeVar

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from automax_ros.core.text import printable
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.panel.security import Gate, PanelOptions, page_files
from automax_ros.panel.session import Session
from automax_ros.panel.source import Asked, Facts, Frame, RequestRefused, Source

FRAME_S = 0.05
"""Shortest time between two frames, s."""
FRAMES_A_STATUS = 4
"""Frames for each look at the status and the log."""
MOST_BROWSERS = 8
MOST_CONNECTIONS = 64
"""Most connections at once, also of those who have no cookie: a rack in this process needs its files."""
PORTS = (*range(8470, 8480), 0)
"""The ports that are tried where none is wanted; the last is any free one."""
_LATER = 1013  # the code of a socket that is closed, but may be opened later

_T = TypeVar("_T")


class _Counted(ServerConnection):
    open_now: ClassVar[set[object]] = set()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self.open_now.add(self)
        if len(self.open_now) > MOST_CONNECTIONS:
            self.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self.open_now.discard(self)
        super().connection_lost(exc)


class PanelServer:
    """Serves a source from ``start`` to ``close``, which closes the source too.

    Attributes:
        address: the address that lets a browser in, as it is to be printed; it must not be logged.
    """

    address = ""

    def __init__(self, source: Source, options: PanelOptions) -> None:
        self._source, self._options, self._files = source, options, page_files()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="panel source")
        self._thread = threading.Thread(target=lambda: asyncio.run(self._main()), name="panel", daemon=True)
        self._begun: Future[Callable[[], object]] = Future()
        self._sessions: list[Session] = []
        self._bugs: set[str] = set()

    def start(self) -> None:
        """Begin to serve.

        Raises:
            UsageError: the port is taken, or the host is none of this machine.
            UserError: the source cannot be shown.
        """
        self._thread.start()
        self._begun.result()

    def close(self) -> None:
        """Close all connections, the port and the source."""
        if self._begun.done() and self._begun.exception() is None:
            self._begun.result()()
            self._thread.join()
        self._worker.submit(self._source.close).result()
        self._worker.shutdown()

    async def _main(self) -> None:
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        try:
            self._hello = await self._call(self._source.hello)
            if self._hello["operate"]["allowed"] and not self._options.operate:
                self._hello = {**self._hello, "operate": {"allowed": False, "why": "start the panel with --operate"}}
            server = await self._listen()
        except BaseException as fault:
            self._begun.set_exception(fault)
            return
        async with server:
            self._begun.set_result(lambda: loop.call_soon_threadsafe(ended.set))
            showing = asyncio.create_task(self._show())
            await ended.wait()
            showing.cancel()

    async def _listen(self) -> Server:
        ports = PORTS if self._options.port is None else (self._options.port,)
        logger = logging.Logger("panel")
        logger.disabled = True  # what it would write has the cookie in it
        for port in ports:
            try:
                server: Server = await serve(
                    self._browse,
                    self._options.host,
                    port,
                    process_request=self._process,
                    create_connection=_Counted,
                    server_header=None,
                    compression=None,
                    logger=logger,
                    max_size=1 << 16,
                    open_timeout=5,
                    close_timeout=1,
                )
            except OSError as error:
                taken = error.errno == errno.EADDRINUSE
                if not taken or port == ports[-1]:
                    what = f"the panel cannot have port {port} of {self._options.host}"
                    reason = "another program has it" if taken else error.strerror or str(error)
                    raise UsageError(f"{what}: {reason}", "--port N takes another one, 0 any free one") from error
            else:
                self._gate = Gate(self._options, server.sockets[0].getsockname()[1], self._files)
                self.address = self._gate.address
                return server
        raise AssertionError("the last port returns or raises")

    def _process(self, _: ServerConnection, request: Request) -> Response | None:
        method = getattr(request, "method", "GET")  # websockets 16 itself refuses all others
        return self._gate.answer(method, request.path, request.headers)

    async def _browse(self, connection: ServerConnection) -> None:
        if len(self._sessions) >= MOST_BROWSERS:
            await connection.close(_LATER, f"{MOST_BROWSERS} browsers are open already: close one")
            return
        session = Session(connection, self._source, self._call, self._hello)
        self._sessions.append(session)
        try:
            await session.serve()
        except ConnectionClosed:
            pass
        except Exception as bug:
            self._failure(bug)
        finally:
            self._sessions.remove(session)

    async def _call(self, act: Callable[..., _T], *arguments: Any) -> _T:
        """Call the source in its thread.

        Raises:
            UserError: it refuses.
            RequestRefused: it has failed, which is written on standard error, once for each place in its code.
        """
        try:
            return await asyncio.get_running_loop().run_in_executor(self._worker, act, *arguments)
        except UserError:
            raise
        except Exception as bug:
            raise self._failure(bug) from bug

    def _failure(self, bug: Exception) -> RequestRefused:
        where = traceback.extract_tb(bug.__traceback__)[-1]
        if (key := f"{type(bug)}{where.filename}:{where.lineno}") not in self._bugs:
            self._bugs.add(key)
            print("panel: a fault of the program:", *traceback.format_exception(bug), sep="\n", file=sys.stderr)
        return RequestRefused(f"the panel fails here: {type(bug).__name__}: {printable(str(bug))}")

    async def _show(self) -> None:
        """Send frames, the status and the log to all browsers, as long as the server lives."""
        loop = asyncio.get_running_loop()
        for turn in itertools.count():
            now_s = loop.time()
            sessions = [session for session in self._sessions if session.accepts(now_s)]
            try:
                await self._show_round(sessions, now_s, with_status=turn % FRAMES_A_STATUS == 0)
            except Exception as fault:
                told = fault if isinstance(fault, UserError) else self._failure(fault)
                for session in sessions:
                    session.show_status(None, {"over": told.message})
            await asyncio.sleep(max(FRAME_S / 10, now_s + FRAME_S - loop.time()))

    async def _show_round(self, sessions: Sequence[Session], now_s: float, *, with_status: bool) -> None:
        asked = [(session, *session.asked(now_s)) for session in sessions]
        framed = [item for item in asked if item[0].is_news("frame", (item[1], item[2].at_ns))]
        told = {session: what.at_ns for session, _, what in asked if with_status}
        times = {at_ns for session, at_ns in told.items() if session.is_news("status", at_ns)}
        after = min((session.last_entry for session in told), default=None)
        if framed or told:
            frames, found, entries = await self._call(self._read, [what for _, _, what in framed], times, after)
            for (session, generation, what), frame in zip(framed, frames, strict=True):
                session.show_frame(generation, what, frame)
            for session, at_ns in told.items():
                session.show_status(at_ns, found.get(at_ns, {}))
                session.show_log(entries)

    def _read(
        self, asked: Sequence[Asked], times: Iterable[int | None], after: int | None
    ) -> tuple[list[Frame], dict[int | None, Facts], list[Facts]]:
        frames = self._source.frames(asked) if asked else []
        entries = [] if after is None else self._source.log(after)
        return frames, {at_ns: self._source.status(at_ns) for at_ns in times}, entries
