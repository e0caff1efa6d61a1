"""Corpora that others publish: indexes of them, fetching them, and publishing one's own.

An index is a JSON file that lists corpora, each with its licence, and the size and SHA-256 of its archive and of every
file in it; and recipes for collections that may not be passed on. Everything that an index names is data from outside:
it is bounded, verified and validated before it becomes a corpus.
"""
