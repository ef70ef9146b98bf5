"""The interfaces as checklists that can be run: for codriver's own parts and for yours.

Each function raises AssertionError with what is broken.
"""

from codriver.testing.checks import check_observer, check_reader, check_vehicle

__all__ = ["check_observer", "check_reader", "check_vehicle"]
