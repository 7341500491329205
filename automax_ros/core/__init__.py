"""What every floor speaks: number types, integer time, problem codes and diagnostics."""
