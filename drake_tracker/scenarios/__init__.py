"""Reads scenario files: values that remember where they were written, checked against dataclasses."""
