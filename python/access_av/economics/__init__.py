"""Money, carbon and energy of a fleet, with the sources of every figure."""
