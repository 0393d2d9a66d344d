"""OpenCV's windows (`cv2.imshow`, trackbars, mouse) on a page, if OpenCV was built without a GUI."""
