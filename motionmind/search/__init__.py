"""The search for the cheapest path through a problem of coupled chains, and the proof of how good it is.

It knows no bodies and no grammar.
"""
