"""Who plays how well, and how sure that is: many games, summed up and compared."""
