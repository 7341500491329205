"""C to a shared library, and its functions called scan by scan or by columns."""
