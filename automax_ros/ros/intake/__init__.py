"""Messages and requests that come in: bounded, read without the interpreter, between two scans."""
