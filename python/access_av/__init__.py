"""Localization of factory vehicles from 5G synchronization signal blocks (SSBs)."""
