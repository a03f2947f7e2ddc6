"""Serves the editor to the browser of this machine until it is interrupted."""

import socket
import threading
import webbrowser
from collections.abc import Callable
from dataclasses import dataclass

from toponav.core.errors import InputError
from toponav.core.files import os_fault
from toponav.maps.editor.floor import Floor
from toponav.maps.editor.guard import new_token
from toponav.maps.editor.map_file import MapFile
from toponav.maps.editor.work import Workshop

__all__ = ["Editor", "listen"]

_LOOPBACK = "127.0.0.1"
_LARGEST_PORT = 65535


@dataclass(frozen=True)
class Editor:
    """A map that is about to be edited.

    Args:
        file: The map's file.
        workshop: Answers questions about the map.
        floor: What is drawn under it, where that is known.
    """

    file: MapFile
    workshop: Workshop
    floor: Floor | None = None

    def serve(
        self,
        *,
        port: int = 0,
        open_browser: bool = True,
        announce: Callable[[str], None] = print,
    ) -> None:
        """Serves the page on 127.0.0.1 until the process is interrupted.

        Args:
            port: Port to listen on; any free one when 0.
            open_browser: Whether to open the page in the user's browser.
            announce: Is told the page's address, which holds the secret of this launch.

        Raises:
            InputError: If the extra `editor` is not installed, the port is taken, or the file
                holds no map.
        """
        try:
            import uvicorn

            from toponav.maps.editor.app import make_app
        except ModuleNotFoundError as error:
            raise InputError(
                f"the editor needs the package {error.name}, which is not installed",
                where="toponav map edit",
                remedy="pip install 'toponav[editor]'",
            ) from None
        self.file.open()
        with listen(port) as bound:
            port = bound.getsockname()[1]
            token = new_token()
            app = make_app(self.file, self.workshop, self.floor, token=token, port=port)
            config = uvicorn.Config(
                app,
                log_level="error",
                access_log=False,
                server_header=False,
                lifespan="off",
                ws="none",
                timeout_graceful_shutdown=2,
            )
            address = f"http://{_LOOPBACK}:{port}/?token={token}"
            announce(address)
            if open_browser:
                threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
            uvicorn.Server(config).run(sockets=[bound])


def listen(port: int) -> socket.socket:
    """A socket that listens on the loopback interface: other machines cannot reach it.

    Raises:
        InputError: If the port is taken or none.
    """
    if not 0 <= port <= _LARGEST_PORT:
        raise InputError(
            f"a port is a number from 0 to {_LARGEST_PORT}, got {port}",
            where="--port",
            remedy="leave it out to take any free port",
        )
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind((_LOOPBACK, port))
        bound.listen()
    except OSError as error:
        bound.close()
        fault = os_fault(error, f"port {port}", verb="be listened on")
        raise InputError(
            fault.rule, where=f"--port {port}", remedy="leave it out to take any free port"
        ) from None
    return bound
