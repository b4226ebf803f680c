"""Scenarios driven: simulated, bounded, with faults injected, held against service levels."""
