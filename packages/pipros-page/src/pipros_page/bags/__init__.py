"""Open, play, export and record bags on the page, and draw their tracks."""
