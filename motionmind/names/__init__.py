"""Names of movement and postures, such as ballet/arabesque and clip.bvh@240: how they are spelled, what they name."""
