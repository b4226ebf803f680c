"""Fault campaign: faults are injected into the running node, and its outputs are judged."""
