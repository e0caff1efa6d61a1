"""The search for the cheapest path through a problem of coupled chains, and the proof of its quality.

Lockstep A* (`astar`) finds the path. Its heuristic is a bound by messages (`trws`) or by pair chains (`pair_chains`),
its incumbent a path that descends along the bound and is polished (`polish`), and the trellis that it searches is what
both leave (`bounding`). The package knows nothing about bodies or grammars.
"""
