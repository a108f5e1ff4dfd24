"""A local web server for the page on which the contacts of a demonstration are clicked."""

from __future__ import annotations

import json
import secrets
import webbrowser
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

import numpy as np

from drake_aerial.annotation.demonstration_draft import DemonstrationDraft, check_file_name
from drake_aerial.errors import InputError
from drake_aerial.io.strict_yaml import mapping_from_json
from drake_aerial.skill.demonstration import CABLE_LENGTH

_LARGEST_REQUEST = 1_000_000


class DemonstrationServer:
    """Web server of a draft's page on 127.0.0.1, as a context manager.

    The URL has a secret part, so that no other page or user of the machine can write the file.

    Attributes
    ----------
    url : str
        Address of the page.
    saved : threading.Event
        Set when the file has been written.
    """

    def __init__(
        self,
        draft: DemonstrationDraft,
        out: str | Path,
        *,
        name: str | None = None,
        cable_length: float = CABLE_LENGTH,
        port: int = 0,
    ):
        """Open the port; 0 takes a free one. The page writes `out`.

        Raises
        ------
        InputError
            If the port cannot be opened.
        """
        self.draft = draft
        self.out = Path(out)
        self.name = name or self.out.stem
        self.cable_length = cable_length
        self.saved = Event()
        self._lock = Lock()
        secret = secrets.token_urlsafe(12)
        owner = self

        class Handler(_Handler):
            server_owner = owner
            prefix = f"/{secret}"

        try:
            self._server = ThreadingHTTPServer(("127.0.0.1", port), Handler)
        except (OSError, OverflowError) as error:
            raise InputError(
                f"cannot listen on port {port}: {error}; give another port (--port), "
                "0 for any free one"
            ) from error
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/{secret}/"

    def __enter__(self) -> DemonstrationServer:
        Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True
        ).start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._server.shutdown()
        self._server.server_close()

    def scene(self) -> dict[str, Any]:
        """Return the page's initial values, as JSON types."""
        cloud = self.draft.cloud
        return {
            "name": self.name,
            "file": str(self.out),
            "cable_length": self.cable_length,
            "contact_radius": self.draft.contact_radius,
            "up": cloud.up.tolist(),
            "low": cloud.points.min(0).tolist(),
            "high": cloud.points.max(0).tolist(),
            "points": len(cloud),
        }

    def touch(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the contact of a gripper at request["position"]."""
        touch = self.draft.touch(request.get("position"))  # type: ignore[arg-type]
        return {
            "position": touch.position.tolist(),
            "normal": touch.normal.tolist(),
            "features": touch.features,
            "surface": touch.surface,
        }

    def save(self, request: dict[str, Any]) -> dict[str, Any]:
        """Write the demonstration of request["grippers"].

        Each gripper has `position`, `cable_length` and `cable_direction`.
        """
        grippers = request.get("grippers")
        if not isinstance(grippers, list) or not grippers:
            raise InputError("a demonstration needs at least one contact: click one on the cloud")
        try:
            demonstration = self.draft.demonstration(
                np.array([g["position"] for g in grippers], float),
                cable_length=np.array([g["cable_length"] for g in grippers], float),
                cable_directions=np.array([g["cable_direction"] for g in grippers], float),
                name=str(request.get("name") or self.name),
                description=str(request.get("description") or ""),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(
                "each contact needs a position, a cable_length and a cable_direction, got "
                f"{grippers!r:.200}"
            ) from error
        with self._lock:
            written = self.draft.write(self.out, demonstration)
        self.saved.set()
        return {"file": str(written)}


class _Handler(BaseHTTPRequestHandler):
    server_owner: DemonstrationServer
    prefix: str

    def do_GET(self) -> None:
        owner = self.server_owner
        if self.path == f"{self.prefix}/":
            self._send(
                files(__package__).joinpath("demonstration_page.html").read_bytes(),
                "text/html; charset=utf-8",
            )
        elif self.path == f"{self.prefix}/scene.json":
            self._send_json(owner.scene())
        elif self.path == f"{self.prefix}/points":
            self._send(
                owner.draft.points_and_normals().astype("<f4").tobytes(), "application/octet-stream"
            )
        else:
            self._send_json({"error": "no such page"}, HTTPStatus.NOT_FOUND)

    def do_POST(self) -> None:
        actions: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
            f"{self.prefix}/touch": self.server_owner.touch,
            f"{self.prefix}/save": self.server_owner.save,
        }
        action = actions.get(self.path)
        if action is None:
            self._send_json({"error": "no such page"}, HTTPStatus.NOT_FOUND)
            return
        try:
            length = int(self.headers.get("Content-Length", ""))
            if not 0 <= length <= _LARGEST_REQUEST:
                raise ValueError
            request = mapping_from_json(self.rfile.read(length), "the request")
        except ValueError:
            self._send_json({"error": "a request must be one JSON object"}, HTTPStatus.BAD_REQUEST)
            return
        try:
            self._send_json(action(request))
        except InputError as error:
            self._send_json({"error": " ".join(str(error).split())}, HTTPStatus.BAD_REQUEST)

    def _send_json(self, document: dict[str, Any], status: HTTPStatus = HTTPStatus.OK) -> None:
        self._send(json.dumps(document).encode(), "application/json", status)

    def _send(self, body: bytes, kind: str, status: HTTPStatus = HTTPStatus.OK) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Do not log requests."""


def demonstrate(
    draft: DemonstrationDraft,
    out: str | Path,
    *,
    name: str | None = None,
    cable_length: float = CABLE_LENGTH,
    port: int = 0,
    open_browser: bool = True,
    tell: Callable[[str], None] | None = None,
) -> Path:
    """Let the user click contacts in the browser; return the saved DEMONSTRATION.yaml.

    Parameters
    ----------
    draft : DemonstrationDraft
    out : str or Path
        The file to write, .yaml.
    name : str, optional
        Name of the demonstration; the file's stem by default.
    cable_length : float
        Initial length of the first cable [m]; the page can change it.
    port : int
        0 takes a free one.
    open_browser : bool
        Open the page in the browser.
    tell : callable, optional
        Called with the page's URL.

    Raises
    ------
    InputError
        If the file's name does not end in .yaml or .yml, or the port cannot be opened.
    """
    check_file_name(Path(out))
    with DemonstrationServer(draft, out, name=name, cable_length=cable_length, port=port) as server:
        if tell is not None:
            tell(server.url)
        if open_browser:
            webbrowser.open(server.url)
        # On some systems a wait without a timeout blocks Ctrl-C.
        while not server.saved.wait(0.2):
            pass
    return server.out
