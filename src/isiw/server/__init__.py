"""Sessions over HTTP: for labs whose software is not written in Python, and as a live page. Needs `isiw[serve]`."""

import importlib.util

from isiw.errors import ConfigError

if any(importlib.util.find_spec(name) is None for name in ("fastapi", "plotly", "uvicorn")):
    raise ConfigError("the server's libraries are not installed", remedy='Install them with: pip install "isiw[serve]"')

from isiw.server.app import ServerSettings, make_app, serve
from isiw.server.guard import Rules

__all__ = ["Rules", "ServerSettings", "make_app", "serve"]
