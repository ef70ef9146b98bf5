"""Record a step on symbolic scalars, and print it: LLVM for batch and live, C99 for export."""

from codriver.kernel.expressions import Scalar, both, either, minimum, negate, select, sqrt
from codriver.kernel.record import Recorded, record

__all__ = ["Recorded", "Scalar", "both", "either", "minimum", "negate", "record", "select", "sqrt"]
