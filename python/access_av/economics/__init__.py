"""Money, carbon and energy of a fleet; every figure has a source."""
