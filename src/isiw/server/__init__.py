"""Sessions over HTTP, for labs whose software is not written in Python. Needs `isiw[serve]`."""

import importlib.util

from isiw.errors import ConfigError

if importlib.util.find_spec("fastapi") is None or importlib.util.find_spec("uvicorn") is None:
    raise ConfigError("the server's libraries are not installed", remedy='Install them with: pip install "isiw[serve]"')

from isiw.server.app import make_app
from isiw.server.guard import Rules
from isiw.server.serving import ServerSettings, serve

__all__ = ["Rules", "ServerSettings", "make_app", "serve"]
