"""The same observers on a live bus."""

from codriver.live.can_bus import BusDecoder, listen
from codriver.live.session import Live

__all__ = ["BusDecoder", "Live", "listen"]
