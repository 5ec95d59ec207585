"""The live page: what a running session shows in a browser of the same computer."""

from isiw.server.live.page import LivePage, watch

__all__ = ["LivePage", "watch"]
