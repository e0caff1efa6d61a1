"""Movement from one skeleton to another: onto human23 where the joints map to it."""
