"""Images on the page: pixels for browsers, shapes over them, and pairs of two topics."""
