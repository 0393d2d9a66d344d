"""Images on the page: pixels for browsers, shapes over images, and pairs of images from two topics."""
