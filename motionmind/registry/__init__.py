"""Corpora on the network: indexes of published corpora, fetching them, and publishing one's own.

An index is a JSON file that lists corpora, each with its licence and the size and SHA-256 of its archive and of every
file in it, and recipes for collections that may not be redistributed. All data that an index names is untrusted: it is
limited in size, verified and validated before it becomes a corpus.
"""
