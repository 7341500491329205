"""Execution of tasks: common memory, time, scans."""
