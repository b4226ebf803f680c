"""Evaluation of scenarios: simulation, error bound, fault injection, service levels."""
