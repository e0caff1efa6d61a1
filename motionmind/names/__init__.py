"""Names of movements and postures, such as ballet/arabesque and clip.bvh@240: how to parse and resolve them."""
