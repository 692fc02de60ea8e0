"""Live pages: a run, a tracker's stream or a playground in the browser, over a small server.

FastAPI and uvicorn, the extra ``[view]``, are imported when a server is started.
"""

from driftwalk.viewer.control_stream import pilot
from driftwalk.viewer.hub import Source
from driftwalk.viewer.live_client import LiveSource
from driftwalk.viewer.play.model_playground import ModelPlaySource
from driftwalk.viewer.play.playground import PlaySource, hello_line
from driftwalk.viewer.play.saved import save_playground
from driftwalk.viewer.server import require_server, serve
from driftwalk.viewer.watch.run_page import RunSource

__all__ = [
    "LiveSource",
    "ModelPlaySource",
    "PlaySource",
    "RunSource",
    "Source",
    "hello_line",
    "pilot",
    "require_server",
    "save_playground",
    "serve",
]
