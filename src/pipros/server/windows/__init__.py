"""Windows of OpenCV (`cv2.imshow`, trackbars, mouse) on a page, if its build has no GUI."""
