"""Bodies: skeletons, postures and motions on them, anatomy, limits, limbs, mirror images, contact with the floor."""
