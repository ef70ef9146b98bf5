"""Programs as C99 for a control unit."""

from codriver.export.c_files import export_c

__all__ = ["export_c"]
