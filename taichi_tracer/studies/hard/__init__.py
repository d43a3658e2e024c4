"""The parts of the stability suite: modes and their promises, oracles, constructions, and the catalogue of cases."""
