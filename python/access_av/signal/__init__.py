"""From samples to angles: SSBs, angle estimators, recordings of arrays."""
