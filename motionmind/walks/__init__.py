"""Corpus walks between given postures: their marginals, their mean, and passages that add recorded detail."""
