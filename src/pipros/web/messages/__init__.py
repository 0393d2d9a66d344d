"""Messages on the page: their layout in memory, trees of their values, pictures, search patterns."""
