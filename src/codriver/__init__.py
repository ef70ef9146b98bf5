"""codriver: virtual sensors for what the person driving or riding intends and does."""

__version__ = "0.1.0"
