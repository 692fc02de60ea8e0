"""The routes: the page, its front end, the files of a run, the WebSocket; and who is too slow.

FastAPI and uvicorn are imported here, so this module is imported when a server is started.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from typing import Any, Final

from fastapi import FastAPI, HTTPException
from fastapi.responses import FileResponse, HTMLResponse, PlainTextResponse, Response
from starlette.datastructures import Headers, QueryParams
from starlette.types import ASGIApp, Message as AsgiMessage, Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect
from uvicorn.protocols.http.auto import AutoHTTPProtocol

from driftwalk.page.html import BUNDLE, bundle_file, html_shell, page_frame
from driftwalk.viewer.hub import Content, Hub, Outbox, Source, make_message, parsed
from driftwalk.viewer.security import HEADERS, Gate

REQUEST_S: Final = 10.0
"""For how long a connection may take to send a whole request [s]. The head of one has some hundred
bytes: a phone on a bad line needs a second or two. A client that sends half of it and waits would
otherwise hold an open file of the server without end; chosen by hand."""


def make_app(source: Source, gate: Gate, *, failed: Callable[[BaseException], None]) -> ASGIApp:
    """Return the application of a server.

    Parameters
    ----------
    source : Source
        Source of the page.
    gate : Gate
        Who may come in.
    failed : callable
        Called with the error with which the source ended.
    """
    hub = Hub(source.watched)

    @contextlib.asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:  # noqa: ARG001
        task = asyncio.create_task(source.run(hub.publish))
        task.add_done_callback(
            lambda done: (
                None if done.cancelled() or (error := done.exception()) is None else failed(error)
            )
        )
        yield
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError, Exception):
            await task

    app = FastAPI(lifespan=lifespan, docs_url=None, redoc_url=None, openapi_url=None)

    @app.get("/")
    def page() -> HTMLResponse:
        return HTMLResponse(html_shell(page_frame(source.view, source.title), token=gate.token))

    @app.get("/{name}")
    def whole_file(name: str) -> Response:
        if name in BUNDLE:
            return Response(bundle_file(name), media_type=BUNDLE[name])
        text = source.report() if name == "report.html" else None
        if text is None:
            raise HTTPException(404)
        # To be kept and opened later; here the header that guards the page would stop it.
        attachment = {"Content-Disposition": 'attachment; filename="report.html"'}
        return HTMLResponse(text, headers=attachment)

    @app.get("/files/{name:path}")
    def file_of_run(name: str) -> FileResponse:
        path = source.file(name)
        if path is None:
            raise HTTPException(404)
        return FileResponse(path, media_type="application/octet-stream", filename=path.name)

    @app.websocket("/ws")
    async def talk(websocket: WebSocket) -> None:
        await websocket.accept()
        box = hub.join(source.greeting())
        if box is None:
            # The code for "try again later": too many browsers.
            await websocket.close(1013)
            return
        try:
            await _talk(websocket, box, source)
        finally:
            hub.leave(box)

    return _Guard(app, gate)


async def _talk(websocket: WebSocket, box: Outbox, source: Source) -> None:
    """Send what waits and take what comes until either side ends."""
    tasks = [
        asyncio.create_task(_send(websocket, box)),
        asyncio.create_task(_listen(websocket, box, source)),
    ]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        results = await asyncio.gather(*tasks, return_exceptions=True)
    for error in results:
        # A browser may leave at any moment; that is no fault of anyone.
        gone = (WebSocketDisconnect, asyncio.CancelledError)
        if isinstance(error, BaseException) and not isinstance(error, gone):
            raise error


async def _send(websocket: WebSocket, box: Outbox) -> None:
    while True:
        text = await box.next()
        try:
            await websocket.send_text(text)
        except (OSError, RuntimeError) as error:
            # What the layers below say when the browser went away while this was on its way.
            raise WebSocketDisconnect from error


async def _listen(websocket: WebSocket, box: Outbox, source: Source) -> None:
    def reply(content: Content) -> None:
        box.put(make_message(content))

    try:
        while (message := await websocket.receive())["type"] == "websocket.receive":
            content = parsed(message.get("text") or "")
            if content is None:
                continue
            if content.get("type") == "ready":
                box.drawn()
            else:
                await source.receive(content, reply)
            # A client that sends without pause must not keep the others waiting.
            await asyncio.sleep(0)
    finally:
        await source.leave(reply)


class PatientHTTP(AutoHTTPProtocol):  # type: ignore[misc, valid-type]
    """HTTP of uvicorn, which closes a connection that is slow to ask, whatever trickles in."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no longer."""
        if self._deadline is not None:
            self._deadline.cancel()
        super().connection_lost(exc)

    def on_response_complete(self) -> None:
        """Begin to wait for the next request."""
        self._wait()
        super().on_response_complete()

    def _wait(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = self.loop.call_later(REQUEST_S, self._give_up)

    def _give_up(self) -> None:
        # An answer that is on its way may take longer, and a WebSocket has taken over for good.
        answering = self.cycle is not None and not self.cycle.response_complete
        if not answering and self.transport.get_protocol() is self:
            self.transport.abort()


class _Guard:
    """Stands before everything: nothing inside sees a request that the gate refuses."""

    def __init__(self, app: ASGIApp, gate: Gate) -> None:
        self._app, self._gate = app, gate

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        words = self._gate.refusal(_headers(scope), QueryParams(scope["query_string"]))
        if scope["type"] == "websocket":
            if words is None:
                await self._app(scope, receive, send)
            else:
                await receive()
                await send({"type": "websocket.close", "code": 1008, "reason": words})
            return
        answer: ASGIApp = self._app
        if words is not None:
            answer = PlainTextResponse(f"driftwalk: {words}\n", status_code=403)

        async def send_with_headers(message: AsgiMessage) -> None:
            if message["type"] == "http.response.start":
                own = [(name.lower().encode(), value.encode()) for name, value in HEADERS.items()]
                message = {**message, "headers": [*message.get("headers", ()), *own]}
            await send(message)

        await answer(scope, receive, send_with_headers)


def _headers(scope: Scope) -> dict[str, str]:
    """Return the headers; one that is given twice has no value that the gate would take."""
    headers = Headers(scope=scope)
    return {name: ", ".join(headers.getlist(name)) for name in set(headers.keys())}
