"""Credits: whose movement a movement is made of, and under which licences."""
