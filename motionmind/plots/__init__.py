"""Plots on one canvas, as SVG and PNG: joint graphs, and variations on their attractors."""
